"""Positions of joints that bring the tip of an arm to a pose.

Damped least squares (Buss, Introduction to Inverse Kinematics with Jacobian Transpose, Pseudoinverse and Damped Least
Squares Methods, 2004), from the present positions and then from random ones. What converges is verified by the
kinematics of the body, which know nothing of the Jacobian.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from typing import Any

import numpy as np

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3, angle_between
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.groups import Array, JointSpace

LEAST_DAMPING, DAMPING = 1e-6, 1e-2  # the second one times the square of the error
LONGEST = 1.0  # [rad or m] that a joint moves in one iteration, at most
PATIENCE, PROGRESS = 4, 0.8  # iterations without the error's square shrinking to this share, which end a descent


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
            random = space.samples(search.restarts, search.seed)
            firsts = np.concatenate((*(space.clamped(guess)[None] for guess in search.guesses), random))
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
