"""What an arm achieves: how fast its kinematics and its plans are, how many succeed, and whether they are free."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Generator, Iterable
from itertools import islice, pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from rbxcompose.dataclass import dataclass
from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.inverse_kinematics import PoseTarget, SolverSettings, solved
from rbxcompose.motion.joint_space import JointSpace
from rbxcompose.motion.parametrisation import Trajectory
from rbxcompose.motion.planner import MotionPlan, MotionPlanner, MotionRequest

Array = NDArray[np.float64]
Clock = Callable[[], float]
T = TypeVar("T")
CALLS, TURNS = 100, 15  # of something that takes microseconds
AGAIN = 0.005  # [rad or m] between positions that are examined once more
SHARE = 100  # random positions for each that is wanted and collides with nothing


@dataclass(frozen=True, slots=True)
class Tries:
    """How many of `count` tries succeeded, how long each of all took [s], and what is known of those that succeeded."""

    count: int
    solved: int
    times: tuple[float, ...]
    lengths: tuple[float, ...] = ()
    """Of ways [rad], as the Euclidean distance of joints."""
    colliding: int = 0
    """Of the ways, by a second examination."""
    failures: tuple[str, ...] = ()
    """Why tries did not succeed."""

    @property
    def median(self) -> float:
        """Return the median time [s]; of nothing, it is not a number."""
        return statistics.median(self.times) if self.times else math.nan

    @property
    def p95(self) -> float:
        """Return the time that 95 of 100 stay below [s]."""
        ordered = sorted(self.times)
        return ordered[min(len(ordered) - 1, int(0.95 * len(ordered)))] if ordered else math.nan

    @property
    def length(self) -> float:
        """Return the median length of ways [rad]."""
        return statistics.median(self.lengths) if self.lengths else math.nan

    def with_(self, other: Tries) -> Tries:
        """Return these tries and others."""
        return Tries(
            self.count + other.count,
            self.solved + other.solved,
            self.times + other.times,
            self.lengths + other.lengths,
            self.colliding + other.colliding,
            self.failures + other.failures,
        )


NO_TRIES = Tries(0, 0, ())


def call_time(job: Callable[[Array], object], inputs: Array, clock: Clock) -> float:
    """Return the median time of a call [s], for inputs of shape (m, n)."""
    job(inputs[0])
    found = []
    for _ in range(TURNS):
        began = clock()
        for index in range(CALLS):
            job(inputs[index % len(inputs)])
        found.append((clock() - began) / CALLS)
    return statistics.median(found)


def inverse_tries(
    kinematics: ArmKinematics, space: JointSpace, settings: SolverSettings, start: Array, goals: Array, clock: Clock
) -> Tries:
    """Solve for the poses of the tip at positions of shape (m, n), each from `start`; collisions are not looked at."""
    times, found = [], 0
    for seed, goal in enumerate(goals):
        target = PoseTarget(
            kinematics.tip_pose(goal), tolerance=settings.tolerance, angle_tolerance=settings.angle_tolerance
        )
        began = clock()
        search = solved(
            kinematics, space, target, start, lambda _: True, seed=seed, restarts=settings.restarts, enough=1
        )
        found += bool(ended(search).free)
        times.append(clock() - began)
    return Tries(len(goals), found, tuple(times))


def motion_tries(
    planner: MotionPlanner,
    pairs: Iterable[tuple[Array, Array]],
    is_free_along: Callable[[Trajectory, float], bool],
    clock: Clock,
) -> Tries:
    """Plan from each start to its goal, timed and examined; what comes out is examined once more."""
    total = NO_TRIES
    for start, goal in pairs:
        began = clock()
        found = ended(planner.plan(MotionRequest(start, goal)))
        took = clock() - began
        if not isinstance(found, MotionPlan):
            total = total.with_(Tries(1, 0, (took,), failures=(f"{found.reason}: {found.text}",)))
            continue
        length = float(np.linalg.norm(np.diff(found.waypoints, axis=0), axis=1).sum())
        is_free = found.trajectory is None or is_free_along(found.trajectory, AGAIN)
        total = total.with_(Tries(1, 1, (took,), (length,), int(not is_free)))
    return total


def free_pairs(planner: MotionPlanner, count: int, seed: int) -> list[tuple[Array, Array]]:
    """Return at most so many pairs of random positions that collide with nothing, each of shape (n,)."""
    samples = planner.space.samples(SHARE * (count + 1), seed)
    return list(pairwise(islice(filter(planner.checker.is_free, samples), count + 1)))


def ended(work: Generator[object, None, T]) -> T:
    """Return what a generator returns."""
    while True:
        try:
            next(work)
        except StopIteration as end:
            result: T = end.value
            return result
