"""A straight line of the tip: the positions of joints along it, each the nearest to the one before."""

from __future__ import annotations

import math

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
class StraightLine:
    """Positions of joints from the start as far as the line was followed, of shape (m, n), and why no farther."""

    positions: Array
    fraction: float
    problem: str = ""


def straight(
    kinematics: ArmKinematics, space: JointSpace, start: Array, goal: Transform3, step: float = STEP
) -> StraightLine:
    """Follow the line from the tip's pose at `start` to `goal`, both in the root's frame, turning evenly on the way.

    Collisions are not looked at. `step` is the distance between poses [m].
    """
    here = kinematics.tip_pose(start)
    away, angle = PoseTarget(goal).error(here)
    count = max(1, math.ceil(away / step), math.ceil(angle / TURN))
    found = [start]
    for index in range(1, count + 1):
        share = index / count
        pose = Transform3(lerp(here.translation, goal.translation, share), slerp(here.rotation, goal.rotation, share))
        target = PoseTarget(pose)
        values, missed = descended(kinematics, space, target, found[-1])
        jump = float(np.max(np.abs(values - found[-1])))
        if not target.is_met(kinematics.tip_pose(values)):
            problem = (
                f"the line ends {missed[0] * 100:.1f} cm and {math.degrees(missed[1]):.1f} deg beside a pose on it"
            )
        elif jump > JUMP:
            problem = f"a joint would have to jump by {jump:.2f} rad"
        elif (beside := _off_half_way(kinematics, found[-1], values, here, goal, share - 0.5 / count)) > BESIDE:
            problem = f"the tip would leave the line by {beside * 1e3:.1f} mm between two poses"
        else:
            found.append(values)
            continue
        return StraightLine(
            np.array(found), (index - 1) / count, f"{problem}, at {(index - 1) / count:.0%} of the line"
        )
    return StraightLine(np.array(found), 1.0)


def _off_half_way(
    kinematics: ArmKinematics, before: Array, after: Array, here: Transform3, goal: Transform3, share: float
) -> float:
    """Return how far the tip is from its place on the line [m] when joints are half way between two poses."""
    at, wanted = kinematics.tip_pose((before + after) / 2).translation, lerp(here.translation, goal.translation, share)
    return math.dist(at, wanted)
