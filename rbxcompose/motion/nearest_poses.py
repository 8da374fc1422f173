"""Positions of joints that bring the tip as near to a pose as is possible, where it cannot be taken.

Levenberg and Marquardt's method within the limits of joints (Madsen, Nielsen and Tingleff, Methods for Non-Linear Least
Squares Problems, 2004): other than the descents that look for a pose, it never gets farther away, and goes on until no
small step helps.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.damped_steps import LONGEST
from rbxcompose.motion.inverse_kinematics import PoseTarget, bounds_of
from rbxcompose.motion.joint_space import JointSpace

Array = NDArray[np.float64]

FIRSTS = 20  # random positions to begin from, beside the present ones
STEPS = 200  # of one approach, at most
FIRST_DAMPING, MOST_DAMPING = 1e-3, 1e8  # of what the greatest joint weighs
STILL = 1e-6  # of the square of the error, by which a step that is worth it makes that less
WAYS, POINTS = 5, 40  # ways to positions that collide, and points on each, where the last free one is looked for
AS_NEAR = 1.0  # tolerances by which others may be farther away than the nearest one


def nearest_poses(
    kinematics: ArmKinematics,
    space: JointSpace,
    target: PoseTarget,
    start: Array,
    is_free: Callable[[Array], bool],
    *,
    seed: int,
    guesses: Sequence[Array] = (),
    is_late: Callable[[], bool] = lambda: False,
) -> Generator[None, None, tuple[Array, ...]]:
    """Return free positions of joints whose tip is as near to the target as was found, the nearest first.

    It is never farther away than at the start, if that is free and within the limits; without any that are free,
    nothing is returned. What is nearer counts in tolerances of the target. It yields while it works, and ends with what
    it has when it `is_late`.
    """
    free: list[Array] = []
    colliding: list[Array] = []
    first = space.clamped(start)
    for one in (first, *map(space.clamped, guesses), *space.samples(FIRSTS, seed)):
        end = space.nearest_turns(_approached(kinematics, target, one, bounds_of(space)), start)
        (free if is_free(end) else colliding).append(end)
        if is_late():
            break
        yield

    def excess(values: Array) -> float:
        return target.excess(kinematics.tip_pose(values))

    for one in sorted(colliding, key=excess)[:WAYS]:
        points = first + (one - first) * np.linspace(0.0, 1.0, POINTS)[:, None]
        nearer = [at for at in sorted(points, key=excess) if not free or excess(at) < min(map(excess, free))]
        free += next(([at] for at in nearer if is_free(at)), [])
        yield
    if not free or excess(first) < min(map(excess, free)):
        free += [first] if is_free(first) else []
    ordered = sorted(free, key=excess)
    return tuple(one for one in ordered if excess(one) <= excess(ordered[0]) + AS_NEAR)


def _approached(kinematics: ArmKinematics, target: PoseTarget, first: Array, bounds: tuple[Array, Array]) -> Array:
    """Return where no small step within the limits brings the tip nearer to the target any more."""
    wanted, values, damping = kinematics.placement(target.pose), np.clip(first, *bounds), FIRST_DAMPING
    error, jacobian = _weighed(kinematics, target, wanted, values)
    size = float(error @ error)
    for _ in range(STEPS):
        step = _step(jacobian, error, damping, values, bounds)
        moved = np.clip(values + step * min(1.0, LONGEST / max(float(np.abs(step).max()), LONGEST)), *bounds)
        ahead, there = _weighed(kinematics, target, wanted, moved)
        left = float(ahead @ ahead)
        if left < size:
            is_still = size - left <= STILL * size
            values, error, jacobian, size, damping = moved, ahead, there, left, damping / 3.0
            if is_still:
                break
        else:
            damping *= 4.0
            if damping > MOST_DAMPING:
                break
    return values


def _weighed(kinematics: ArmKinematics, target: PoseTarget, wanted: Any, values: Array) -> tuple[Array, Array]:
    """Return the parts of the error that count, in tolerances, and their Jacobian.

    That of the angles is the one of small errors. It has the gradient of large ones, too: the turn's own axis is what
    the exact one leaves as it is.
    """
    error, jacobian = kinematics.error(values, wanted)
    weights = np.repeat((1.0 / target.tolerance, 1.0 / target.angle_tolerance), 3)
    top, end = target.rows
    return (weights * error)[top:end], (weights[:, None] * jacobian)[top:end]


def _step(jacobian: Array, error: Array, damping: float, values: Array, bounds: tuple[Array, Array]) -> Array:
    """Return the damped step, of shape (n,); joints stay that would go beyond the limit at which they are."""
    slope = jacobian.T @ error
    blocked = np.where(slope < 0.0, values <= bounds[0], values >= bounds[1])
    moving = np.flatnonzero(~blocked)
    step = np.zeros(len(values))
    if len(moving):
        square = jacobian[:, moving].T @ jacobian[:, moving]
        greatest = max(float(square.diagonal().max()), math.ulp(1.0))
        step[moving] = np.linalg.solve(square + damping * greatest * np.eye(len(moving)), slope[moving])
    return step
