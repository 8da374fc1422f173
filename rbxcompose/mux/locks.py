"""The locks of a mux: heartbeats, flags, and what a person has locked by hand."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from rbxcompose.mux.sources import LockSource, MuxSource


class MuxLocks:
    """Which inputs are held back, and by what. All times are robot time [s]."""

    def __init__(self, locks: Mapping[str, LockSource]) -> None:
        self.declared = dict(locks)
        self.by_hand: dict[str, float] = {}  # until when, by input
        self._until: dict[str, float] = {}  # when a lock engages because it is silent
        self._is_on = dict.fromkeys(locks, False)
        self.forget()

    def __bool__(self) -> bool:
        return bool(self.declared or self.by_hand)

    def take_over(self, old: MuxLocks, inputs: Mapping[str, MuxSource]) -> None:
        """Copy what is known of locks with the same names, and what was locked by hand."""
        self._until |= {name: until for name, until in old._until.items() if name in self.declared}
        self._is_on |= {name: is_on for name, is_on in old._is_on.items() if name in self.declared}
        self.by_hand |= {name: until for name, until in old.by_hand.items() if name in inputs}

    def heard(self, name: str, now: float, *, is_on: bool) -> None:
        """Receive a heartbeat, or a flag.

        Raises:
            KeyError: if there is no such lock.
        """
        self._until[name] = now + self.declared[name].timeout
        self._is_on[name] = is_on

    def forget(self) -> None:
        """Take all heartbeats for silent; a flag keeps its last value, and one with a timeout must be heard again."""
        self._until = {
            name: math.inf if lock.is_flag and lock.timeout == math.inf else -math.inf
            for name, lock in self.declared.items()
        }

    def expire(self, now: float) -> list[str]:
        """End what was locked by hand up to now; return these inputs."""
        ended = [name for name, until in self.by_hand.items() if until <= now]
        for name in ended:
            del self.by_hand[name]
        return ended

    def ends(self) -> Iterator[float]:
        """Yield the moments at which a lock engages by silence, or one made by hand ends."""
        yield from (math.nextafter(until, math.inf) for until in self._until.values() if until < math.inf)
        yield from (until for until in self.by_hand.values() if until < math.inf)

    def locked(self, inputs: Mapping[str, MuxSource], now: float) -> list[str]:
        """Return the inputs that are held back."""
        if not self:  # as in most muxes, at each message
            return []
        floor = max((self.declared[name].priority for name in self.engaged(now)), default=-math.inf)
        return [name for name, one in inputs.items() if one.priority < floor or name in self.by_hand]

    def engaged(self, now: float) -> list[str]:
        """Return the locks that hold back what is below them."""
        return [name for name in self.declared if self._is_on[name] or now > self._until[name]]

    def why(self, name: str, now: float) -> str:
        """Return why a lock is engaged, with the silence that counts; empty if it is not."""
        if self._is_on[name]:
            return f"{name} is on"
        what = "does not report" if self.declared[name].is_flag else "gives no heartbeat"
        return f"{name} {what}" if now > self._until[name] else ""

    def above(self, source: MuxSource, now: float) -> list[str]:
        """Return the engaged locks that hold back a source."""
        return [name for name in self.engaged(now) if source.priority < self.declared[name].priority]
