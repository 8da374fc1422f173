"""What runs the scheduler of a process: a driver for each kind of time, one thread each."""

from __future__ import annotations

import math
import selectors
import time
from collections.abc import Callable, Sequence
from typing import Protocol

from rbxcompose.clock import Clock, ExternalClock, MonotonicClock, SteppedClock, Turn
from rbxcompose.runtime.channel import Channel, ChannelMessage
from rbxcompose.runtime.process_group.inbox import CallbackInbox
from rbxcompose.runtime.process_group.turns import Turns
from rbxcompose.scheduler import Scheduler

BEAT = 0.25  # [s] of real time between signs of life
EARLY = 0.02  # [s] by which a sign of life may be early: a process that is awake need not wake up again for it
LOOK = 0.1  # [s] of real time between checks whether outside time still runs
SLICE = 0.05  # [s] of real time for catching up with outside time, before messages are received again


class Driven(Protocol):
    """What a driver drives: it handles messages, and says after each round whether it continues."""

    def handle(self, message: ChannelMessage) -> None:
        """Carry out a message from the supervisor."""
        ...

    def orphaned(self) -> None:
        """Handle the loss of the supervisor."""
        ...

    def beat(self) -> None:
        """Give a sign of life, every `BEAT` seconds of real time."""
        ...

    def settle(self) -> None:
        """Check the state, after everything that was due has run."""
        ...

    @property
    def is_over(self) -> bool:
        """Return whether the process is to end."""
        ...


class Driver:
    """Waits for channel and inbox, and passes their messages on; subclasses define how time advances."""

    def __init__(self, scheduler: Scheduler, inbox: CallbackInbox, channel: Channel, driven: Driven) -> None:
        self._scheduler, self._inbox, self._channel, self._driven = scheduler, inbox, channel, driven
        self._selector = selectors.SelectSelector()  # its timeouts have microseconds; epoll rounds up to milliseconds
        self._selector.register(inbox, selectors.EVENT_READ)
        self._selector.register(channel, selectors.EVENT_READ)
        self._next_beat = 0.0  # [s] on the monotonic clock
        self._beats_from = 0.0  # [s] on that clock; on this grid, beats need no waking of their own

    def run(self) -> None:
        """Run until the driven process is over."""
        with self._selector:
            while not self._driven.is_over:
                self._listen(self._pause())
                self._advance()
                self._driven.settle()

    def _pause(self) -> float:
        """Return how long to wait for the next event [s], if nothing arrives."""
        raise NotImplementedError

    def _advance(self) -> None:
        """Advance time and run what is due."""
        raise NotImplementedError

    def _run_present(self) -> None:
        """Run what is due at the present instant."""
        raise NotImplementedError

    def _listen(self, pause: float) -> None:
        until_beat = self._next_beat - time.monotonic()
        if until_beat <= EARLY:
            self._driven.beat()
            self._next_beat = self._beats_from + BEAT * (
                math.floor((time.monotonic() + EARLY - self._beats_from) / BEAT) + 1
            )
            until_beat = BEAT
        ready = self._wait(max(0.0, min(pause, until_beat)))
        self._inbox.drain(self._scheduler)
        if any(key.fileobj is self._channel for key, _ in ready):
            self._hear(self._channel.receive())

    def _wait(self, longest: float) -> list[tuple[selectors.SelectorKey, int]]:
        """Wait for channel and inbox, `longest` [s] at most, and return which of them can be read."""
        return self._selector.select(longest)

    def _hear(self, messages: Sequence[ChannelMessage]) -> None:
        for message in messages:
            self._driven.handle(message)
            self._run_present()  # one message after the other, however they were bundled in transit
        if not self._channel.is_open:
            self._selector.unregister(self._channel)
            self._driven.orphaned()


class RealTimeDriver(Driver):
    """Robot time is the monotonic clock; deadlines are absolute, so that lateness does not add up."""

    def __init__(
        self,
        scheduler: Scheduler,
        clock: MonotonicClock,
        inbox: CallbackInbox,
        turns: Turns,
        channel: Channel,
        driven: Driven,
    ) -> None:
        super().__init__(scheduler, inbox, channel, driven)
        self._clock, self._turns, self._beats_from = clock, turns, clock.start

    def _wait(self, longest: float) -> list[tuple[selectors.SelectorKey, int]]:
        self._turns.rest(self._clock.now() + longest)
        try:
            return super()._wait(longest)
        finally:
            self._turns.resume()

    def _pause(self) -> float:
        due = self._scheduler.next_due()
        return BEAT if due is None else due - self._clock.now()

    def _advance(self) -> None:
        self._scheduler.advance(self._clock.now())

    def _run_present(self) -> None:
        self._scheduler.advance(self._clock.now())


class SteppedDriver(Driver):
    """Robot time stands still until `go`, then jumps from event to event, and stands still again after `halt`.

    `rate` is robot seconds per real second; None is as fast as possible. Input from outside is handled between two
    instants; without any, the order of events is the same in every run.
    """

    def __init__(
        self,
        scheduler: Scheduler,
        clock: SteppedClock,
        inbox: CallbackInbox,
        channel: Channel,
        driven: Driven,
        *,
        rate: float | None,
    ) -> None:
        super().__init__(scheduler, inbox, channel, driven)
        self._clock, self._rate = clock, rate
        self._is_running = False
        self._deadline: float | None = None  # [s] of robot time, where it ends
        self._origin = (0.0, 0.0)  # [s] robot time and the corresponding real time

    def go(self, deadline: float | None = None) -> None:
        """Let time run, at most until `deadline` [s] of robot time."""
        self._is_running, self._deadline = True, deadline
        self._origin = (self._clock.now(), time.monotonic())

    def hurry(self) -> None:
        """Stop pacing time."""
        self._rate = None

    def halt(self) -> None:
        """Stop time for good."""
        self._is_running = False

    def _next(self) -> float | None:
        """Return the next instant [s], or None while time stands still."""
        if not self._is_running:
            return None
        times = [one for one in (self._scheduler.next_due(), self._deadline) if one is not None]
        return min(times, default=None)

    def _pause(self) -> float:
        following = self._next()
        if following is None:
            return BEAT
        if self._rate is None:
            return 0.0
        robot, real = self._origin
        return real + (following - robot) / self._rate - time.monotonic()

    def _advance(self) -> None:
        if self._pause() <= 0 and (following := self._next()) is not None:
            self._clock.advance_to(max(following, self._clock.now()))
        self._run_present()

    def _run_present(self) -> None:
        self._scheduler.advance(self._clock.now())


class ExternalDriver(Driver):
    """Robot time follows `hear`, event by event, so that a step runs for each instant at which it was due.

    `turned` is called when outside time stops, runs again or has jumped.
    """

    def __init__(
        self,
        scheduler: Scheduler,
        clock: ExternalClock,
        inbox: CallbackInbox,
        channel: Channel,
        driven: Driven,
        turned: Callable[[Turn], None],
    ) -> None:
        super().__init__(scheduler, inbox, channel, driven)
        self._clock, self._turned = clock, turned
        self._real: Clock | None = None  # counts from `follow` on

    def follow(self, real: Clock) -> None:
        """Begin to follow: from now on `hear` is called, or time stands still. `real` counts from now."""
        self._real = real

    def hear(self, outside: int) -> None:
        """Receive outside time [ns]."""
        if self._real is not None:
            self._tell(self._clock.hear(outside, real=self._real.now()))

    def _tell(self, turn: Turn | None) -> None:
        if turn is not None:
            self._turned(turn)

    def _pause(self) -> float:
        return 0.0 if self._clock.now() < self._clock.limit else LOOK

    def _advance(self) -> None:
        self._run_present()
        if self._real is not None:
            self._tell(self._clock.look(real=self._real.now()))
        until = time.monotonic() + SLICE
        while self._clock.now() < self._clock.limit and time.monotonic() < until:
            due = self._scheduler.next_due()
            following = self._clock.limit if due is None else min(due, self._clock.limit)
            self._clock.advance_to(max(following, self._clock.now()))
            self._run_present()
        self._run_present()

    def _run_present(self) -> None:
        self._scheduler.advance(self._clock.now())
