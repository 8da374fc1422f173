"""From where an arm is to where it should be: searched, shortened, timed, and verified before it is called a plan."""

from __future__ import annotations

from collections.abc import Callable, Generator

import numpy as np
from numpy.typing import NDArray

from rbxcompose.dataclass import dataclass
from rbxcompose.motion.collisions import Checker, told
from rbxcompose.motion.joint_space import JointSpace, interpolated
from rbxcompose.motion.parametrisation import Trajectory, speeds_of, timed
from rbxcompose.motion.reasons import MotionFailure, MotionReason
from rbxcompose.motion.recheck import Rejected, examined
from rbxcompose.motion.search import searched

Array = NDArray[np.float64]

RESOLUTION = 0.02  # [rad] between examined positions of a search
FINE = 0.005  # [rad or m] between examined positions of a trajectory, in each joint
NEAR = 0.02  # [rad or m] by which a start may be outside of its limits: servos measure in ticks
SAME = 1e-4  # [rad or m] between positions that are the same
MOST_PER_SECOND = 50_000  # examined positions; more than any machine examines, and a limit where no time passes
ROUNDS = 6  # of adding points to a path, so that its curve keeps closer to the straight lines that are free


@dataclass(frozen=True, slots=True)
class PlannerSettings:
    """How to plan: at most `time` [s] and `attempts` paths, which follow from the seed."""

    planner: str = "rrt_connect"
    time: float = 5.0
    attempts: int = 5
    seed: int = 1


@dataclass(frozen=True, slots=True)
class MotionRequest:
    """What is asked for: positions of shape (n,), and shares of the greatest speed and acceleration."""

    start: Array
    goal: Array
    speed: float = 1.0
    acceleration: float = 1.0


@dataclass(frozen=True, slots=True)
class MotionPlan:
    """A verified trajectory; None if the arm is where it should be. `waypoints` has the shape (m, n)."""

    trajectory: Trajectory | None
    waypoints: Array
    attempts: int
    examined: int


Planning = Generator[None, None, "MotionPlan | MotionFailure"]


class MotionPlanner:
    """Plans motions of one arm. `now` is a time [s] that passes while it plans, if there is one."""

    def __init__(
        self, space: JointSpace, checker: Checker, settings: PlannerSettings, now: Callable[[], float]
    ) -> None:
        self.space, self.checker, self.settings, self.now = space, checker, settings, now

    def plan(self, request: MotionRequest) -> Planning:
        """Return a plan or why there is none; it yields while it works, so that others may run, and may be closed."""
        run = _Run(self, request)
        failure = run.mistake()
        if failure is not None:
            return failure
        if float(np.max(np.abs(run.goal - run.start))) <= SAME:
            return MotionPlan(None, np.stack((run.start, run.goal)), 0, 0)
        return (yield from run.attempts())


class _Run:
    """One request."""

    def __init__(self, planner: MotionPlanner, request: MotionRequest) -> None:
        self._planner, self._request = planner, request
        self.start = np.asarray(request.start, dtype=float)
        self.goal = np.asarray(request.goal, dtype=float)
        self._began, self._examined = planner.now(), 0

    def mistake(self) -> MotionFailure | None:
        """Return what is wrong with start and goal; a start just outside of its limits is moved to them."""
        space, checker = self._planner.space, self._planner.checker
        for values, outside, hit, tolerance in (
            (self.start, MotionReason.START_OUTSIDE_LIMITS, MotionReason.START_IN_COLLISION, NEAR),
            (self.goal, MotionReason.GOAL_OUTSIDE_LIMITS, MotionReason.GOAL_IN_COLLISION, 0.0),
        ):
            if words := space.outside(values, tolerance):
                return MotionFailure(outside, words)
            inside = space.clamped(values)
            if not checker.is_free(inside):
                return MotionFailure(hit, told(checker.colliding(inside)))
        self.start, self.goal = space.clamped(self.start), space.nearest_turns(self.goal, self.start)
        return None

    def attempts(self) -> Planning:
        """Search and verify with one seed after the other."""
        settings, last = self._planner.settings, MotionFailure(MotionReason.NO_PATH_IN_TIME, "")
        for attempt in range(settings.attempts):
            path = yield from self._path(attempt)
            if path is None:
                break
            found = yield from self._verified(path)
            if isinstance(found, Trajectory):
                return MotionPlan(found, path, attempt + 1, self._examined)
            last = found
        if last.text:
            tried = "1 path was" if attempt == 0 else f"{attempt + (path is not None)} paths were"
            return MotionFailure(last.reason, f"{last.text} ({tried} found)")
        return MotionFailure(
            last.reason, f"{settings.planner} found none in {settings.time:g} s, {self._examined} positions examined"
        )

    def _path(self, attempt: int) -> Generator[None, None, Array | None]:
        """Return a path; None when the time is over. The straight line is tried first."""
        planner, settings = self._planner, self._planner.settings
        if attempt == 0:
            line = np.stack((self.start, self.goal))
            points = interpolated(line, RESOLUTION)
            self._examined += len(points)
            if all(planner.checker.is_free(one) for one in points):
                return line
        search = searched(
            planner.space,
            self.start,
            self.goal,
            planner.checker.is_free,
            planner=settings.planner,
            seed=settings.seed + attempt,
            resolution=RESOLUTION,
        )
        before = self._examined
        while not self._is_late():
            try:
                self._examined = before + next(search)
            except StopIteration as ended:
                found: Array = ended.value
                return found
            yield
        search.close()
        return None

    def _is_late(self) -> bool:
        time = self._planner.settings.time
        return self._planner.now() - self._began >= time or self._examined >= time * MOST_PER_SECOND

    def _verified(self, path: Array) -> Generator[None, None, Trajectory | MotionFailure]:
        """Return the trajectory along a path, once its curves are free and within all limits."""
        planner, request = self._planner, self._request
        limits = speeds_of(planner.space, request.speed, request.acceleration)
        text = ""
        for _ in range(ROUNDS):
            made = timed(path, *limits)
            if isinstance(made, str):
                return MotionFailure(MotionReason.NO_TIMING, made)
            rejected: Rejected | None = yield from self._examine(made)
            if rejected is None:
                return made
            path, text = _with_middles(path), rejected.text
        return MotionFailure(MotionReason.PATH_IN_COLLISION, text)

    def _examine(self, made: Trajectory) -> Generator[None, None, Rejected | None]:
        points = made.dense(FINE)
        self._examined += len(points)
        examination = examined(points, self._planner.space, self._planner.checker)
        while True:
            try:
                next(examination)
            except StopIteration as ended:
                found: Rejected | None = ended.value
                return found
            yield


def _with_middles(path: Array) -> Array:
    """Return a path with a point in the middle of each of its lines."""
    found = np.empty((2 * len(path) - 1, path.shape[1]))
    found[::2], found[1::2] = path, (path[:-1] + path[1:]) / 2
    return found
