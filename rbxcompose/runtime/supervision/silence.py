"""Silent processes: first reported to the others, later ended. Pure: time comes from a scheduler."""

from collections.abc import Callable, Iterable, Mapping

from rbxcompose.base.levels import Level
from rbxcompose.runtime.processes import longest_wait
from rbxcompose.runtime.supervision.members import ConductorEffects, Member

SILENT = 1.0  # [s] without a sign of life after which the others are informed
DEAD = 2.0  # [s] without one, not counting waits for a processor, after which a process is killed
LOOK = 0.25  # [s] between checks for signs of life
_QUIET = 1.5 * LOOK  # [s] without a sign of life from which on waits for a processor are looked at
_STATE = {True: "suspended by a signal", False: "silent"}
_OVERLOADED = "this machine has too much to do"


class Silence:
    """Detects processes that are suspended or do not answer."""

    def __init__(self, effects: ConductorEffects, report_lost: Callable[[Member, str], None], now: float) -> None:
        """Take `report_lost`, which is called with a process that is no longer reliable, and why; and `now` [s]."""
        self._effects, self._report_lost = effects, report_lost
        self._looked, self._own_waits = now, effects.waits(None)
        self._waits: dict[str, Mapping[str, float]] = {}  # of processes that are quiet, at first

    def look_at_all(self, members: Iterable[Member], now: float, *, is_going_down: bool) -> bool:
        """Check all processes; return whether silence is nobody's fault this time."""
        held_up, starved = self._held_up(now)
        if held_up and not is_going_down:
            text = f"time stood still for {held_up:.1f} s: the machine slept, or the supervisor was suspended"
            if starved > held_up / 2:
                text = f"the supervisor waited {starved:.1f} s for a processor: {_OVERLOADED}"
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
        starved = self._starved(member.name, silence)
        if not (member.is_configured or is_suspended):
            return  # getting ready may take long: meanwhile each process has a watchdog of its own
        if is_suspended:
            self._report_lost(member, "was suspended by a signal")
        elif silence > SILENT:
            waited = f"waited {starved:.1f} s for a processor: {_OVERLOADED}"
            self._report_lost(member, waited if starved > SILENT / 2 else "does not answer")
        if silence - starved > DEAD:
            member.is_configured, member.last_word = False, now  # one kill is enough
            member.killed_for = f"was {_STATE[is_suspended]} for {DEAD:g} s and was killed"
            self._effects.kill(member.name)

    def _starved(self, process: str, silence: float) -> float:
        """Return for how long a quiet process has waited for a processor [s]: a restart would make this worse."""
        if silence <= _QUIET:
            self._waits.pop(process, None)
            return 0.0
        waits = self._effects.waits(process)
        return longest_wait(self._waits.setdefault(process, waits), waits)

    def _held_up(self, now: float) -> tuple[float, float]:
        """Return for how long silence is nobody's fault [s], since the previous call, and the wait for a processor [s].

        In that time the supervisor itself was suspended or waited, or the whole machine slept; mostly it is 0.
        """
        looked, self._looked = self._looked, now
        before, self._own_waits = self._own_waits, self._effects.waits(None)
        return (now - looked if now - looked > SILENT else 0.0), longest_wait(before, self._own_waits)
