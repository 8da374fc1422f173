"""The scheduler of one process: what is due, in an order that never depends on chance.

It is pure: it knows no clock and no thread. A driver tells it the time by `advance(t)`; in real time that is the
monotonic clock, in simulated time the instant of the next event. Events run by time, then owner, then sequence.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import count

Callback = Callable[[], None]
OnError = Callable[[str, Exception], None]
Observe = Callable[[str, Callback], None]  # runs the callback and may time it

MOST_AT_ONCE = 100_000  # events at one instant before we call it a loop that never ends


@dataclass(eq=False, slots=True)
class ScheduledCallback:
    """A callback that is due; `cancel` makes it none."""

    callback: Callback | None

    def cancel(self) -> None:
        """Forget the callback; the event then passes unseen."""
        self.callback = None


def _raise(owner: str, error: Exception) -> None:
    raise error


def _run(owner: str, callback: Callback) -> None:
    callback()


class Scheduler:
    """Due timers and arrived inputs of one process, all run by one thread through `advance`."""

    def __init__(self, on_error: OnError = _raise, observe: Observe = _run) -> None:
        self.now = 0.0  # [s] of robot time, of the latest `advance`
        self.on_error = on_error
        self.observe = observe
        # By time [s], owner, sequence: tuples, since comparing them is most of the work of a heap.
        self._events: list[tuple[float, str, int, ScheduledCallback]] = []
        self._sequence = count()

    def at(self, time: float, owner: str, callback: Callback) -> ScheduledCallback:
        """Run `callback` for `owner` once at robot time `time` [s] (at once, if that is past)."""
        event = ScheduledCallback(callback)
        heapq.heappush(self._events, (max(time, self.now), owner, next(self._sequence), event))
        return event

    def post(self, owner: str, callback: Callback) -> ScheduledCallback:
        """Run `callback` for `owner` at the present instant, after what runs now."""
        return self.at(self.now, owner, callback)

    def every(self, period: float, owner: str, callback: Callable[[float], None]) -> Periodic:
        """Run `callback(dt)` every `period` [s] on a grid that starts now."""
        return Periodic(self, period, owner, callback)

    def remove(self, owner: str) -> None:
        """Cancel all that is due for `owner`."""
        for _, whose, _, event in self._events:
            if whose == owner:
                event.cancel()

    def next_due(self) -> float | None:
        """Return the time of the next event [s], or None if nothing is due ever."""
        while self._events and self._events[0][3].callback is None:
            heapq.heappop(self._events)
        return self._events[0][0] if self._events else None

    def advance(self, t: float) -> None:
        """Run everything that is due until `t` [s], also what comes up meanwhile.

        Raises:
            RuntimeError: if events at one instant never end.
        """
        self.now = max(self.now, t)
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
        except Exception as error:  # a component's mistake must not stop its neighbours
            self.on_error(owner, error)


class Periodic:
    """A timer on an absolute grid: cycles that were missed are skipped and counted, never run in a burst."""

    LONGEST_DT = 2.0  # a step is never told of more than this many periods

    def __init__(self, scheduler: Scheduler, period: float, owner: str, callback: Callable[[float], None]) -> None:
        if period <= 0:
            raise ValueError(f"a period must be positive, not {period} s")
        self.missed = 0
        self._scheduler, self._period, self._owner, self._callback = scheduler, period, owner, callback
        self._last = scheduler.now
        # A grid that all timers of this period share, so that one waking of the process serves several of them.
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
