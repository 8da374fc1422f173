"""The scheduler of one process: what is due, in an order that never depends on chance.

It is pure: it uses no clock and no thread. A driver passes the time to `advance(t)`: in real time that of the monotonic
clock, in simulated time that of the next event. Events run by time, then owner, then sequence.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Container
from itertools import count

from rbxcompose.base.dataclass import dataclass

Callback = Callable[[], None]
OnError = Callable[[str, BaseException], None]
Observe = Callable[[str, Callback], None]  # runs the callback and may time it

MOST_AT_ONCE = 100_000  # events at one instant before we call it an endless loop


@dataclass(eq=False, slots=True)
class ScheduledCallback:
    """A callback that is due; `cancel` discards it."""

    callback: Callback | None
    is_light: bool = False

    def cancel(self) -> None:
        """Drop the callback; the event then does nothing."""
        self.callback = None


def _raise(owner: str, error: BaseException) -> None:
    raise error


def _run(owner: str, callback: Callback) -> None:
    callback()


class Scheduler:
    """Due timers and arrived inputs of one process, all run by one thread through `advance`."""

    def __init__(self, on_error: OnError = _raise, observe: Observe = _run) -> None:
        self.now = 0.0  # [s] of robot time at the latest `advance`
        self.on_error = on_error
        self.observe = observe
        # By time [s], owner, sequence: tuples, since comparing them is most of the work of a heap.
        self._events: list[tuple[float, str, int, ScheduledCallback]] = []
        self._sequence = count()

    def at(self, time: float, owner: str, callback: Callback) -> ScheduledCallback:
        """Run `callback` for `owner` once at robot time `time` [s] (immediately, if that is past)."""
        event = ScheduledCallback(callback)
        heapq.heappush(self._events, (time if time > self.now else self.now, owner, next(self._sequence), event))
        return event

    def post(self, owner: str, callback: Callback) -> ScheduledCallback:
        """Run `callback` for `owner` at the present instant, after the callback that is running now."""
        return self.at(self.now, owner, callback)

    def post_light(self, owner: str, callback: Callback) -> ScheduledCallback:
        """Post a callback that any thread may run which has been lent the scheduler's turn."""
        event = self.post(owner, callback)
        event.is_light = True
        return event

    def every(self, period: float, owner: str, callback: Callable[[float], None]) -> Periodic:
        """Run `callback(dt)` every `period` [s] on a grid that starts now."""
        return Periodic(self, period, owner, callback)

    def remove(self, owner: str) -> None:
        """Cancel all callbacks of `owner`."""
        for _, whose, _, event in self._events:
            if whose == owner:
                event.cancel()

    def next_due(self) -> float | None:
        """Return the time of the next event [s], None if there is none."""
        while self._events and self._events[0][3].callback is None:
            heapq.heappop(self._events)
        return self._events[0][0] if self._events else None

    def begin(self, t: float) -> None:
        """Set the time to `t` [s] without running anything."""
        self.now = max(self.now, t)

    def take_light(self, without: Container[str]) -> tuple[str, Callback] | None:
        """Take out the next event and return its owner and callback, if it is due, light, and not of these owners."""
        due = self.next_due()
        if due is None or due > self.now:
            return None
        _, owner, _, event = self._events[0]
        if event.callback is None or not event.is_light or owner in without:
            return None
        heapq.heappop(self._events)
        return owner, event.callback

    def advance(self, t: float) -> None:
        """Run everything that is due until `t` [s], including events added meanwhile.

        Raises:
            RuntimeError: if the events at one instant do not end.
        """
        self.begin(t)
        for _ in range(MOST_AT_ONCE):
            due = self.next_due()
            if due is None or due > self.now:
                return
            _, owner, _, event = heapq.heappop(self._events)
            self._run_one(owner, event)
        raise RuntimeError(f"more than {MOST_AT_ONCE} events at {self.now:.3f} s")

    def _run_one(self, owner: str, event: ScheduledCallback) -> None:
        callback, event.callback = event.callback, None
        if callback is None:
            return
        try:
            self.observe(owner, callback)
        except (Exception, SystemExit) as error:  # an error in one component must not stop its neighbours
            self.on_error(owner, error)


class Periodic:
    """A timer on an absolute grid: missed cycles are skipped and counted, never run in a burst."""

    LONGEST_DT = 2.0  # a step never gets a `dt` of more than this many periods

    def __init__(self, scheduler: Scheduler, period: float, owner: str, callback: Callable[[float], None]) -> None:
        if period <= 0:
            raise ValueError(f"a period must be positive, not {period} s")
        self.missed = 0
        self._scheduler, self._period, self._owner, self._callback = scheduler, period, owner, callback
        self._last = scheduler.now
        # All timers of this period share one grid, so that a single wake-up of the process serves several of them.
        self._start = math.floor(scheduler.now / period) * period
        self._cycle = 0
        self._event = self._schedule()

    def cancel(self) -> None:
        """Stop the timer."""
        self._event.cancel()

    def _schedule(self) -> ScheduledCallback:
        self._cycle += 1
        return self._scheduler.at(self._start + self._cycle * self._period, self._owner, self._run)

    def _run(self) -> None:
        now = self._scheduler.now
        due = int((now - self._start) / self._period + 1e-9)
        self.missed += max(0, due - self._cycle)
        self._cycle = max(self._cycle, due)
        dt = min(now - self._last, self.LONGEST_DT * self._period)
        self._last = now
        self._event = self._schedule()  # before the callback, so that it may cancel
        self._callback(dt)
