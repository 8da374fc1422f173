"""Which of many solutions of inverse kinematics an arm should rather take.

A redundant arm moves its joints while its tip stays: along the null space of the Jacobian (Liegeois, Automatic
Supervisory Control of the Configuration and Behavior of Multibody Mechanisms, 1977), here as far towards the preferred
positions as limits and collisions allow.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from rbxcompose.dataclass import dataclass
from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.damped_steps import LONGEST
from rbxcompose.motion.inverse_kinematics import PoseTarget, bounds_of, descended
from rbxcompose.motion.joint_space import JointSpace

Array = NDArray[np.float64]

STEPS = 40  # along the null space, at most
LEAST = 1e-3  # [rad or m] that a step brings nearer; less is not worth it
RANK = 1e-3  # of the greatest singular value, below which a direction does not move the tip


@dataclass(frozen=True, slots=True)
class Posture:
    """Positions that joints should rather have [rad or m], of shape (n,); NaN where any position will do."""

    values: Array

    @classmethod
    def of(cls, names: Sequence[str], positions: Mapping[str, float]) -> Self:
        """Return it for joints in this order; those that `positions` leave out may be anywhere."""
        return cls(np.array([positions.get(name, math.nan) for name in names]))

    def guess(self, start: Array) -> Array:
        """Return positions that have it, and otherwise those of the start."""
        return np.where(np.isnan(self.values), start, self.values)

    def way(self, space: JointSpace, values: Array) -> Array:
        """Return what leads there from some positions, of shape (n,); 0 where any position will do."""
        return np.nan_to_num(space.nearest_turns(self.values, values) - values)

    def distance(self, space: JointSpace, values: Array) -> float:
        """Return how far away some positions are: the root of the sum of squares [rad or m]."""
        return float(np.linalg.norm(self.way(space, values)))


def slid(
    kinematics: ArmKinematics,
    space: JointSpace,
    target: PoseTarget,
    values: Array,
    posture: Posture,
    is_free: Callable[[Array], bool],
) -> Array:
    """Return solutions of a target nearer to a posture, from one of them: free, and verified as those of a search."""
    wanted, bounds, (top, end) = kinematics.placement(target.pose), bounds_of(space), target.rows
    here, distance, share = values, posture.distance(space, values), 1.0
    for _ in range(STEPS):
        step = _step(kinematics.error(here, wanted)[1][top:end], posture, space, here, bounds)
        longest = share * float(np.abs(step).max())
        if longest < LEAST:
            break
        first = np.clip(here + step * share * min(1.0, LONGEST / longest), *bounds)
        moved = space.nearest_turns(descended(kinematics, space, target, first)[0], values)
        left = posture.distance(space, moved)
        if left <= distance - LEAST and target.is_met(kinematics.tip_pose(moved)) and is_free(moved):
            here, distance, share = moved, left, min(1.0, 2.0 * share)
        else:
            share /= 2.0
    return here


def _step(jacobian: Array, posture: Posture, space: JointSpace, values: Array, bounds: tuple[Array, Array]) -> Array:
    """Return the step towards a posture, of shape (n,), that does not move the tip, nor joints beyond their limits."""
    count, (lower, upper) = len(values), bounds
    way, counts, held = posture.way(space, values), ~np.isnan(posture.values), np.zeros(count, dtype=bool)
    while True:
        still = np.concatenate((jacobian, np.eye(count)[held]))
        _, sizes, rows = np.linalg.svd(still)
        null = rows[int(np.sum(sizes > RANK * sizes[0])) :].T
        if not null.shape[1]:
            return np.zeros(count)
        step: Array = null @ np.linalg.lstsq(null[counts], way[counts], rcond=RANK)[0]
        beyond = np.where(step < 0.0, values <= lower, (values >= upper) & (step > 0.0)) & ~held
        if not beyond.any():
            return step
        held |= beyond
