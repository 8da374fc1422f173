"""Inverse kinematics as goals ask for it: near a posture, and as near as possible where it cannot be exact."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Self

import numpy as np

from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.arms.motion import inverse_kinematics
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.collisions import Checker
from rbxcompose.domains.arms.motion.groups import Array, JointSpace
from rbxcompose.domains.arms.motion.path_constraints import Keep, KeptTip

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


def slid(search: inverse_kinematics.PoseSearch, values: Array, posture: Posture) -> Array:
    """Return solutions of a target nearer to a posture, from one of them: free, and verified as those of a search."""
    kinematics, space, target = search.kinematics, search.space, search.target
    wanted, bounds, (top, end) = kinematics.placement(target.pose), inverse_kinematics.bounds_of(space), target.rows
    here, distance, share = values, posture.distance(space, values), 1.0
    for _ in range(STEPS):
        step = _step(kinematics.error(here, wanted)[1][top:end], posture, space, here, bounds)
        longest = share * float(np.abs(step).max())
        if longest < LEAST:
            break
        first = np.clip(here + step * share * min(1.0, inverse_kinematics.LONGEST / longest), *bounds)
        moved = space.nearest_turns(inverse_kinematics.descended(kinematics, space, target, first)[0], values)
        left = posture.distance(space, moved)
        if left <= distance - LEAST and target.is_met(kinematics.tip_pose(moved)) and search.is_free(moved):
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


FIRSTS = 20  # random positions to begin from, beside the present ones
MOST_APPROACH_STEPS = 200  # of one approach, at most
FIRST_DAMPING, MOST_DAMPING = 1e-3, 1e8  # of what the greatest joint weighs
STILL = 1e-6  # of the square of the error, by which a step that is worth it makes that less
WAYS, POINTS = 5, 40  # ways to positions that collide, and points on each, where the last free one is looked for
AS_NEAR = 1.0  # tolerances by which others may be farther away than the nearest one


def nearest_poses(search: inverse_kinematics.PoseSearch) -> Generator[None, None, tuple[Array, ...]]:
    """Return free positions of joints whose tip is as near to the target as was found, the nearest first.

    It is never farther away than at the start, if that is free and within the limits; without any that are free,
    nothing is returned. What is nearer counts in tolerances of the target. It yields while it works, and ends with what
    it has when it `is_late`.
    """
    kinematics, space, target, is_free = search.kinematics, search.space, search.target, search.is_free
    free: list[Array] = []
    colliding: list[Array] = []
    first = space.clamped(search.start)
    for sample in (first, *map(space.clamped, search.guesses), *space.samples(FIRSTS, search.seed)):
        end = _approached(kinematics, target, sample, inverse_kinematics.bounds_of(space))
        end = space.nearest_turns(end, search.start)
        (free if is_free(end) else colliding).append(end)
        if search.is_late():
            break
        yield

    def excess(values: Array) -> float:
        return target.excess(kinematics.tip_pose(values))

    for array in sorted(colliding, key=excess)[:WAYS]:
        points = first + (array - first) * np.linspace(0.0, 1.0, POINTS)[:, None]
        nearer = [at for at in sorted(points, key=excess) if not free or excess(at) < min(map(excess, free))]
        free += next(([at] for at in nearer if is_free(at)), [])
        yield
    if not free or excess(first) < min(map(excess, free)):
        free += [first] if is_free(first) else []
    ordered = sorted(free, key=excess)
    return tuple(one for one in ordered if excess(one) <= excess(ordered[0]) + AS_NEAR)


def _approached(
    kinematics: ArmKinematics, target: inverse_kinematics.PoseTarget, first: Array, bounds: tuple[Array, Array]
) -> Array:
    """Return where no small step within the limits brings the tip nearer to the target any more."""
    wanted, values, damping = kinematics.placement(target.pose), np.clip(first, *bounds), FIRST_DAMPING
    error, jacobian = _weighed(kinematics, target, wanted, values)
    size = float(error @ error)
    for _ in range(MOST_APPROACH_STEPS):
        step = _approach_step(jacobian, error, damping, values, bounds)
        share = inverse_kinematics.LONGEST / max(float(np.abs(step).max()), inverse_kinematics.LONGEST)
        moved = np.clip(values + share * step, *bounds)
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


def _weighed(
    kinematics: ArmKinematics, target: inverse_kinematics.PoseTarget, wanted: Any, values: Array
) -> tuple[Array, Array]:
    """Return the parts of the error that count, in tolerances, and their Jacobian.

    That of the angles is the one of small errors. It has the gradient of large ones, too: the turn's own axis is what
    the exact one leaves as it is.
    """
    error, jacobian = kinematics.error(values, wanted)
    weights = np.repeat((1.0 / target.tolerance, 1.0 / target.angle_tolerance), 3)
    top, end = target.rows
    return (weights * error)[top:end], (weights[:, None] * jacobian)[top:end]


def _approach_step(jacobian: Array, error: Array, damping: float, values: Array, bounds: tuple[Array, Array]) -> Array:
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


APART = 0.05  # [rad or m] by which a joint of another solution is elsewhere


def searched(
    search: inverse_kinematics.PoseSearch, posture: Posture | None = None
) -> Generator[None, None, inverse_kinematics.PoseSolutions]:
    """Return solutions as `solved` does, those nearest to a posture first if there is one.

    Each free one is brought as near to the posture as its tip stays at the target. It never ends farther from the
    posture than a search without it, since that one's attempts are among its own. If nothing free meets the target and
    that is approximate, the solutions are the nearest ones; the posture does not count then.
    """
    guesses, target = () if posture is None else (posture.guess(search.start),), search.target
    found = yield from inverse_kinematics.solved(replace(search, enough=search.enough + len(guesses), guesses=guesses))
    if not found.free and target.is_approximate:
        near = yield from nearest_poses(replace(search, guesses=(*guesses, *found.colliding)))
        exact = tuple(item for item in near if target.is_met(search.kinematics.tip_pose(item)))  # missed by restarts
        found = replace(found, free=_apart(exact or near)[: search.enough], is_approximate=bool(near) and not exact)
    if posture is None or found.is_approximate:
        return found
    free = []
    for array in found.free:
        free.append(slid(search, array, posture))
        yield
    return replace(found, free=_apart(nearest_first(search.space, posture, free)))


def nearest_first(space: JointSpace, posture: Posture, solutions: Iterable[Array]) -> tuple[Array, ...]:
    """Return solutions, those nearest to a posture first."""
    return tuple(sorted(solutions, key=lambda values: posture.distance(space, values)))


def _apart(solutions: Iterable[Array]) -> tuple[Array, ...]:
    """Return them without those that have come to where another one is: a way that one has not, that has not either."""
    found: list[Array] = []
    for solution in solutions:
        if all(float(np.abs(solution - other).max()) > APART for other in found):
            found.append(solution)
    return tuple(found)


def kept_solutions(
    search: inverse_kinematics.PoseSearch, keep: Keep, first: Array, checker: Checker, posture: Posture | None = None
) -> Generator[None, None, inverse_kinematics.PoseSolutions]:
    """Return solutions as `solved` does, for a target of which only the position counts.

    With a posture, one of the attempts begins there, and the solutions nearest to it come first. What is kept is
    measured from positions `first`, where the whole motion began.
    """
    kinematics, space, target, start = search.kinematics, search.space, search.target, search.start
    frame = kinematics.poses(first)[keep.frame].inverse() if keep.frame else None
    point = frame.apply(target.pose.translation) if frame is not None else target.pose.translation
    half = inverse_kinematics.CLOSER * target.tolerance / math.sqrt(3.0)
    x, y, z = ((value - half, value + half) for value in point)
    kept = KeptTip(kinematics, keep, first, checker)
    there = KeptTip(kinematics, replace(keep, inside=(x, y, z)), first, checker)
    free: list[Array] = []
    colliding: list[Array] = []
    nearest, attempts = (math.inf, math.inf), 0
    guesses = (start,) if posture is None else (start, posture.guess(start))
    for guess in (*map(space.clamped, guesses), *space.samples(inverse_kinematics.RESTARTS, search.seed)):
        attempts += 1
        values = there.projected(guess, space)
        if values is not None and kept.is_kept(values) and target.is_met(kinematics.tip_pose(values)):
            (free if checker.is_free(values) else colliding).append(values)
        elif (alone := kept.projected(guess, space)) is not None:
            nearest = min(nearest, target.error(kinematics.tip_pose(alone)))
        if len(free) >= inverse_kinematics.ENOUGH + len(guesses) - 1:
            break
        yield
    near, not_free = (inverse_kinematics.by_distance(item, start) for item in (free, colliding))
    ordered = near if posture is None else nearest_first(space, posture, near)
    return inverse_kinematics.PoseSolutions(ordered, not_free, nearest, attempts)
