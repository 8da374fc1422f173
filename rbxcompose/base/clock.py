"""Robot time: the one clock that everything else uses: real, stepped, or external.

Robot time counts seconds from the start of the robot, on every host process alike. Motion deadlines use it and
nothing else; wall-clock stamps are data for people and other programs, never a deadline.
"""

import time
from collections import deque
from datetime import UTC, datetime
from enum import Enum, auto
from typing import Protocol

NANOSECONDS = 1_000_000_000
PATIENCE = 0.5  # [s] of real time without an advance, after which outside time stands still
LEAP = 10.0  # [s] of outside time; a larger single advance is a jump
JUMPS, DISPUTE = 3, 2.0  # this many jumps within this much real time [s]: several sources publish the time


class Clock(Protocol):
    """A clock: robot time for decisions, a stamp for messages."""

    is_real: bool  # whether robot time is that of this computer

    def now(self) -> float:
        """Return robot time [s] since the robot's start."""

    def stamp(self) -> int:
        """Return the time to write into messages [ns]: since the Unix epoch, or robot time if stepped."""


def local_time(seconds: float) -> datetime:
    """Return what a wall clock of this host shows, without its zone, at a time since the Unix epoch [s]."""
    return datetime.fromtimestamp(seconds)


def universal_time(seconds: float) -> datetime:
    """Return the same in UTC, which is the time of day on a clock that is not real: on all hosts alike."""
    return datetime.fromtimestamp(seconds, UTC).replace(tzinfo=None)


class MonotonicClock:
    """Real time: `CLOCK_MONOTONIC` counted from `start`, shared by all processes of one robot."""

    is_real = True

    def __init__(self, start: float | None = None) -> None:
        self.start = time.monotonic() if start is None else start

    def now(self) -> float:
        """Return robot time [s]."""
        return time.monotonic() - self.start

    def stamp(self) -> int:
        """Return wall-clock time [ns] since the Unix epoch."""
        return time.time_ns()


class SteppedClock:
    """Simulated time: stands still until `advance_to` moves it; never runs backwards."""

    is_real = False

    def __init__(self, start: float = 0.0) -> None:
        self._now = start

    def now(self) -> float:
        """Return robot time [s]."""
        return self._now

    def stamp(self) -> int:
        """Return robot time [ns], so that a second run writes the same stamps."""
        return round(self._now * NANOSECONDS)

    def advance_to(self, t: float) -> None:
        """Jump to robot time `t` [s].

        Raises:
            ValueError: if `t` lies in the past.
        """
        if t < self._now:
            raise ValueError(f"robot time cannot run backwards: {t} s is before {self._now} s")
        self._now = t


class Turn(Enum):
    """What happened to the outside time."""

    GOES = auto()
    STANDS = auto()
    JUMPED = auto()
    DISPUTED = auto()


class ExternalClock(SteppedClock):
    """Follows outside time, such as a simulator's `/clock`: a stepped clock that may advance up to `limit`.

    Robot time only runs forwards, and only by what the outside time has advanced, wherever that begins to count; after
    a jump it continues from where it was. If sources disagree, their advances are ignored: robot time stands still
    until there has been no jump for `DISPUTE`. Real time [s] is an argument, counted from when the clock starts to
    listen.
    """

    def __init__(self) -> None:
        super().__init__()
        self.limit = 0.0  # [s] of robot time that outside time allows
        self.is_standing = True
        self._outside: int | None = None  # [ns], last value received
        self._shift = 0  # [ns] of outside time at robot time 0
        self._moved_at = 0.0  # [s] of real time, at the last advance
        self._is_reported = False  # it has been reported that time stands still
        self._jumps: deque[float] = deque(maxlen=JUMPS)  # [s] of real time, of the last jumps
        self._is_disputed = False

    def stamp(self) -> int:
        """Return the outside time [ns] of this instant, as other programs that follow it stamp it."""
        return super().stamp() + self._shift

    def join(self, t: float) -> None:
        """Begin at robot time `t` [s], which the other processes have reached."""
        self.advance_to(t)
        self.limit = t

    def receive(self, outside: int, *, real: float) -> Turn | None:
        """Receive the outside time [ns]; return what has changed, if anything."""
        before, self._outside = self._outside, outside
        if before is None:
            self._begin_here(outside)  # only the next one shows whether it runs
            return None
        if outside == before:
            return None
        self._moved_at, self._is_reported = real, False
        if not 0 < outside - before <= LEAP * NANOSECONDS:
            self._begin_here(outside)
            return self._jumped(real)
        if self._is_disputed:
            self._begin_here(outside)
            self._is_disputed = real - self._jumps[-1] < DISPUTE
            if self._is_disputed:
                return None
        was_standing, self.is_standing = self.is_standing, False
        self.limit = max(self.limit, (outside - self._shift) / NANOSECONDS)
        return Turn.GOES if was_standing else None

    def look(self, *, real: float) -> Turn | None:
        """Return `STANDS`, once, when the last advance was too long ago."""
        if self._is_reported or real - self._moved_at < PATIENCE:
            return None
        self._is_reported = self.is_standing = True
        self._is_disputed = False
        return Turn.STANDS

    def _jumped(self, real: float) -> Turn | None:
        """Return what to report of a jump: several close together are a dispute, which is reported once."""
        was_disputed = self._is_disputed
        self._jumps.append(real)
        self._is_disputed |= len(self._jumps) == JUMPS and real - self._jumps[0] < DISPUTE
        self.is_standing = self._is_disputed
        if self._is_disputed:
            return None if was_disputed else Turn.DISPUTED
        return Turn.JUMPED

    def _begin_here(self, outside: int) -> None:
        """Map the present instant to `outside` [ns]; received time that has not been reached yet is dropped."""
        self.limit = self.now()
        self._shift = outside - super().stamp()
