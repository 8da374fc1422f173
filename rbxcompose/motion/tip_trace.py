"""Positions of joints that lead the tip along a way, without a jump from one to the next.

Each step is found from the last one by inverse kinematics. It is halved until the tip is where it should be also in the
middle of the joints' straight line between both: so a jump to another posture, however small, has no step that is short
enough. That needs no threshold for joints, which would fit one arm and speed only.
"""

from __future__ import annotations

import math
from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from rbxcompose.dataclass import dataclass
from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.collisions import Checker, told
from rbxcompose.motion.inverse_kinematics import PoseTarget, descended
from rbxcompose.motion.joint_space import JointSpace
from rbxcompose.motion.tip_path import TipStretch

Array = NDArray[np.float64]

STEP, LEAST = 5e-3, 5e-5  # [m] from one position to the next
FOUND, FOUND_ANGLE = 1e-4, math.radians(0.05)  # [m], [rad] from the way at each step
MIDDLE, MIDDLE_ANGLE = 2e-4, math.radians(0.1)  # [m], [rad] from the way between steps
AT_LIMIT = 1e-6  # [rad or m]


@dataclass(frozen=True, slots=True)
class Traced:
    """Positions of joints, of shape (m, n), at `lengths` [m] of shape (m,), and why they end early, if they do."""

    values: Array
    lengths: Array
    problem: str = ""


def traced(
    kinematics: ArmKinematics,
    space: JointSpace,
    checker: Checker,
    way: TipStretch,
    start: Array,
    *,
    any_orientation: bool,
    step: float = STEP,
) -> Generator[None, None, Traced]:
    """Return positions that lead the tip along a way as far as that is possible; it yields after each step."""
    values, lengths, here, problem = [start], [0.0], 0.0, ""
    stops, most = [*way.ends], step
    while here < way.length - LEAST / 2:
        end = next((one for one in stops if one > here + LEAST / 2), way.length)  # no step is across a corner
        there = min(here + step, end)
        found = _stepped(kinematics, space, checker, way, values[-1], (here, there), any_orientation)
        if isinstance(found, str):
            problem, step = found, step / 2
            if step < LEAST:
                return Traced(np.array(values), np.array(lengths), problem)
        else:
            values.append(found)
            lengths.append(there)
            here, step = there, min(most, step * 2)
        yield
    return Traced(np.array(values), np.array(lengths))


def _stepped(
    kinematics: ArmKinematics,
    space: JointSpace,
    checker: Checker,
    way: TipStretch,
    last: Array,
    step: tuple[float, float],
    any_orientation: bool,
) -> Array | str:
    """Return the positions at the end of a step, or why there are none."""
    target = PoseTarget(way.at(step[1]), any_orientation, FOUND, FOUND_ANGLE)
    values, _ = descended(kinematics, space, target, last)
    if not target.is_met(kinematics.tip_pose(values)):
        return _limit(space, values) or "the arm does not reach farther"
    half = PoseTarget(way.at(sum(step) / 2), any_orientation, MIDDLE, MIDDLE_ANGLE)
    if not half.is_met(kinematics.tip_pose((last + values) / 2)):
        index = int(np.argmax(np.abs(values - last)))
        words = space.joints[index].shown(float(abs(values - last)[index]))
        return f"'{space.names[index]}' would jump by {words}"
    return values if checker.is_free(values) else f"{told(checker.colliding(values))} collide"


def _limit(space: JointSpace, values: Array) -> str:
    """Return which joints are at a limit, in words."""
    beyond = np.minimum(np.abs(values - space.lower), np.abs(space.upper - values)) < AT_LIMIT
    names = [f"'{one.name}'" for one, is_there in zip(space.joints, beyond, strict=True) if is_there]
    return f"{' and '.join(names)} {'is' if len(names) == 1 else 'are'} at a limit" if names else ""


def strayed(
    kinematics: ArmKinematics, way: TipStretch, values: Array, lengths: Array, any_orientation: bool
) -> tuple[float, float]:
    """Return how far the tip is from the way at most [m, rad], at positions (m, n) for `lengths` (m,)."""
    errors = [
        PoseTarget(way.at(length), any_orientation).error(kinematics.tip_pose(one))
        for one, length in zip(values, lengths.tolist(), strict=True)
    ]
    return max(one for one, _ in errors), max(one for _, one in errors)
