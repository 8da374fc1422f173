"""A straight line of the tip: the positions of joints along it, each the nearest to the one before."""

from __future__ import annotations

import math
from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import Transform3, lerp, slerp
from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.inverse_kinematics import TOLERANCE, PoseTarget, descended
from rbxcompose.motion.joint_space import JointSpace

Array = NDArray[np.float64]

STEP = 0.005  # [m] between poses of the tip
TURN = 0.1  # [rad] between them
JUMP = 0.5  # [rad or m] that a joint may move from one pose to the next
BESIDE = 2 * TOLERANCE  # [m] by which the tip may be off half way between two poses


@dataclass(frozen=True, slots=True)
class LineEnd:
    """How much of a line was followed, and why no more; nothing if that was all of it."""

    fraction: float
    problem: str = ""


def line_steps(
    kinematics: ArmKinematics, space: JointSpace, start: Array, goal: Transform3, step: float = STEP
) -> Generator[Array, None, LineEnd]:
    """Yield positions on the line from the tip's pose at `start` to `goal`, both in the root's frame, after `start`.

    The tip turns evenly on the way. Collisions are not looked at. `step` is the distance between poses [m].
    """
    here, last = kinematics.tip_pose(start), start
    away, angle = PoseTarget(goal).error(here)
    count = max(1, math.ceil(away / step), math.ceil(angle / TURN))
    for index in range(1, count + 1):
        share = index / count
        pose = Transform3(lerp(here.translation, goal.translation, share), slerp(here.rotation, goal.rotation, share))
        target = PoseTarget(pose)
        values, missed = descended(kinematics, space, target, last)
        jump = float(np.max(np.abs(values - last)))
        if not target.is_met(kinematics.tip_pose(values)):
            problem = (
                f"the line ends {missed[0] * 100:.1f} cm and {math.degrees(missed[1]):.1f} deg beside a pose on it"
            )
        elif jump > JUMP:
            problem = f"a joint would have to jump by {jump:.2f} rad"
        elif (beside := _off_half_way(kinematics, last, values, here, goal, share - 0.5 / count)) > BESIDE:
            problem = f"the tip would leave the line by {beside * 1e3:.1f} mm between two poses"
        else:
            yield values
            last = values
            continue
        return LineEnd((index - 1) / count, f"{problem}, at {(index - 1) / count:.0%} of the line")
    return LineEnd(1.0)


def _off_half_way(
    kinematics: ArmKinematics, before: Array, after: Array, here: Transform3, goal: Transform3, share: float
) -> float:
    """Return how far the tip is from its place on the line [m] when joints are half way between two poses."""
    at, wanted = kinematics.tip_pose((before + after) / 2).translation, lerp(here.translation, goal.translation, share)
    return math.dist(at, wanted)
