"""Promises of the mux; messages are plain numbers here, zero is standing still."""

from __future__ import annotations

import math
from collections.abc import Iterable

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from rbxcompose.domains.muxes.core import LockSource, MuxAccount, MuxCore, MuxSource

INPUTS = {"safety": MuxSource(200, 0.2), "teleop": MuxSource(100, 0.5), "navigation": MuxSource(10, 0.5)}
LOCKS = {"door": LockSource(150, 0.3)}


def still(message: float) -> bool:
    return message == 0.0


def rest(last: float | None) -> float:
    return 0.0


def mux(*, locks: dict[str, LockSource] | None = None, stopped: bool = False) -> MuxCore[float]:
    return MuxCore(INPUTS, zero=rest, is_zero=still, locks=locks, stopped=stopped)


def test_the_only_live_input_passes() -> None:
    assert mux().receive("navigation", 1.0, 0.0) == 1.0


def test_the_larger_priority_wins_while_it_lives() -> None:
    core = mux()
    core.receive("teleop", 2.0, 0.0)
    assert core.receive("navigation", 1.0, 0.5) is None
    assert core.active == "teleop"


def test_exactly_at_its_timeout_an_input_still_counts_and_just_after_it_does_not() -> None:
    core = mux()
    core.receive("teleop", 2.0, 0.0)
    assert core.receive("navigation", 1.0, 0.5) is None
    assert core.receive("navigation", 1.0, math.nextafter(0.5, 1.0)) == 1.0


def test_hand_back_goes_to_the_next_priority_without_a_leak_from_below() -> None:
    core = mux()
    core.receive("safety", 3.0, 0.0)
    core.receive("teleop", 2.0, 0.1)
    assert core.receive("navigation", 1.0, 0.3) is None
    assert core.receive("teleop", 2.0, 0.3) == 2.0


def test_when_everything_ends_one_zero_is_sent_and_then_silence() -> None:
    core = mux()
    core.receive("navigation", 1.0, 0.0)
    assert core.tick(0.5) is None
    assert core.tick(0.51) == 0.0
    assert core.tick(0.52) is None
    assert core.tick(100.0) is None


def test_no_zero_comes_between_an_input_that_ends_and_one_that_lives() -> None:
    core = mux()
    core.receive("teleop", 2.0, 0.0)
    core.receive("navigation", 1.0, 0.4)
    assert core.tick(0.6) is None
    assert core.active == "navigation"
    assert core.tick(0.95) == 0.0


def test_a_mux_that_let_nothing_through_sends_no_zero() -> None:
    core = mux()
    assert core.tick(0.0) is None
    assert core.next_deadline() is None


def test_it_must_be_woken_at_the_first_moment_after_the_timeout_of_the_winner() -> None:
    core = mux()
    core.receive("teleop", 2.0, 1.0)
    deadline = core.next_deadline()
    assert deadline == math.nextafter(1.5, 2.0)
    assert core.tick(1.5) is None
    assert core.tick(deadline) == 0.0
    assert core.next_deadline() is None


def test_a_zero_that_is_due_is_not_forgotten_when_another_input_is_refused_first() -> None:
    core = mux(locks=LOCKS)
    core.heartbeat("door", 0.0)
    core.receive("teleop", 2.0, 0.1)
    core.receive("navigation", 1.0, 0.4)
    assert core.next_deadline() == 0.4
    assert core.tick(0.4) == 0.0


def test_stop_sends_zero_at_once_and_lets_nothing_through() -> None:
    core = mux()
    core.receive("safety", 3.0, 0.0)
    assert core.stop(0.1) == 0.0
    assert core.is_stopped
    assert core.active is None
    assert core.receive("safety", 3.0, 0.2) is None
    assert core.tick(10.0) is None


def test_release_moves_nothing_while_an_input_goes_on_as_during_the_stop() -> None:
    core = mux()
    core.stop(0.0)
    core.receive("teleop", 2.0, 0.1)
    core.release(0.2)
    for now in (0.3, 0.6, 0.9):
        assert core.receive("teleop", 2.0, now) is None


def test_after_release_an_input_that_sent_zero_moves_again() -> None:
    core = mux()
    core.stop(0.0)
    core.receive("teleop", 2.0, 0.1)
    core.release(0.2)
    assert core.receive("teleop", 0.0, 0.3) == 0.0
    assert core.receive("teleop", 2.0, 0.4) == 2.0


def test_after_release_an_input_that_was_silent_for_its_timeout_moves_again() -> None:
    core = mux()
    core.stop(0.0)
    core.receive("teleop", 2.0, 0.1)
    core.release(0.2)
    assert core.receive("teleop", 2.0, 0.7) == 2.0


def test_an_input_that_came_to_rest_during_the_stop_moves_after_release() -> None:
    core = mux()
    core.receive("navigation", 1.0, 0.0)
    core.stop(0.1)
    core.receive("navigation", 0.0, 0.2)
    core.release(0.3)
    assert core.receive("navigation", 1.0, 0.4) == 1.0


def test_an_input_that_waits_does_not_hold_back_a_lower_one() -> None:
    core = mux()
    core.stop(0.0)
    core.receive("teleop", 2.0, 0.1)
    core.release(0.2)
    assert core.receive("navigation", 1.0, 0.3) == 1.0


def test_a_mux_that_was_stopped_when_it_died_comes_back_stopped() -> None:
    core = mux(stopped=True)
    assert core.is_stopped
    assert core.receive("teleop", 2.0, 5.0) is None


def test_after_a_restart_release_moves_nothing_even_if_nobody_was_heard_yet() -> None:
    core = mux(stopped=True)
    core.release(5.0)
    assert core.receive("teleop", 2.0, 5.1) is None
    assert core.receive("navigation", 1.0, 6.0) == 1.0


def test_release_without_a_stop_changes_nothing() -> None:
    core = mux()
    core.receive("teleop", 2.0, 0.0)
    core.release(0.1)
    assert core.receive("teleop", 2.0, 0.2) == 2.0


def test_a_silent_lock_holds_back_what_has_a_smaller_priority_and_nothing_else() -> None:
    core = mux(locks=LOCKS)
    assert core.receive("teleop", 2.0, 0.0) is None
    assert core.receive("safety", 3.0, 0.1) == 3.0


def test_a_lock_of_the_same_priority_holds_nothing_back() -> None:
    core = mux(locks={"door": LockSource(100, 0.3)})
    assert core.receive("teleop", 2.0, 0.0) == 2.0


def test_a_lock_that_falls_silent_ends_the_motion_with_a_zero() -> None:
    core = mux(locks=LOCKS)
    core.heartbeat("door", 0.0)
    core.receive("teleop", 2.0, 0.1)
    deadline = core.next_deadline()
    assert deadline == math.nextafter(0.3, 1.0)
    assert core.tick(deadline) == 0.0


def test_a_lock_that_is_heard_again_opens() -> None:
    core = mux(locks=LOCKS)
    core.receive("teleop", 2.0, 0.0)
    core.heartbeat("door", 0.1)
    assert core.active == "teleop"
    assert core.receive("teleop", 2.0, 0.2) == 2.0


def test_closing_sends_one_zero_and_nothing_more() -> None:
    core = mux()
    core.receive("teleop", 2.0, 0.0)
    assert core.close(0.1) == 0.0
    assert core.receive("safety", 3.0, 0.2) is None
    assert core.tick(5.0) is None
    assert core.next_deadline() is None


def test_it_says_who_holds_the_output() -> None:
    core = mux()
    core.receive("navigation", 1.0, 2.81)
    assert MuxAccount(core).why(3.0) == "navigation holds"


def test_it_says_why_nothing_passes() -> None:
    core = mux(locks=LOCKS)
    assert MuxAccount(mux()).why(0.0) == "no input"
    silent = "door gives no heartbeat: teleop and navigation are locked out"
    assert (MuxAccount(core).why(0.0), core.refused(0.0)) == (silent, [])
    core.receive("teleop", 2.0, 0.0)
    assert (MuxAccount(core).why(0.1), core.refused(0.1)) == (silent, ["teleop"])
    core.stop(0.2)
    assert MuxAccount(core).why(0.2) == "stopped"
    core.release(0.3)
    assert MuxAccount(core).why(0.3) == f"teleop must come to rest once; {silent}"
    core.close(0.4)
    assert MuxAccount(core).why(0.4) == "closed: the robot is going down"


def test_an_input_above_a_silent_lock_holds_while_the_others_are_locked_out() -> None:
    core = mux(locks=LOCKS)
    core.receive("safety", 3.0, 0.1)
    assert MuxAccount(core).why(0.1).startswith("safety holds; door gives no heartbeat: ")
    core.heartbeat("door", 0.2)
    assert (MuxAccount(core).why(0.2), core.locked_out(0.2)) == ("safety holds", [])


def test_a_lock_that_falls_silent_is_told_in_time_though_nothing_moves() -> None:
    core = mux(locks=LOCKS)
    core.heartbeat("door", 1.0)
    deadline = core.next_deadline()
    assert deadline == math.nextafter(1.3, 2.0)
    assert core.locked_out(1.3) == []
    assert core.locked_out(deadline) == ["teleop", "navigation"]


@pytest.mark.parametrize("name", ["moon", ""])
def test_an_input_that_is_not_configured_is_a_mistake_of_the_caller(name: str) -> None:
    with pytest.raises(KeyError):
        mux().receive(name, 1.0, 0.0)


MESSAGES = st.sampled_from([0.0, 1.0, 2.0])
LETTING_GO = {**INPUTS, "teleop": MuxSource(100, 0.5, zero_releases=True)}
EVERY_LOCK = {**LOCKS, "pause": LockSource(50, is_flag=True)}


class AnyHistory(RuleBasedStateMachine):
    """Whatever happens in whatever order, a model that keeps only what was heard says what comes out."""

    def __init__(self) -> None:
        super().__init__()
        self.core = MuxCore(LETTING_GO, zero=rest, is_zero=still, locks=EVERY_LOCK)
        self.now = 0.0
        self.heard: dict[str, tuple[float, float]] = {}  # input -> when, what
        self.door, self.is_paused = -math.inf, False
        self.by_hand: dict[str, float] = {}  # input -> until when
        self.waiting: set[str] = set()  # went on during a stop or a lock by hand, have not come to rest since
        self.stopped = self.closed = False
        self.passed = self.zeros_of_ticks = 0
        self.moving = False  # the last thing that came out was not zero

    def sends(self, name: str) -> bool:
        return name in self.heard and self.now <= self.heard[name][0] + INPUTS[name].timeout

    def live(self, name: str) -> bool:
        has_let_go = LETTING_GO[name].zero_releases and name in self.heard and still(self.heard[name][1])
        return self.sends(name) and not has_let_go

    def floor(self) -> float:
        door = EVERY_LOCK["door"].priority if self.now > self.door + LOCKS["door"].timeout else -math.inf
        return max(door, EVERY_LOCK["pause"].priority if self.is_paused else -math.inf)

    def winner(self) -> str | None:
        free = [
            name
            for name, source in INPUTS.items()
            if self.live(name)
            and name not in self.waiting
            and name not in self.by_hand
            and source.priority >= self.floor()
        ]
        held = self.stopped or self.closed or not free
        return None if held else max(free, key=lambda name: INPUTS[name].priority)

    def must_rest(self, names: Iterable[str]) -> None:
        self.waiting |= {name for name in names if self.sends(name) and not still(self.heard[name][1])}

    def end_locks(self) -> None:
        """End the locks by hand whose time is over."""
        ended = [name for name, until in self.by_hand.items() if until <= self.now]
        for name in ended:
            del self.by_hand[name]
        self.must_rest(ended)

    @rule(duration=st.sampled_from([0.0, 0.05, 0.1, 0.25, 0.6]))
    def time_passes(self, duration: float) -> None:
        end = self.now + duration
        while (deadline := self.core.next_deadline()) is not None and deadline <= end:
            self.now = max(self.now, deadline)
            self.tick()
        self.now = end

    @rule()
    def tick(self) -> None:
        self.end_locks()
        zero = self.core.tick(self.now)
        if zero is not None:
            assert zero == 0.0
            assert self.winner() is None
            self.zeros_of_ticks += 1
            self.moving = False
        assert self.core.tick(self.now) is None
        assert self.core.active == self.winner()
        assert not self.moving or self.winner() is not None

    @rule(name=st.sampled_from(sorted(INPUTS)), message=MESSAGES)
    def receive(self, name: str, message: float) -> None:
        before = self.winner()
        if still(message) or not self.sends(name):
            self.waiting.discard(name)
        self.heard[name] = self.now, message
        out = self.core.receive(name, message, self.now)
        lets_go = still(message) and LETTING_GO[name].zero_releases
        assert out == (message if name == (before if lets_go else self.winner()) else None)
        if out is not None:
            self.passed += 1
            self.moving = not still(out)

    @rule()
    def heartbeat(self) -> None:
        self.door = self.now
        self.core.heartbeat("door", self.now)

    @rule(is_on=st.booleans())
    def pause(self, is_on: bool) -> None:
        self.is_paused = is_on
        self.core.flag("pause", is_on, self.now)

    @rule(name=st.sampled_from(sorted(INPUTS)), seconds=st.sampled_from([0.2, math.inf]))
    def lock(self, name: str, seconds: float) -> None:
        self.by_hand[name] = self.now + seconds
        self.core.lock([name], self.now + seconds, self.now)

    @rule(name=st.sampled_from(sorted(INPUTS)))
    def unlock(self, name: str) -> None:
        self.by_hand.pop(name, None)
        self.core.unlock([name], self.now)

    @rule()
    def stop(self) -> None:
        assert self.core.stop(self.now) == 0.0
        self.stopped = True
        self.moving = False

    @rule()
    def release(self) -> None:
        self.core.release(self.now)
        if self.stopped:
            self.must_rest(self.heard)
        self.stopped = False

    @precondition(lambda self: self.now > 2.0 and not self.closed)
    @rule()
    def close(self) -> None:
        assert self.core.close(self.now) == 0.0
        self.closed = True
        self.moving = False

    @invariant()
    def a_zero_of_its_own_follows_something_that_passed(self) -> None:
        assert self.zeros_of_ticks <= self.passed

    @invariant()
    def while_something_moves_a_wake_up_is_due(self) -> None:
        assert not self.moving or self.core.next_deadline() is not None


TestAnyHistory = AnyHistory.TestCase
TestAnyHistory.settings = settings(stateful_step_count=50)
