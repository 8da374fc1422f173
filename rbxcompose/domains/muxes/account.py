"""What a mux reports about itself: who holds the output, who waits, and why."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from rbxcompose.domains.muxes.core import MuxCore
from rbxcompose.domains.muxes.requests import MuxInputState, MuxLockState


class MuxAccount:
    """Tells what a core does at a robot time [s]."""

    def __init__(self, core: MuxCore[Any]) -> None:
        self._core = core

    def why(self, now: float) -> str:
        """Return a sentence for people on what controls the output.

        It has no times: each message of a source would make them wrong, and no status is worth sending that often.
        """
        if (shut := self._shut()) or not self._core.inputs:
            return shut or "no input"
        parts = [self._who_holds(now), *self._who_locks(now)]
        return "; ".join(filter(None, parts)) or self._nobody()

    def state_of(self, name: str, now: float) -> tuple[str, str]:
        """Return the state of an input in a word and, in more words, why; empty if there is nothing to add."""
        core = self._core
        if name == core.active:
            return "holds", ""
        if shut := self._shut():
            return "waits", shut
        if (until := core.locks.by_hand.get(name)) is not None:
            return "locked", "by hand" if until == math.inf else f"by hand, for another {max(until - now, 0.0):.1f} s"
        if above := core.locks.above(core.inputs[name], now):
            return "locked", _listed([core.locks.why(lock, now) for lock in above])
        if name in core.waiting:
            return "must rest", "it must come to rest once"
        if not core.is_live(name, now):
            return "silent", ""
        holder = core.active
        return "waits", core.arbiter.passed_over(name, holder, core.inputs) if holder else "it is not selected"

    def inputs(
        self, topics: Mapping[str, str], received_at: Mapping[str, float], now: float, *, has_priorities: bool
    ) -> tuple[MuxInputState, ...]:
        """Return all inputs; `received_at` has the time of the last message of each."""
        core = self._core
        return tuple(
            MuxInputState(
                name,
                topics[name],
                input_.priority if has_priorities else None,
                *self.state_of(name, now),
                _finite(core.live_until(name)) if core.is_live(name, now) else None,
                now - received_at[name] if name in received_at else None,
            )
            for name, input_ in core.inputs.items()
        )

    def locks(self, topics: Mapping[str, str], now: float) -> tuple[MuxLockState, ...]:
        """Return all locks."""
        locks = self._core.locks
        return tuple(
            MuxLockState(
                name, topics[name], int(entry.priority) if entry.priority < math.inf else None, locks.why(name, now)
            )
            for name, entry in locks.declared.items()
        )

    def _shut(self) -> str:
        if self._core.is_closed:
            return "closed: the robot is going down"
        if self._core.is_stopped:
            return "stopped"
        return "held: robot time stands still" if self._core.is_held else ""

    def _nobody(self) -> str:
        selected = self._core.arbiter.selected
        return f"{selected} is selected, and silent" if selected in self._core.inputs else "no input"

    def _who_holds(self, now: float) -> str:
        core = self._core
        if core.active is not None:
            return f"{core.active} holds"
        resting = [name for name in core.inputs if name in core.waiting and now <= core.sending_until[name]]
        return f"{_listed(resting)} must come to rest once" if resting else ""

    def _who_locks(self, now: float) -> list[str]:
        core, parts = self._core, list[str]()
        if not core.locks:
            return parts
        if hand := [name for name in core.locked_out(now) if name in core.locks.by_hand]:
            parts.append(f"{_listed(hand)} {_are(hand)} locked by hand")
        if out := [name for name in core.locked_out(now) if core.locks.above(core.inputs[name], now)]:
            reasons = [core.locks.why(name, now) for name in core.locks.engaged(now)]
            parts.append(f"{_listed(reasons)}: {_listed(out)} {_are(out)} locked out")
        return parts


def _listed(names: Sequence[str]) -> str:
    return " and ".join(names)


def _are(names: Sequence[str]) -> str:
    return "is" if len(names) == 1 else "are"


def _finite(time: float) -> float | None:
    return time if time < math.inf else None
