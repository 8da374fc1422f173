"""The drivers: the stepped one in full, the real-time one as far as it does not need to wait."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rbxcompose.base.clock import MonotonicClock, SteppedClock
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.runtime import channel as say
from rbxcompose.runtime.channel import Channel
from rbxcompose.runtime.process_group.connection import CallbackInbox, RealTimeDriver, SteppedDriver, Turns


class Driven:
    """Hears messages and ends when `until` holds."""

    def __init__(self, until: Callable[[], bool]) -> None:
        self.until = until
        self.heard: list[say.ChannelMessage] = []
        self.is_orphaned = False
        self.beats = 0
        self.on_message: Callable[[say.ChannelMessage], None] = self.heard.append

    def handle(self, message: say.ChannelMessage) -> None:
        self.on_message(message)

    def orphaned(self) -> None:
        self.is_orphaned = True

    def beat(self) -> None:
        self.beats += 1

    def settle(self) -> None:
        pass

    @property
    def is_over(self) -> bool:
        return self.until()


class Rig:
    """A stepped driver with everything around it."""

    def __init__(self, supervisor: Channel, channel: Channel, rate: float | None) -> None:
        self.clock, self.scheduler, self.inbox = SteppedClock(), Scheduler(), CallbackInbox()
        self.supervisor, self.channel = supervisor, channel
        self.driven = Driven(lambda: self.scheduler.next_due() is None)
        self.driver = SteppedDriver(self.scheduler, self.clock, self.inbox, channel, self.driven, rate=rate)
        self.story: list[tuple[float, str]] = []

    def note(self, text: str) -> Callable[[], None]:
        return lambda: self.story.append((self.clock.now(), text))

    def at(self, time: float, text: str, owner: str = "x") -> None:
        self.scheduler.at(time, owner, self.note(text))


@contextmanager
def rig(rate: float | None = None) -> Iterator[Rig]:
    ours, theirs = socket.socketpair()
    made = Rig(Channel(ours), Channel(theirs), rate)
    yield made
    made.inbox.close()
    ours.close()
    theirs.close()


def test_time_jumps_from_event_to_event() -> None:
    with rig() as r:
        for time in (100.0, 7.5, 3600.0):
            r.at(time, "due")
        r.driver.go()
        r.driver.run()
        assert r.story == [(7.5, "due"), (100.0, "due"), (3600.0, "due")]


def test_time_stands_still_until_it_is_let_go() -> None:
    with rig() as r:
        r.at(0.0, "now")
        r.at(1.0, "later")
        r.driven.until = lambda: bool(r.story)
        r.driver.run()
        assert (r.story, r.clock.now()) == ([(0.0, "now")], 0.0)


def test_time_does_not_go_beyond_the_deadline() -> None:
    with rig() as r:
        r.at(1.0, "before")
        r.at(3.0, "after")
        r.driven.until = lambda: r.clock.now() >= 2.0
        r.driver.go(deadline=2.0)
        r.driver.run()
        assert (r.story, r.clock.now()) == ([(1.0, "before")], 2.0)


def test_after_halt_time_stands_still_for_good() -> None:
    with rig() as r:
        r.at(1.0, "first")
        r.at(2.0, "never")
        r.scheduler.at(1.0, "y", r.driver.halt)
        r.driven.until = lambda: r.driven.beats > 1
        r.driver.go()
        r.driver.run()
        assert (r.story, r.clock.now()) == ([(1.0, "first")], 1.0)


def test_an_answer_too_long_for_one_send_does_not_wait_for_the_next_beats() -> None:
    with rig() as r:
        answer, received = say.Answered(1, "x" * 5_000_000), list[say.ChannelMessage]()
        r.driven.on_message = lambda message: r.channel.send(answer)

        def has_arrived() -> bool:
            received.extend(r.supervisor.receive())
            return bool(received)

        r.driven.until = has_arrived
        r.supervisor.send(say.Ask(1, "camera", {}))
        r.driver.run()
        assert received == [answer]
        assert not r.channel.is_behind


def test_each_message_is_carried_out_to_its_end_before_the_next() -> None:
    with rig() as r:

        def post(message: say.ChannelMessage) -> None:
            r.scheduler.post("x", r.note(type(message).__name__))

        r.driven.on_message = post
        for message in (say.Stop(), say.Release(), say.Stop()):
            r.supervisor.send(message)
        r.driven.until = lambda: len(r.story) >= 3
        r.driver.run()
        assert [text for _, text in r.story] == ["Stop", "Release", "Stop"]


def test_messages_are_heard_between_events_at_full_speed() -> None:
    with rig() as r:
        r.scheduler.every(0.1, "x", lambda dt: None)
        r.supervisor.send(say.Stop())
        r.driven.until = lambda: bool(r.driven.heard)
        r.driver.go()
        r.driver.run()
        assert r.driven.heard == [say.Stop()]


def test_what_another_thread_leaves_runs_at_the_present_instant() -> None:
    with rig() as r:
        r.at(5.0, "due")
        r.inbox.put("a", r.note("arrived"))
        r.driver.go()
        r.driver.run()
        assert r.story == [(0.0, "arrived"), (5.0, "due")] or r.story == [(5.0, "arrived"), (5.0, "due")]


def test_a_pace_holds_time_back() -> None:
    with rig(rate=1e-6) as r:
        r.at(1.0, "far away")
        r.driven.until = lambda: r.driven.beats > 1
        r.driver.go()
        r.driver.run()
        assert (r.story, r.clock.now()) == ([], 0.0)


def test_the_end_of_the_supervisor_is_heard() -> None:
    with rig() as r:
        r.supervisor.close()
        r.driven.until = lambda: r.driven.is_orphaned
        r.driver.run()
        assert r.driven.is_orphaned


def test_in_real_time_events_run_at_or_after_their_time() -> None:
    ours, theirs = socket.socketpair()
    clock, scheduler, inbox = MonotonicClock(), Scheduler(), CallbackInbox()
    ran: list[float] = []
    for due in (0.02, 0.01, 0.03):
        scheduler.at(due, "x", lambda due=due: ran.append(clock.now() - due))  # type: ignore[misc]
    turns = Turns(scheduler, clock, inbox)
    RealTimeDriver(scheduler, clock, inbox, turns, Channel(theirs), Driven(lambda: len(ran) == 3)).run()
    assert all(lateness >= 0 for lateness in ran)
    inbox.close()
    ours.close()
    theirs.close()
