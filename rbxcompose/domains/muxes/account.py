"""What a mux reports about itself: who holds the output, who waits, and why."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from rbxcompose.domains.muxes.core import MuxCore
from rbxcompose.domains.muxes.requests import MuxInputState, MuxLockState

Core = MuxCore[Any]


def why(core: Core, now: float) -> str:
    """Return a sentence for people on what controls the output at `now`.

    It has no times: each message of a source would make them wrong, and no status is worth sending that often.
    """
    if (shut := _shut(core)) or not core.inputs:
        return shut or "no input"
    parts = [_who_holds(core, now), *_who_locks(core, now)]
    return "; ".join(filter(None, parts)) or _nobody(core)


def state_of(core: Core, name: str, now: float) -> tuple[str, str]:
    """Return the state of an input in a word and, in more words, why; empty if there is nothing to add."""
    if name == core.active:
        return "holds", ""
    if shut := _shut(core):
        return "waits", shut
    if name in core.locks.by_hand:
        return "locked", by_hand(core, name, now)
    if above := core.locks.above(core.inputs[name], now):
        return "locked", _listed([core.locks.why(lock, now) for lock in above])
    if name in core.waiting:
        return "must rest", "it must come to rest once"
    if not core.is_live(name, now):
        return "silent", ""
    holder = core.active
    return "waits", core.arbiter.passed_over(name, holder, core.inputs) if holder else "it is not selected"


def by_hand(core: Core, name: str, now: float) -> str:
    """Return until when an input is locked by hand."""
    until = core.locks.by_hand[name]
    return "by hand" if until == math.inf else f"by hand, for another {max(until - now, 0.0):.1f} s"


def _shut(core: Core) -> str:
    if core.is_closed:
        return "closed: the robot is going down"
    if core.is_stopped:
        return "stopped"
    return "held: robot time stands still" if core.is_held else ""


def _nobody(core: Core) -> str:
    return f"{core.arbiter.selected} is selected, and silent" if core.arbiter.selected in core.inputs else "no input"


def _who_holds(core: Core, now: float) -> str:
    if core.active is not None:
        return f"{core.active} holds"
    resting = [name for name in core.inputs if name in core.waiting and now <= core.sending_until[name]]
    return f"{_listed(resting)} must come to rest once" if resting else ""


def _who_locks(core: Core, now: float) -> list[str]:
    parts: list[str] = []
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


def states_of(
    core: Core, topics: Mapping[str, str], received_at: Mapping[str, float], now: float, *, has_priorities: bool
) -> tuple[MuxInputState, ...]:
    """Return all inputs; `received_at` has the time of the last message of each."""
    return tuple(
        MuxInputState(
            name,
            topics[name],
            input_.priority if has_priorities else None,
            *state_of(core, name, now),
            _finite(core.live_until(name)) if core.is_live(name, now) else None,
            now - received_at[name] if name in received_at else None,
        )
        for name, input_ in core.inputs.items()
    )


def lock_states(core: Core, topics: Mapping[str, str], now: float) -> tuple[MuxLockState, ...]:
    """Return all locks."""
    return tuple(
        MuxLockState(
            name, topics[name], int(entry.priority) if entry.priority < math.inf else None, core.locks.why(name, now)
        )
        for name, entry in core.locks.declared.items()
    )


def _finite(time: float) -> float | None:
    return time if time < math.inf else None
