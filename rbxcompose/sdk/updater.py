"""What a component measures about itself, a task for each: how often, how fresh, whether it lives.

The tasks do what those of ROS's `diagnostic_updater` do, with its figures as defaults. Each is fed by the component
and asked once a second, with the time since robot start [s].
"""

import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import field

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level

WINDOW = 5.0  # [s] over which a rate is counted, and at least `FEWEST` periods
FEWEST = 3
TOLERANCE = 0.1  # of a rate
OLDEST, NEWEST = 5.0, -1.0  # [s] that a message may be older than now


@dataclass(frozen=True, slots=True)
class TaskStatus:
    """How a task stands; `values` are what people may want to know besides."""

    level: Level
    message: str
    values: Mapping[str, str] = field(default_factory=dict)


DiagnosticTask = Callable[[float], TaskStatus]
"""Returns how something stands at a time since robot start [s]: the method `status` of a class below, or any other."""


class FrequencyTask:
    """Whether something happens as often as it should: `least` to `most` times a second [Hz], within `tolerance`."""

    def __init__(self, least: float, most: float = math.inf, *, tolerance: float = TOLERANCE) -> None:
        self._least, self._most = least * (1 - tolerance), most * (1 + tolerance)
        self._window = max(WINDOW, FEWEST / least if least else 0.0)
        self._expected = _range(least, most)
        self._count = 0
        self._marks: deque[tuple[float, int]] = deque()  # time and count of the reports within the window

    def tick(self) -> None:
        """Count one event."""
        self._count += 1

    def status(self, now: float) -> TaskStatus:
        """Return the rate since the oldest report of the window: OK, WARN beyond the limits, ERROR if none came."""
        while len(self._marks) > 1 and self._marks[1][0] <= now - self._window:
            self._marks.popleft()
        self._marks.append((now, self._count))
        began, before = self._marks[0]
        passed, events = now - began, self._count - before
        if not passed or (events < FEWEST and passed < self._window):
            return TaskStatus(Level.OK, "counted since a moment ago", {"expected": self._expected})
        rate = events / passed
        values = {"rate": f"{rate:.4g} Hz", "expected": self._expected, "total": str(self._count)}
        if not events:
            return TaskStatus(Level.ERROR, f"nothing came for {passed:.1f} s", values)
        if rate < self._least or rate > self._most:
            return TaskStatus(Level.WARN, f"{rate:.4g} Hz instead of {self._expected}", values)
        return TaskStatus(Level.OK, f"{rate:.4g} Hz", values)


class StampTask:
    """Whether the stamps of messages are of now: at most `oldest` [s] old, and not more than `-newest` [s] ahead."""

    def __init__(self, *, oldest: float = OLDEST, newest: float = NEWEST) -> None:
        self._oldest, self._newest = oldest, newest
        self._ages: list[float] = []
        self._zero = 0
        self._wrong = 0

    def tick(self, stamp: float, now: float) -> None:
        """Take the stamp of a message that came at `now`, both in seconds of the clock that makes stamps."""
        if stamp or now <= self._oldest:  # simulated time begins at 0
            self._ages.append(now - stamp)
        else:
            self._zero += 1

    def status(self, now: float) -> TaskStatus:
        """Return ERROR for stamps that are zero, too old or ahead of time; counted since the last report."""
        ages, zero = self._ages, self._zero
        self._ages, self._zero = [], 0
        reason = self._reason(ages, zero)
        self._wrong += bool(reason)
        values = {"oldest": f"{max(ages):.3f} s", "newest": f"{min(ages):.3f} s"} if ages else {}
        level = Level.ERROR if reason else Level.OK
        return TaskStatus(level, reason, {**values, "seconds with wrong stamps": str(self._wrong)})

    def _reason(self, ages: list[float], zero: int) -> str:
        if zero:
            return f"{zero} messages have no stamp"
        if ages and max(ages) > self._oldest:
            return f"a stamp is {max(ages):.3g} s old, at most {self._oldest:g} s is usual"
        if ages and min(ages) < self._newest:
            return f"a stamp is {-min(ages):.3g} s ahead of time"
        return ""


class CompositeTask:
    """Several tasks under one name: the worst level, the messages of those that are not OK, and all values."""

    def __init__(self, *tasks: DiagnosticTask) -> None:
        self._tasks = tasks

    def status(self, now: float) -> TaskStatus:
        """Return them merged."""
        found = [task(now) for task in self._tasks]
        level = max((item.level for item in found), default=Level.OK)
        messages = [
            item.message for item in found if item.message and (level is Level.OK or item.level is not Level.OK)
        ]
        values = {key: value for item in found for key, value in item.values.items()}
        return TaskStatus(level, "; ".join(messages), values)


def heartbeat(now: float) -> TaskStatus:
    """Return that the component lives, of which the report itself is the sign."""
    return TaskStatus(Level.OK, "alive")


def _range(least: float, most: float) -> str:
    if least == most:
        return f"{least:g} Hz"
    if math.isinf(most):
        return f"at least {least:g} Hz"
    return f"{least:g} to {most:g} Hz" if least else f"at most {most:g} Hz"
