"""What a mux listens to, and what becomes of a command when its source has ended. All times are robot time [s]."""

from __future__ import annotations

import math
from typing import Protocol, TypeVar

from rbxcompose.dataclass import dataclass

M = TypeVar("M")

QUIET = 0.5  # [s] of silence after which an input without a timeout counts as come to rest
NEVER = math.inf


@dataclass(frozen=True, slots=True)
class MuxSource:
    """A source that is expected to send repeatedly: after more than `timeout` [s] of silence it counts as gone."""

    priority: int = 0
    timeout: float = NEVER
    zero_releases: bool = False
    """Its zero lets go of the output at once, instead of holding it until the timeout."""
    starts_live: bool = False
    """It counts as live before its first message."""

    @property
    def quiet(self) -> float:
        """Return the silence [s] after which it is sure that it commands nothing any more."""
        return self.timeout if 0 < self.timeout < NEVER else QUIET


@dataclass(frozen=True, slots=True)
class LockSource:
    """A lock that holds back every input with a lower priority.

    It carries a heartbeat, and is engaged while it is silent; or a flag, and is engaged while that is true, or silent
    for longer than the timeout, if it has one.
    """

    priority: float = NEVER
    timeout: float = NEVER
    is_flag: bool = False


class Ramp(Protocol[M]):
    """Bounds how fast the output changes from what one source commanded to what the next one commands."""

    def limit(self, linear: float, angular: float) -> None:
        """Have other limits from now on [m/s^2, rad/s^2]."""
        ...

    def begin(self, last: M, now: float) -> None:
        """Begin at `last`, which came out before another source took over."""
        ...

    def through(self, message: M, now: float) -> M:
        """Return what comes out for a message of the new source."""
        ...

    def end(self) -> None:
        """Let everything through as it is."""
        ...


@dataclass(frozen=True, slots=True)
class MuxEndings:
    """How long after the last command a stop follows [s]; `NEVER` for none."""

    on_idle: float = 0.0
    """When its source has fallen silent and no other is live."""
    on_lock: float = 0.0
    """When its source was locked out."""
