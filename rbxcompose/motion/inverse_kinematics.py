"""Positions of joints that bring the tip of an arm to a pose.

Damped least squares (Buss, Introduction to Inverse Kinematics with Jacobian Transpose, Pseudoinverse and Damped Least
Squares Methods, 2004), from the present positions and then from random ones. What converges is verified by the
kinematics of the body, which know nothing of the Jacobian.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator

import numpy as np
from numpy.typing import NDArray

from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import Transform3
from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.joint_space import JointSpace

Array = NDArray[np.float64]

TOLERANCE, ANGLE_TOLERANCE = 1e-3, math.radians(0.5)  # [m], [rad]
RESTARTS = 60
LEAST_DAMPING, DAMPING = 1e-6, 1e-2  # the second one times the square of the error
LONGEST = 1.0  # [rad or m] that a joint moves in one iteration, at most
PATIENCE, PROGRESS = 8, 0.95  # iterations without the error's square shrinking to this share, which end a descent
ENOUGH = 3  # solutions, of which the nearest one is taken
CLOSER = 0.2  # of a tolerance that the search aims at, so that rounding decides nothing


@dataclass(frozen=True, slots=True)
class PoseTarget:
    """Where the tip should be in the frame of the body's root; tolerances in [m] and [rad]."""

    pose: Transform3
    any_orientation: bool = False
    tolerance: float = TOLERANCE
    angle_tolerance: float = ANGLE_TOLERANCE

    @property
    def mistake(self) -> str:
        """Return why it is no target; nothing if it is one."""
        numbers = (*self.pose.translation, *self.pose.rotation)
        if not all(map(math.isfinite, numbers)):
            return "the target is not a finite pose"
        if not 0.0 < math.hypot(*self.pose.rotation) < 2.0:
            return "the orientation of the target is no rotation"
        sizes = (self.tolerance, self.angle_tolerance)
        return "" if all(math.isfinite(one) and one > 0.0 for one in sizes) else "a tolerance is not above 0"

    def error(self, pose: Transform3) -> tuple[float, float]:
        """Return how far away a pose is [m, rad]; the angle is 0 if it does not count."""
        away = math.dist(self.pose.translation, pose.translation)
        if self.any_orientation:
            return away, 0.0
        x, y, z, w = self.pose.inverse().compose(pose).rotation
        return away, 2.0 * math.atan2(math.hypot(x, y, z), abs(w))

    def is_met(self, pose: Transform3) -> bool:
        """Return whether a pose is within both tolerances."""
        away, angle = self.error(pose)
        return away <= self.tolerance and angle <= self.angle_tolerance


@dataclass(frozen=True, slots=True)
class PoseSolutions:
    """Positions of joints that meet a target, the nearest to the start first, each of shape (n,)."""

    free: tuple[Array, ...]
    colliding: tuple[Array, ...]
    nearest: tuple[float, float]
    """How far from the target the best attempt ended [m, rad]."""
    attempts: int


def solved(
    kinematics: ArmKinematics,
    space: JointSpace,
    target: PoseTarget,
    start: Array,
    is_free: Callable[[Array], bool],
    *,
    seed: int,
    restarts: int = RESTARTS,
    enough: int = ENOUGH,
) -> Generator[None, None, PoseSolutions]:
    """Return solutions within the limits of joints; it yields after each attempt. The same seed gives the same."""
    free: list[Array] = []
    colliding: list[Array] = []
    nearest, attempts = (math.inf, math.inf), 0
    for first in (space.clamped(start), *space.samples(restarts, seed)):
        attempts += 1
        ending, away = descended(kinematics, space, target, first)
        nearest, values = min(nearest, away), space.nearest_turns(ending, start)
        if (
            away[0] <= target.tolerance
            and away[1] <= target.angle_tolerance
            and _is_verified(kinematics, target, values)
        ):
            (free if is_free(values) else colliding).append(values)
        if len(free) >= enough:
            break
        yield
    return PoseSolutions(_sorted(free, start), _sorted(colliding, start), nearest, attempts)


def _is_verified(kinematics: ArmKinematics, target: PoseTarget, values: Array) -> bool:
    return target.is_met(kinematics.tip_pose(values))


def _sorted(found: list[Array], start: Array) -> tuple[Array, ...]:
    return tuple(sorted(found, key=lambda values: float(np.max(np.abs(values - start)))))


def descended(
    kinematics: ArmKinematics, space: JointSpace, target: PoseTarget, first: Array
) -> tuple[Array, tuple[float, float]]:
    """Return where the descent from `first` ends, and how far from the target [m, rad]; it ends when it gets stuck."""
    values, lower, upper = first.copy(), space.lower, space.upper
    wanted, rows = kinematics.placement(target.pose), slice(0, 3 if target.any_orientation else 6)
    identity, best, patience = np.eye(rows.stop), math.inf, PATIENCE
    while True:
        error, jacobian = kinematics.error(values, wanted)
        error, jacobian = error[rows], jacobian[rows]
        away = math.hypot(*error[:3].tolist()), math.hypot(*error[3:].tolist())
        square = float(error @ error)
        patience = PATIENCE if square < PROGRESS * best else patience - 1
        best = min(best, square)
        is_met = away[0] <= CLOSER * target.tolerance and away[1] <= CLOSER * target.angle_tolerance
        if is_met or not patience:
            return values, away
        damped = jacobian @ jacobian.T + (LEAST_DAMPING + DAMPING * square) * identity
        step = jacobian.T @ np.linalg.solve(damped, error)
        step *= min(1.0, LONGEST / max(float(np.max(np.abs(step))), 1e-12))
        values = np.clip(values + step, lower, upper)
