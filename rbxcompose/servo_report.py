"""What a bus of servos tells: where its joints are, and how they are."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np

from rbxcompose.actuation.joint_drive import JointDrive
from rbxcompose.actuation.periods import Periods
from rbxcompose.control.joint_states import JointMode
from rbxcompose.dataclass import dataclass
from rbxcompose.levels import Level
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header


@dataclass(frozen=True, slots=True)
class ServoReport:
    """A status for diagnostics."""

    level: Level
    message: str
    values: Mapping[str, object]


def joint_state(drives: Iterable[JointDrive], stamp: int) -> JointState | None:
    """Return where the joints are that have been measured, None if none has; `stamp` is in ns."""
    known = [one for one in drives if math.isfinite(one.measured.position)]
    if not known:
        return None
    return JointState(
        header=Header(stamp=to_time(stamp)),
        name=tuple(one.joint.name for one in known),
        position=np.array([one.measured.position for one in known]),
        velocity=np.array([one.measured.velocity for one in known]),
        effort=np.array([one.effort for one in known]),
    )


def report(
    drives: Mapping[str, JointDrive], controllers: Mapping[str, str], periods: Periods, *, is_lost: bool
) -> ServoReport:
    """Return how the joints are, with the notes of controllers."""
    notes = {name: one.condition.note or one.refused or one.clamped for name, one in drives.items()} | dict(controllers)
    notes = {name: words for name, words in notes.items() if words}
    bad = [name for name, one in drives.items() if one.mode in (JointMode.FAULT, JointMode.RESTING)]
    level = Level.ERROR if bad or is_lost else Level.WARN if notes else Level.OK
    message = "; ".join(f"{name}: {words}" for name, words in notes.items()) or f"{len(drives)} joints"
    kept = {"periods_met": f"{100 * periods.share_met:.2f} %", "late": f"{1e3 * periods.late(0.99):.1f} ms"}
    return ServoReport(level, message, {**{name: one.mode for name, one in drives.items()}, **kept})
