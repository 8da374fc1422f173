"""Positions of joints that bring the tip of an arm to a pose.

Damped least squares (Buss, Introduction to Inverse Kinematics with Jacobian Transpose, Pseudoinverse and Damped Least
Squares Methods, 2004), from the present positions and then from random ones. What converges is verified by the
kinematics of the body, which know nothing of the Jacobian. Goals may ask for solutions near a posture, and for poses as
near as possible where they cannot be exact.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Self

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3, angle_between
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.collisions import Checker
from rbxcompose.domains.arms.motion.damped_steps import DAMPING, LEAST_DAMPING, LONGEST, PATIENCE, PROGRESS
from rbxcompose.domains.arms.motion.groups import JointSpace
from rbxcompose.domains.arms.motion.path_constraints import Keep, KeptTip

TOLERANCE, ANGLE_TOLERANCE = 1e-3, math.radians(0.5)  # [m], [rad]
RESTARTS = 60
ENOUGH = 3  # solutions, of which the nearest one is taken
TOGETHER = 8  # descents of compiled code, after which a search lets others run
EDGE = 1e-4  # [rad or m] from the limits of joints, so that curves through solutions stay within them
CLOSER = 0.2  # of a tolerance that the search aims at, so that rounding decides nothing


@dataclass(frozen=True, slots=True)
class PoseTarget:
    """Where the tip should be in the frame of the body's root; tolerances in [m] and [rad]."""

    pose: Transform3
    any_orientation: bool = False
    tolerance: float = TOLERANCE
    angle_tolerance: float = ANGLE_TOLERANCE
    any_position: bool = False
    is_approximate: bool = False
    """Whether the nearest pose that can be taken will do if this one cannot."""

    @property
    def rows(self) -> tuple[int, int]:
        """Return which parts of an error count, of three lengths and then three angles: from the first to the last."""
        return 3 if self.any_position else 0, 3 if self.any_orientation else 6

    @property
    def mistake(self) -> str:
        """Return why it is no target; nothing if it is one."""
        numbers = (*self.pose.translation, *self.pose.rotation)
        if not all(map(math.isfinite, numbers)):
            return "the target is not a finite pose"
        if not 0.0 < math.hypot(*self.pose.rotation) < 2.0:
            return "the orientation of the target is no rotation"
        if self.any_position and self.any_orientation:
            return "neither the position nor the orientation of the target counts"
        sizes = (self.tolerance, self.angle_tolerance)
        return "" if all(math.isfinite(size) and size > 0.0 for size in sizes) else "a tolerance is not above 0"

    def error(self, pose: Transform3) -> tuple[float, float]:
        """Return how far away a pose is [m, rad]; what does not count is 0."""
        away = 0.0 if self.any_position else math.dist(self.pose.translation, pose.translation)
        return away, 0.0 if self.any_orientation else angle_between(self.pose.rotation, pose.rotation)

    def is_met(self, pose: Transform3) -> bool:
        """Return whether a pose is within both tolerances."""
        away, angle = self.error(pose)
        return away <= self.tolerance and angle <= self.angle_tolerance

    def excess(self, pose: Transform3) -> float:
        """Return how far away a pose is, counted in tolerances: those say how much a length weighs beside an angle."""
        away, angle = self.error(pose)
        return math.hypot(away / self.tolerance, angle / self.angle_tolerance)


@dataclass(frozen=True, slots=True)
class SolverSettings:
    """How to search positions of joints: from `restarts` random ones after the present ones, for at most `time` [s]."""

    restarts: int = RESTARTS
    time: float = math.inf
    tolerance: float = TOLERANCE
    angle_tolerance: float = ANGLE_TOLERANCE
    prefer: str = ""
    """The pose of the arm that solutions should be near to, if a goal does not name one."""


SOLVER = SolverSettings()


@dataclass(frozen=True, slots=True)
class PoseSolutions:
    """Positions of joints that meet a target, the nearest to the start first, each of shape (n,)."""

    free: tuple[Array, ...]
    colliding: tuple[Array, ...]
    nearest: tuple[float, float]
    """How far from the target the best attempt ended [m, rad]."""
    attempts: int
    is_approximate: bool = False
    """Whether the free ones are as near to the target as is possible, and not within its tolerances."""

    @property
    def miss(self) -> str:
        """Return how near the best attempt was, in words."""
        away, angle = self.nearest
        return f"the tip got within {away * 100:.1f} cm and {math.degrees(angle):.1f} deg of it"


@dataclass(frozen=True, slots=True)
class PoseSearch:
    """A search for positions of joints that bring the tip to a target; the same seed gives the same.

    It begins from the start, then from `guesses`, then from `restarts` random positions. It ends with what it has when
    there are `enough` that are free, or it `is_late`.
    """

    kinematics: ArmKinematics
    space: JointSpace
    target: PoseTarget
    start: Array
    is_free: Callable[[Array], bool]
    seed: int
    restarts: int = RESTARTS
    enough: int = ENOUGH
    is_late: Callable[[], bool] = lambda: False
    guesses: Sequence[Array] = ()

    def random(self, count: int) -> Array:
        """Return random positions, of shape (count, n); joints that do not move the tip stay where they are."""
        return np.where(self.kinematics.moves_tip, self.space.samples(count, self.seed), self.space.clamped(self.start))


def solved(search: PoseSearch) -> Generator[None, None, PoseSolutions]:
    """Return solutions within the limits of joints; it yields after some attempts."""
    kinematics, space, target, start = search.kinematics, search.space, search.target, search.start
    free: list[Array] = []
    colliding: list[Array] = []
    nearest, attempts, bounds = (math.inf, math.inf), 0, bounds_of(space)
    firsts = space.clamped(start)[None]
    while True:
        tried, ending, each = _descents(kinematics, target, firsts, bounds)
        attempts, firsts = attempts + tried, firsts[tried:]
        nearest, away, values = min(nearest, *each), each[-1], space.nearest_turns(ending, start)
        if (
            away[0] <= target.tolerance
            and away[1] <= target.angle_tolerance
            and target.is_met(kinematics.tip_pose(values))
        ):
            (free if search.is_free(values) else colliding).append(values)
        if attempts == 1:
            guesses = (space.clamped(guess)[None] for guess in search.guesses)
            firsts = np.concatenate((*guesses, search.random(search.restarts)))
        if len(free) >= search.enough or search.is_late() or not len(firsts):
            break
        yield
    return PoseSolutions(by_distance(free, start), by_distance(colliding, start), nearest, attempts)


def by_distance(found: Sequence[Array], start: Array) -> tuple[Array, ...]:
    """Return positions, first those to which the joint that moves furthest moves least."""
    return tuple(sorted(found, key=lambda values: float(np.abs(values - start).max())))


def descended(
    kinematics: ArmKinematics, space: JointSpace, target: PoseTarget, first: Array
) -> tuple[Array, tuple[float, float]]:
    """Return where the descent from `first` ends, and how far from the target [m, rad]; it ends when it gets stuck."""
    _, values, each = _descents(kinematics, target, first[None], bounds_of(space))
    return values, each[-1]


def bounds_of(space: JointSpace) -> tuple[Array, Array]:
    """Return the least and the greatest positions of solutions, each of shape (n,); infinite without a limit."""
    lower, upper = space.lower, space.upper
    edge = np.minimum(EDGE, (upper - lower) / 4)
    return lower + edge, upper - edge


def _descents(
    kinematics: ArmKinematics, target: PoseTarget, firsts: Array, bounds: tuple[Array, Array]
) -> tuple[int, Array, list[tuple[float, float]]]:
    """Descend from some of the positions, of shape (k, n), at most until one descent ends within the tolerances.

    Return from how many, where the last one ended, and how far from the target [m, rad] each of them.
    """
    rows, tolerances = target.rows, (target.tolerance, target.angle_tolerance)
    near = CLOSER * target.tolerance, CLOSER * target.angle_tolerance
    if (tip := kinematics.compiled) is not None:
        tried, values, away = tip.descend(tip.aim(target.pose, rows, near, tolerances, bounds), firsts[:TOGETHER])
        return tried, values, [(one, other) for one, other in away[:tried].tolist()]
    values, missed = _descent(kinematics, kinematics.placement(target.pose), firsts[0], rows, near, bounds)
    return 1, values, [missed]


def _descent(
    kinematics: ArmKinematics,
    wanted: Any,
    first: Array,
    rows: tuple[int, int],
    near: tuple[float, float],
    bounds: tuple[Array, Array],
) -> tuple[Array, tuple[float, float]]:
    values, (lower, upper), (top, end) = first.copy(), bounds, rows
    identity, best, patience = np.eye(end - top), math.inf, PATIENCE
    while True:
        error, jacobian = kinematics.error(values, wanted)
        parts = error.tolist()
        away = math.hypot(*parts[top:3]), math.hypot(*parts[3:end])
        if end - top < len(error):
            error, jacobian = error[top:end], jacobian[top:end]
        square = away[0] * away[0] + away[1] * away[1]
        patience = PATIENCE if square < PROGRESS * best else patience - 1
        best = min(best, square)
        if (away[0] <= near[0] and away[1] <= near[1]) or not patience:
            return values, away
        damping = (LEAST_DAMPING + DAMPING * square) * identity
        step = jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + damping, error)
        at_limit = np.where(step < 0.0, values <= lower, values >= upper)
        if at_limit.any():  # the others do the part of joints that cannot: else most descents get stuck
            jacobian = jacobian * ~at_limit
            step = jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + damping, error)
        longest = float(np.abs(step).max())
        if longest > LONGEST:
            step *= LONGEST / longest
        values = np.minimum(np.maximum(values + step, lower), upper)  # which is faster than clipping


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


def slid(search: PoseSearch, values: Array, posture: Posture) -> Array:
    """Return solutions of a target nearer to a posture, from one of them: free, and verified as those of a search."""
    kinematics, space, target = search.kinematics, search.space, search.target
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
OFF = 0.005  # [rad or m] by which a joint may be elsewhere than where it was sent: a tick of an AX-12
AS_NEAR = 1.0  # tolerances by which others may be farther away than the nearest one


def nearest_poses(search: PoseSearch) -> Generator[None, None, tuple[Array, ...]]:
    """Return free positions of joints whose tip is as near to the target as was found, the nearest first.

    They are free, too, if a joint is a little off, so that the arm does not collide where it comes to rest. None is
    farther away than the start, if that is free and within the limits; without any that are free, nothing is returned.
    What is nearer counts in tolerances of the target. It yields while it works, and ends with what it has when it
    `is_late`.
    """
    kinematics, space, target = search.kinematics, search.space, search.target
    free: list[Array] = []
    colliding: list[Array] = []
    first = space.clamped(search.start)
    off = OFF * np.eye(len(first))[kinematics.moves_tip]
    offs = np.vstack((np.zeros(len(first)), off, -off))

    def is_free(values: Array) -> bool:
        return all(map(search.is_free, space.clamped(values + offs)))

    for sample in (first, *map(space.clamped, search.guesses), *search.random(FIRSTS)):
        end = _approached(kinematics, target, sample, bounds_of(space))
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
        free += [first] if search.is_free(first) else []
    ordered = sorted(free, key=excess)
    return tuple(one for one in ordered if excess(one) <= excess(ordered[0]) + AS_NEAR)


def _approached(kinematics: ArmKinematics, target: PoseTarget, first: Array, bounds: tuple[Array, Array]) -> Array:
    """Return where no small step within the limits brings the tip nearer to the target any more."""
    wanted, values, damping = kinematics.placement(target.pose), np.clip(first, *bounds), FIRST_DAMPING
    error, jacobian = _weighed(kinematics, target, wanted, values)
    size = float(error @ error)
    for _ in range(MOST_APPROACH_STEPS):
        step = _approach_step(jacobian, error, damping, values, bounds)
        share = LONGEST / max(float(np.abs(step).max()), LONGEST)
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


def _weighed(kinematics: ArmKinematics, target: PoseTarget, wanted: Any, values: Array) -> tuple[Array, Array]:
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


def searched(search: PoseSearch, posture: Posture | None = None) -> Generator[None, None, PoseSolutions]:
    """Return solutions as `solved` does, those nearest to a posture first if there is one.

    Each free one is brought as near to the posture as its tip stays at the target. It never ends farther from the
    posture than a search without it, since that one's attempts are among its own. If nothing free meets the target and
    that is approximate, the solutions are the nearest ones; the posture does not count then.
    """
    guesses, target = () if posture is None else (posture.guess(search.start),), search.target
    found = yield from solved(replace(search, enough=search.enough + len(guesses), guesses=guesses))
    if not found.free and target.is_approximate:
        near = yield from nearest_poses(replace(search, guesses=(*guesses, *found.colliding)))
        exact = tuple(item for item in near if target.is_met(search.kinematics.tip_pose(item)))  # missed by restarts
        found = replace(found, free=apart(exact or near)[: search.enough], is_approximate=bool(near) and not exact)
    if posture is None or found.is_approximate:
        return found
    free = []
    for array in found.free:
        free.append(slid(search, array, posture))
        yield
    return replace(found, free=apart(nearest_first(search.space, posture, free)))


def nearest_first(space: JointSpace, posture: Posture, solutions: Iterable[Array]) -> tuple[Array, ...]:
    """Return solutions, those nearest to a posture first."""
    return tuple(sorted(solutions, key=lambda values: posture.distance(space, values)))


def apart(solutions: Iterable[Array]) -> tuple[Array, ...]:
    """Return solutions without those that are where another one is: a way that one has not, that has not either."""
    found: list[Array] = []
    for solution in solutions:
        if all(float(np.abs(solution - other).max()) > APART for other in found):
            found.append(solution)
    return tuple(found)


def kept_solutions(
    search: PoseSearch, keep: Keep, first: Array, checker: Checker, posture: Posture | None = None
) -> Generator[None, None, PoseSolutions]:
    """Return solutions as `solved` does, for a target of which only the position counts.

    With a posture, one of the attempts begins there, and the solutions nearest to it come first. What is kept is
    measured from positions `first`, where the whole motion began.
    """
    kinematics, space, target, start = search.kinematics, search.space, search.target, search.start
    frame = kinematics.poses(first)[keep.frame].inverse() if keep.frame else None
    point = frame.apply(target.pose.translation) if frame is not None else target.pose.translation
    half = CLOSER * target.tolerance / math.sqrt(3.0)
    x, y, z = ((value - half, value + half) for value in point)
    kept = KeptTip(kinematics, keep, first, checker)
    there = KeptTip(kinematics, replace(keep, inside=(x, y, z)), first, checker)
    free: list[Array] = []
    colliding: list[Array] = []
    nearest, attempts = (math.inf, math.inf), 0
    guesses = (start,) if posture is None else (start, posture.guess(start))
    for guess in (*map(space.clamped, guesses), *search.random(RESTARTS)):
        attempts += 1
        values = there.projected(guess, space)
        if values is not None and kept.is_kept(values) and target.is_met(kinematics.tip_pose(values)):
            (free if checker.is_free(values) else colliding).append(values)
        elif (alone := kept.projected(guess, space)) is not None:
            nearest = min(nearest, target.error(kinematics.tip_pose(alone)))
        if len(free) >= ENOUGH + len(guesses) - 1:
            break
        yield
    near, not_free = (by_distance(item, start) for item in (free, colliding))
    ordered = near if posture is None else nearest_first(space, posture, near)
    return PoseSolutions(ordered, not_free, nearest, attempts)
