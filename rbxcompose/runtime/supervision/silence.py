"""Silent processes: first reported to the others, later ended. Pure: time comes from a scheduler."""

from __future__ import annotations

from collections.abc import Callable

from rbxcompose.runtime.supervision.members import ConductorEffects, Member

SILENT = 1.0  # [s] without a sign of life after which the others are told
DEAD = 2.0  # [s] without a sign of life after which a process is killed
LOOK = 0.25  # [s] between looks for signs of life


class Silence:
    """Looks for processes that are suspended, or do not answer."""

    def __init__(self, effects: ConductorEffects, tell_lost: Callable[[Member, str], None], now: float) -> None:
        """Take `tell_lost`, which is told of a process that cannot be counted on any more, and why; `now` [s]."""
        self._effects, self._tell_lost = effects, tell_lost
        self._looked = now

    def look(self, member: Member, now: float) -> None:
        """Judge a process that is there."""
        silence, is_suspended = now - member.last_word, self._effects.is_suspended(member.name)
        if not (member.is_configured or is_suspended):
            return  # getting ready may take long: there each process has a watchdog of its own
        if is_suspended:
            self._tell_lost(member, "was suspended by a signal")
        elif silence > SILENT:
            self._tell_lost(member, "does not answer")
        if silence > DEAD:
            member.is_configured, member.last_word = False, now  # one kill is enough
            self._effects.kill(member.name)

    def held_up(self, now: float) -> float:
        """Return how long nobody may be blamed for what was not heard [s], counted from the last question; mostly 0.

        The supervisor was suspended itself then, waited for a disk, or the whole machine slept.
        """
        looked, self._looked = self._looked, now
        return now - looked if now - looked > SILENT else 0.0
