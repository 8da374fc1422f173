"""Turns lent to threads that bring messages: whatever the order of events, components see one thread at a time.

A turn does not depend on which thread takes it, so each interleaving of threads is a row of calls in one thread.
"""

from __future__ import annotations

import selectors
import threading
from collections.abc import Callable, Iterator
from functools import partial
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.clock import MonotonicClock, SteppedClock
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.runtime.process_group.connection import MOST, REST, SLOW, CallbackInbox, Turns

NEVER = 1e9  # [s]
OWNERS = st.sampled_from(["a", "b", "c"])
SIZES = st.integers(0, 30)
KINDS = st.sampled_from(["bring", "bring", "bring", "post", "rest", "resume", "advance", "timer", "nested", "slow"])


class Process:
    """A scheduler whose own thread rests and resumes as a test says; it checks each callback."""

    def __init__(self) -> None:
        self.clock, self.scheduler, self.inbox = SteppedClock(), Scheduler(), CallbackInbox()
        self.turns = Turns(self.scheduler, self.clock, self.inbox)
        self.turns.open()
        self.scheduler.on_error = self._failed
        self.is_resting = self.is_in_callback = False
        self.brought: list[str] = []  # the owners of messages, by number
        self.ran: list[int] = []
        self.lent: list[int] = []  # those that ran in lent turns
        self.timers: set[float] = set()  # [s], those that have not run yet
        self.errors: list[str] = []

    def _failed(self, owner: str, error: BaseException) -> None:
        assert not self.is_resting, "the scheduler's own thread handles errors"
        self.errors.append(f"{owner}: {error}")

    def rest(self) -> None:
        if not self.is_resting:
            due = self.scheduler.next_due()
            self.is_resting = True
            self.turns.rest(NEVER if due is None else due)

    def resume(self) -> None:
        if self.is_resting:
            self.is_resting = False
            self.turns.resume()
        self.inbox.drain(self.scheduler)
        self.scheduler.advance(self.clock.now())

    def wait(self, seconds: float) -> None:
        self.clock.advance_to(self.clock.now() + seconds)

    def bring(self, owner: str, *consequences: Callable[[], object]) -> None:
        self.turns.bring(owner, self._message(owner, consequences))

    def post(self, owner: str) -> None:
        """Put in a message as threads do that get no turns."""
        self.inbox.put(owner, self._message(owner, ()))

    def timer(self, owner: str, due: float) -> None:
        self.timers.add(due)
        self.scheduler.at(due, owner, self._alone(lambda: self.timers.discard(due)))

    def light(self, owner: str) -> None:
        self.scheduler.post_light(owner, self._alone(lambda: None))

    def _message(self, owner: str, consequences: tuple[Callable[[], object], ...]) -> Callable[[], None]:
        number = len(self.brought)
        self.brought.append(owner)

        def run() -> None:
            if self.is_resting:
                assert set(self.ran) == set(range(number)), "nothing overtakes what came first"
                assert all(due > self.clock.now() for due in self.timers), "what is due comes first"
                self.lent.append(number)
            self.ran.append(number)
            for consequence in consequences:
                consequence()

        return self._alone(run)

    def _alone(self, callback: Callable[[], None]) -> Callable[[], None]:
        def run() -> None:
            assert not self.is_in_callback, "one callback at a time"
            self.is_in_callback = True
            try:
                callback()
            finally:
                self.is_in_callback = False

        return run


@pytest.fixture
def process() -> Iterator[Process]:
    made = Process()
    yield made
    made.inbox.close()


@given(st.lists(st.tuples(KINDS, OWNERS, SIZES), max_size=60))
def test_whatever_happens_each_message_runs_once_alone_and_in_its_order(deeds: list[tuple[str, str, int]]) -> None:
    process = Process()
    for kind, owner, size in deeds:
        match kind:
            case "bring":  # its consequences may be more than fit into a turn
                process.bring(owner, *[partial(process.light, owner)] * size)
            case "post":
                process.post(owner)
            case "rest":
                process.rest()
            case "resume":
                process.resume()
            case "advance":
                process.wait(size / 1000)
            case "timer" if not process.is_resting:
                process.timer(owner, process.clock.now() + size / 1000)
            case "nested":  # another message arrives while one is handled
                process.bring(owner, partial(process.bring, owner))
            case "slow":
                process.bring(owner, partial(process.wait, size / 1000))
    process.rest()
    process.wait(1.0)
    process.resume()
    while process.inbox.has_some:  # what came while it ran wakes it again
        process.resume()
    assert sorted(process.ran) == list(range(len(process.brought)))
    for owner in "abc":
        own = [number for number in process.ran if process.brought[number] == owner]
        assert own == sorted(own)
    assert not process.timers
    assert not process.errors
    process.inbox.close()


def test_only_a_resting_scheduler_lends_turns(process: Process) -> None:
    process.bring("a")
    assert process.ran == []
    process.resume()
    process.rest()
    process.bring("a")
    assert (process.ran, process.lent) == ([0, 1], [1])
    process.resume()
    process.turns.close()
    process.rest()
    process.bring("a")
    assert process.ran == [0, 1]


def test_a_slow_owner_gets_no_turns_for_a_hundred_times_as_long_as_it_took(process: Process) -> None:
    process.rest()
    process.bring("a", partial(process.wait, 2 * SLOW))
    process.bring("a")
    process.resume()
    process.rest()
    process.bring("b")
    process.wait(REST * 2 * SLOW - SLOW)
    process.bring("a")
    process.resume()
    process.rest()
    process.wait(2 * SLOW)
    process.bring("a")
    assert process.lent == [0, 2, 4]


def test_an_error_in_a_lent_turn_is_handled_by_the_own_thread_before_the_next_message(process: Process) -> None:
    def fail() -> None:
        raise ValueError("no")

    process.rest()
    process.bring("a", fail)
    process.bring("a")
    assert (process.ran, process.errors) == ([0], [])
    process.resume()
    assert (process.ran, process.errors) == ([0, 1], ["a: no"])


def test_what_ends_the_process_ends_it_in_the_own_thread(process: Process) -> None:
    def leave() -> None:
        raise KeyboardInterrupt

    process.rest()
    process.bring("a", leave)
    with pytest.raises(KeyboardInterrupt):
        process.resume()


@pytest.mark.parametrize("count", [MOST - 2, MOST, 3 * MOST])
def test_a_turn_ends_after_some_callbacks_and_the_own_thread_wakes_for_the_rest(process: Process, count: int) -> None:
    done: list[bool] = []
    light = partial(process.scheduler.post_light, "b", lambda: done.append(process.is_resting))
    process.rest()
    process.bring("a", *[light] * count)
    assert len(done) == min(count, MOST - 1)
    assert is_awake(process.inbox) == (count >= MOST)
    process.resume()
    assert done.count(True) == min(count, MOST - 1)
    assert len(done) == count


@pytest.mark.parametrize(("due", "wakes"), [(0.0, True), (1.0, True), (2.0, False)])
def test_the_own_thread_wakes_for_what_is_due_before_it_would_by_itself(
    process: Process, due: float, wakes: bool
) -> None:
    process.scheduler.at(1.5, "a", lambda: None)
    process.rest()
    process.bring("a", lambda: process.timer("a", due))
    assert is_awake(process.inbox) == wakes
    assert process.timers == {due}, "timers are not lent"


def test_what_only_the_own_thread_may_do_waits_for_it_within_a_lent_turn(process: Process) -> None:
    did: list[bool] = []
    deed = partial(process.turns.on_own, lambda: did.append(process.is_resting))
    deed()
    process.rest()
    process.bring("a", deed)
    assert did == [False]
    process.resume()
    assert did == [False, False]


def test_what_the_own_thread_does_for_a_component_fails_as_its_own(process: Process) -> None:
    def fail() -> None:
        raise ValueError("no")

    process.rest()
    process.bring("a", partial(process.turns.on_own, fail))
    process.resume()
    assert process.errors == ["a: no"]


def is_awake(inbox: CallbackInbox) -> bool:
    with selectors.SelectSelector() as selector:
        selector.register(inbox, selectors.EVENT_READ)
        return bool(selector.select(0.0))


def test_real_threads_never_run_two_callbacks_at_once() -> None:
    clock, scheduler, inbox = MonotonicClock(), Scheduler(), CallbackInbox()
    turns = Turns(scheduler, clock, inbox)
    turns.open()
    alone, ran = threading.Lock(), list[tuple[int, int]]()
    threads, each = 3, 400

    def handle(thread: int, number: int) -> None:
        assert alone.acquire(blocking=False), "one callback at a time"
        ran.append((thread, number))
        sum(range(Random(number).randrange(2000)))  # Python may switch to another thread here
        if number % 3 == 0:
            scheduler.post_light("own", lambda: None)
        alone.release()

    def bring(thread: int) -> None:
        for number in range(each):
            turns.bring(f"owner{thread}", partial(handle, thread, number))

    bringers = [threading.Thread(target=bring, args=(thread,)) for thread in range(threads)]
    for one in bringers:
        one.start()
    with selectors.SelectSelector() as selector:
        selector.register(inbox, selectors.EVENT_READ)
        while any(item.is_alive() for item in bringers) or inbox.has_some:
            turns.rest(clock.now() + 0.01)
            selector.select(0.01)
            turns.resume()
            inbox.drain(scheduler)
            scheduler.advance(clock.now())
    assert len(ran) == threads * each
    for thread in range(threads):
        assert [number for whose, number in ran if whose == thread] == list(range(each))
    inbox.close()
