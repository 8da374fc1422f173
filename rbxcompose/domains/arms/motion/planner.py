"""From where an arm is to where it should be: searched, shortened, timed, and verified before it moves."""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Iterator
from functools import partial
from typing import TYPE_CHECKING, TypeGuard, TypeVar

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.arms.motion.collisions import Checker, pairs_shown
from rbxcompose.domains.arms.motion.groups import JointSpace, interpolated
from rbxcompose.domains.arms.motion.parametrisation import Trajectory, curve, jerks_of, speeds_of, timed
from rbxcompose.domains.arms.motion.path_constraints import KeptTip
from rbxcompose.domains.arms.motion.search import MARGIN, kept_path, searched
from rbxcompose.domains.arms.reasons import MotionFailure, MotionReason
from rbxcompose.domains.arms.section_models import AUTOMATIC, FAST, ompl_planner
from rbxcompose.domains.body.link_pairs import LinkPair
from rbxcompose.domains.servos.trajectory import ROUNDING

if TYPE_CHECKING:  # which imports what compiles
    from rbxcompose.domains.arms.motion.sphere_checker import SphereChecker

T = TypeVar("T")
SLICE = 1_000  # examined positions, after which an examination lets others run


@dataclass(frozen=True, slots=True)
class Rejected:
    """What is wrong with a motion, and how far along it, from 0 to 1."""

    is_collision: bool
    text: str
    share: float


def examined(points: Array, space: JointSpace, checker: Checker) -> Generator[None, None, Rejected | None]:
    """Examine points of shape (m, n); return what is wrong with the first bad one."""
    beyond = np.any((points < space.lower - ROUNDING) | (points > space.upper + ROUNDING), axis=1)
    beyond |= ~np.all(np.isfinite(points), axis=1)
    inside = points[: np.argmax(beyond)] if np.any(beyond) else points
    for begin in range(0, len(inside), SLICE):
        bad = first_bad(checker, inside[begin : begin + SLICE])
        if bad is not None:
            return Rejected(True, pairs_shown(checker.colliding(inside[begin + bad])), (begin + bad) / len(points))
        yield
    if len(inside) < len(points):
        return Rejected(False, space.outside(points[len(inside)], ROUNDING), len(inside) / len(points))
    return None


def can_search(checker: Checker) -> TypeGuard[SphereChecker]:
    """Return whether a checker examines many positions at once, and searches ways by itself."""
    return hasattr(checker, "ways")


def first_bad(checker: Checker, points: Array) -> int | None:
    """Return the first of some points, of shape (m, n), where something collides; None if there is none."""
    if can_search(checker):
        return checker.first_bad(points)
    return next((index for index, values in enumerate(points) if not checker.is_free(values)), None)


RESOLUTION = 0.02  # [rad] between examined positions of a search
FIRST_RESOLUTION = 0.03  # [rad] of the first by OMPL, for which each takes long: what is between is examined later
FINE = 0.0015  # [rad or m] between examined positions of a trajectory, in each joint
NEAR = 0.02  # [rad or m] by which a start may be outside of its limits: servos measure in ticks
COARSE = 0.05  # [rad or m] between positions of a curve that is looked at before it is timed
SAME = 1e-4  # [rad or m] between positions that are the same
MOST_PER_SECOND = 50_000  # examined positions; more than any machine examines, and a limit where no time passes
KEPT_SLICE = 200  # positions examined for what is to be kept, after which others may run
FAST_TRIES = 3  # paths of the fast search that may collide on the shapes themselves
FAST_SHARE = 0.25  # of the time, after which the fast search is given up
NEAR_SHARE = 0.4  # of the time, after which OMPL no longer searches only near start and goal
LINE = "a straight line"
ROUNDS = 6  # of adding points to a path, so that its curve keeps closer to the straight lines that are free


@dataclass(frozen=True, slots=True)
class PlannerSettings:
    """How to plan: at most `time` [s] and `attempts` paths, which follow from the seed."""

    planner: str = AUTOMATIC
    time: float = 5.0
    attempts: int = 5
    seed: int = 1
    simplify: bool = True


@dataclass(frozen=True, slots=True)
class MotionRequest:
    """What is asked for: positions of shape (n,), and shares of the greatest speed and acceleration."""

    start: Array
    goal: Array
    speed: float = 1.0
    acceleration: float = 1.0
    space: JointSpace | None = None
    """Narrower limits of joints than those of the arm, if there are any."""
    kept: KeptTip | None = None
    """What the tip keeps on the whole way."""


@dataclass(frozen=True, slots=True)
class MotionPlan:
    """A verified trajectory; None if the arm is where it should be. `waypoints` has the shape (m, n)."""

    trajectory: Trajectory | None
    waypoints: Array
    attempts: int
    examined: int
    share: float = 1.0
    """How much of the way that was asked for it is."""
    found_by: str = ""
    """What found the way: a straight line, or the name of a planner."""
    fast_failed: str = ""
    """Why the fast search found none, if it was tried in vain."""


Planning = Generator[None, None, "MotionPlan | MotionFailure"]


class MotionPlanner:
    """Plans motions of one arm. `now` is a time [s] that passes while it plans, if there is one."""

    def __init__(
        self,
        space: JointSpace,
        checker: Checker,
        settings: PlannerSettings,
        now: Callable[[], float],
        unlikely: Collection[LinkPair] = (),
    ) -> None:
        """Build it; `unlikely` are pairs that the first search may leave out: the examination has them all."""
        self.space, self.checker, self.settings, self.now = space, checker, settings, now
        self.unlikely = unlikely

    def plan(self, request: MotionRequest) -> Planning:
        """Return a plan or why there is none; it yields while it works, so that others may run, and may be closed."""
        run = _Run(self, request)
        failure = run.mistake()
        if failure is not None:
            return failure
        if float(np.max(np.abs(run.goal - run.start))) <= SAME:
            return MotionPlan(None, np.stack((run.start, run.goal)), 0, 0)
        return (yield from run.attempts())

    def along(self, path: Array, request: MotionRequest) -> Planning:
        """Return a plan along the points of a path, of shape (m, n), or why it cannot be; it yields as `plan` does."""
        run = _Run(self, request)
        failure = run.mistake()
        return failure if failure is not None else (yield from run.only(path))


class _Run:
    """One request."""

    def __init__(self, planner: MotionPlanner, request: MotionRequest) -> None:
        self._planner, self._request = planner, request
        self.start = np.asarray(request.start, dtype=float)
        self.goal = np.asarray(request.goal, dtype=float)
        self._began, self._examined = planner.now(), 0
        self._space, self._kept = request.space or planner.space, request.kept
        self._found_by = self._fast_failed = ""
        self._is_fast_hopeless = False

    def mistake(self) -> MotionFailure | None:
        """Return what is wrong with start and goal; a start just outside of its limits is moved to them."""
        space, checker = self._space, self._planner.checker
        ends = space.clamped(np.stack((self.start, self.goal)))
        is_inside = not space.outside(self.start, NEAR) and not space.outside(self.goal)
        if not is_inside or first_bad(checker, ends) is not None:
            failure = mistake_in_start(space, checker, self.start) or _unfit(
                space, checker, self.goal, (MotionReason.GOAL_OUTSIDE_LIMITS, MotionReason.GOAL_IN_COLLISION), 0.0
            )
            if failure is not None:
                return failure
        self.start, self.goal = space.clamped(self.start), space.nearest_turns(self.goal, self.start)
        for word, values in (("start", self.start), ("goal", self.goal)):
            if self._kept is not None and not self._kept.is_kept(values):
                words = self._kept.beyond(values) or "the tip is at the edge of what it is to keep"
                return MotionFailure(MotionReason.NOT_KEPT, f"at the {word}, {words}")
        return None

    def _fitness(self, attempt: int) -> Callable[[Array], bool]:
        """Return what decides whether positions may be on a path; the first search leaves out unlikely pairs."""
        planner, kept = self._planner, self._kept
        checker = planner.checker if attempt or not planner.unlikely else planner.checker.without(planner.unlikely)
        return checker.is_free if kept is None else lambda values: kept.is_kept(values) and checker.is_free(values)

    def only(self, path: Array) -> Planning:
        """Verify one path."""
        found = yield from self._verified(np.concatenate((self.start[None], path[1:])))
        return MotionPlan(found, path, 1, self._examined) if isinstance(found, Trajectory) else found

    def attempts(self) -> Planning:
        """Search and verify one path after the other."""
        last, paths = MotionFailure(MotionReason.NO_PATH_IN_TIME, ""), 0
        for source in self._sources():
            path = yield from source
            if path is None:
                continue
            paths += 1
            found = yield from self._verified(path)
            if isinstance(found, Trajectory):
                tried = (self._found_by, self._fast_failed)
                return MotionPlan(found, path, paths, self._examined, 1.0, *tried)
            if self._found_by == FAST:
                self._fast_failed = found.text
            last = found
        settings = self._planner.settings
        beside = f"; fast: {self._fast_failed}" if self._fast_failed else ""
        if last.text:
            tried_ = "1 path was" if paths == 1 else f"{paths} paths were"
            return MotionFailure(last.reason, f"{last.text} ({tried_} found{beside})")
        words = f"{ompl_planner(settings.planner)} found none in {settings.time:g} s"
        return MotionFailure(last.reason, f"{words}, {self._examined} positions examined{beside}")

    def _sources(self) -> Iterator[Generator[None, None, Array | None]]:
        """Yield what may find a path, while there is time: the straight line, the fast search, then OMPL by seeds."""
        settings, checker = self._planner.settings, self._planner.checker
        yield self._line()
        first = int(self._found_by == LINE)
        if can_search(checker) and self._kept is None:
            for seed in range(settings.seed, settings.seed + FAST_TRIES):
                if self._is_late(FAST_SHARE) or self._is_fast_hopeless:
                    break
                yield self._fast(checker, seed)
        for attempt in range(first, settings.attempts):
            if self._is_late():
                break
            yield self._slow(attempt)

    def _line(self) -> Generator[None, None, Array | None]:
        """Return the straight line, None if it is not free."""
        line = np.stack((self.start, self.goal))
        points, checker = interpolated(line, RESOLUTION), self._planner.checker
        self._examined += len(points)
        if can_search(checker) and self._kept is None:
            is_free = checker.first_bad(points) is None
        else:
            is_free = all(map(self._fitness(0), points))
        self._found_by = LINE if is_free else ""
        yield from ()
        return line if is_free else None

    def _fast(self, checker: SphereChecker, seed: int) -> Generator[None, None, Array | None]:
        """Return a path on spheres, None if there is none."""
        one, self._found_by = self._planner.settings, FAST
        found = yield from self._in_time(
            checker.ways(self._space, self.start, self.goal, seed=seed, resolution=RESOLUTION, simplify=one.simplify),
            FAST_SHARE,
        )
        if found is not None and not isinstance(found, str):
            return found
        self._is_fast_hopeless = found is not None
        self._fast_failed = found or f"none in {one.time * FAST_SHARE:g} s"
        return None

    def _slow(self, attempt: int) -> Generator[None, None, Array | None]:
        """Return a path by OMPL, near start and goal or else anywhere; None when the time is over."""
        settings = self._planner.settings
        self._found_by = ompl_planner(settings.planner)
        whole = ((np.inf, 1.0),)  # also of what is kept on the way: to begin again there would only lose time
        for margin, share in whole if self._kept is not None else ((MARGIN, NEAR_SHARE), *whole):
            found = yield from self._in_time(self._search(attempt, margin), share)
            if found is not None:
                return found
        return None

    def _in_time(self, search: Generator[int, None, T], share: float) -> Generator[None, None, T | None]:
        """Return what a search finds, None if that takes longer than a share of the time."""
        before = self._examined
        while not self._is_late(share):
            try:
                self._examined = before + next(search)
            except StopIteration as ended:
                found: T = ended.value
                return found
            yield
        search.close()
        return None

    def _search(self, attempt: int, margin: float) -> Generator[int, None, Array]:
        """Return the search: by OMPL, whose constrained spaces find less (see `search`), or by ours."""
        space, kept, start, goal = self._space, self._kept, self.start, self.goal
        settings, is_fit = self._planner.settings, self._fitness(attempt)
        seed = settings.seed + attempt
        if kept is not None:
            project = partial(kept.projected, space=space)
            return kept_path(space, start, goal, is_fit, project, seed=seed, resolution=RESOLUTION)
        return searched(
            space,
            start,
            goal,
            is_fit,
            planner=ompl_planner(settings.planner),
            seed=seed,
            resolution=RESOLUTION if attempt else FIRST_RESOLUTION,
            margin=margin,
            simplify=settings.simplify,
        )

    def _is_late(self, share: float = 1.0) -> bool:
        """Return whether a share of the time is over."""
        time = self._planner.settings.time * share
        return self._planner.now() - self._began >= time or self._examined >= time * MOST_PER_SECOND

    def _verified(self, path: Array) -> Generator[None, None, Trajectory | MotionFailure]:
        """Return the trajectory along a path, once its curves are free and within all limits."""
        planner, request = self._planner, self._request
        limits = speeds_of(planner.space, request.speed, request.acceleration)
        last = Rejected(True, "", 0.0)
        for _ in range(ROUNDS):
            # A look at a curve costs a tenth of its timing, which follows where nothing is seen; lines take no time.
            look = curve(path, COARSE) if len(path) > 2 else path[:0]
            rejected = yield from examined(look, self._space, planner.checker)
            if rejected is None:
                made = timed(path, *limits, jerks_of(planner.space))
                if isinstance(made, str):
                    return MotionFailure(MotionReason.NO_TIMING, made)
                rejected = yield from self._examine(made)
                if rejected is None:
                    return made
            path, last = _with_middles(path), rejected
        reason = MotionReason.PATH_IN_COLLISION if last.is_collision or self._kept is None else MotionReason.NOT_KEPT
        return MotionFailure(reason, last.text)

    def _examine(self, made: Trajectory) -> Generator[None, None, Rejected | None]:
        points = made.dense(FINE)
        self._examined += len(points)
        rejected = yield from examined(points, self._space, self._planner.checker)
        if rejected is not None or self._kept is None:
            return rejected
        for index, point in enumerate(points):
            if words := self._kept.beyond(point):
                return Rejected(False, words, index / len(points))
            if index % KEPT_SLICE == KEPT_SLICE - 1:
                yield
        return None


def mistake_in_start(space: JointSpace, checker: Checker, start: Array) -> MotionFailure | None:
    """Return why no motion begins at these positions, if none does."""
    return _unfit(space, checker, start, (MotionReason.START_OUTSIDE_LIMITS, MotionReason.START_IN_COLLISION), NEAR)


def _unfit(
    space: JointSpace, checker: Checker, values: Array, reasons: tuple[MotionReason, MotionReason], tolerance: float
) -> MotionFailure | None:
    if words := space.outside(values, tolerance):
        return MotionFailure(reasons[0], words)
    inside = space.clamped(values)
    return None if checker.is_free(inside) else MotionFailure(reasons[1], pairs_shown(checker.colliding(inside)))


def _with_middles(path: Array) -> Array:
    """Return a path with a point in the middle of each of its lines."""
    found = np.empty((2 * len(path) - 1, path.shape[1]))
    found[::2], found[1::2] = path, (path[:-1] + path[1:]) / 2
    return found
