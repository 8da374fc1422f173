"""Silent processes: first reported to the others, later ended. Pure: time comes from a scheduler."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from rbxcompose.levels import Level
from rbxcompose.runtime.supervision.members import ConductorEffects, Member

SILENT = 1.0  # [s] without a sign of life after which the others are informed
DEAD = 2.0  # [s] without a sign of life after which a process is killed
LOOK = 0.25  # [s] between checks for signs of life
_STATE = {True: "suspended by a signal", False: "silent"}


class Silence:
    """Detects processes that are suspended or do not answer."""

    def __init__(self, effects: ConductorEffects, tell_lost: Callable[[Member, str], None], now: float) -> None:
        """Take `tell_lost`, which is called with a process that is no longer reliable, and why; and `now` [s]."""
        self._effects, self._tell_lost = effects, tell_lost
        self._looked = now

    def look_at_all(self, members: Iterable[Member], now: float, *, is_going_down: bool) -> bool:
        """Check all processes; return whether silence is nobody's fault this time."""
        held_up = self._held_up(now)
        if held_up and not is_going_down:
            text = f"time stood still for {held_up:.1f} s: the machine slept, or the supervisor was suspended"
            self._effects.log(Level.WARN, text)
        for member in members:
            if held_up:
                member.last_word = now
            elif member.is_there and not is_going_down:
                self._look(member, now)
        return bool(held_up)

    def _look(self, member: Member, now: float) -> None:
        """Check a process that exists."""
        silence, is_suspended = now - member.last_word, self._effects.is_suspended(member.name)
        if not (member.is_configured or is_suspended):
            return  # getting ready may take long: meanwhile each process has a watchdog of its own
        if is_suspended:
            self._tell_lost(member, "was suspended by a signal")
        elif silence > SILENT:
            self._tell_lost(member, "does not answer")
        if silence > DEAD:
            member.is_configured, member.last_word = False, now  # one kill is enough
            member.killed_for = f"was {_STATE[is_suspended]} for {DEAD:g} s and was killed"
            self._effects.kill(member.name)

    def _held_up(self, now: float) -> float:
        """Return for how long silence is nobody's fault [s], counted from the previous call; mostly 0.

        In that time the supervisor itself was suspended or waited for a disk, or the whole machine slept.
        """
        looked, self._looked = self._looked, now
        return now - looked if now - looked > SILENT else 0.0
