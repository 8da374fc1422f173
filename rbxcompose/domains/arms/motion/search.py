"""A search for a path through the positions of joints: by OMPL, and by trees of our own if something is kept on it.

Those are trees from both ends, whose steps are led back to what is kept. Source: Berenson, Srinivasa, Ferguson,
Kuffner, Manipulation Planning on Constraint Manifolds (2009), without its goal regions. Straight lines between the
points of the path keep it, too, as finely as they are examined.

Measured with 20, 10 and 5 degrees of tilt, on an arm of six joints and one of seven beside a box: within 5 s this found
35 of 36 ways, RRT-Connect that rejects what is not kept 32, OMPL's projected state space 20 within 4 s.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from contextlib import closing
from typing import Any

from rbxcompose.base.arrays import Array, np
from rbxcompose.domains.arms.motion.groups import JointSpace, interpolated
from rbxcompose.domains.arms.section_models import OMPL

IsFree = Callable[[Array], bool]

SLICE = 2_000  # examined positions, after which a search lets others run
SHORTCUTS = 60  # attempts to shorten a path
RANGE = 0.8  # [rad], the longest step of a tree
MARGIN = 0.8  # [rad or m] around start and goal, within which most ways are, and the short ones
SEEDS = 2**31 - 1  # the largest seed that OMPL takes


def searched(
    space: JointSpace,
    start: Array,
    goal: Array,
    is_free: IsFree,
    *,
    planner: str,
    seed: int,
    resolution: float,
    margin: float = math.inf,
    simplify: bool = True,
) -> Generator[int, None, Array]:
    """Search a path and shorten it; return its points, of shape (m, n). Yield how many positions were examined.

    It goes on until it has found one: close it to give up. The same arguments give the same path. Straight lines
    between points are examined at least every `resolution` [rad or m] of the joints' Euclidean distance. Each joint
    stays within `margin` [rad or m] of its start and goal, and of what is between them.
    """
    with closing(_Search(space, start, goal, is_free, planner, seed, resolution, margin)) as search:
        while not search.advance():
            yield search.examined
        return search.path(simplify=simplify)


def sample_range(space: JointSpace, start: Array, goal: Array, margin: float = math.inf) -> tuple[Array, Array]:
    """Return between which positions a search is, at most `margin` [rad or m] beyond both ends, each of shape (n,).

    Joints without an end may turn half a turn beyond them.
    """
    first, last, lower, upper = np.minimum(start, goal), np.maximum(start, goal), space.lower, space.upper
    low = np.where(np.isfinite(lower), lower, first - math.pi)
    high = np.where(np.isfinite(upper), upper, last + math.pi)
    return np.maximum(low, first - margin), np.minimum(high, last + margin)


class _Examiner:
    """What OMPL asks. It knows nothing of OMPL's objects, which would else keep each other alive."""

    def __init__(self, is_free: IsFree, size: int) -> None:
        self.count, self._is_free, self._size = 0, is_free, size

    def is_valid(self, state: Any) -> bool:
        self.count += 1
        return self._is_free(np.array([state[index] for index in range(self._size)]))


class _Search:
    """All objects of OMPL of one search. They refer to each other without owning each other, so they end together."""

    def __init__(
        self,
        space: JointSpace,
        start: Array,
        goal: Array,
        is_free: IsFree,
        planner: str,
        seed: int,
        resolution: float,
        margin: float,
    ) -> None:
        from ompl import base, geometric, util

        util.setLogLevel(util.LOG_NONE)
        util.RNG.setSeed(1 + seed % SEEDS)  # for all that is made from here on; 0 would be the time
        self._size, self._examiner = len(start), _Examiner(is_free, len(start))
        self._base, self._geometric = base, geometric
        self._space = base.RealVectorStateSpace(self._size)
        self._space.setBounds(self._bounds(*sample_range(space, start, goal, margin)))
        self._information = base.SpaceInformation(self._space)
        self._information.setStateValidityChecker(self._examiner.is_valid)
        self._information.setStateValidityCheckingResolution(resolution / self._space.getMaximumExtent())
        self._information.setup()
        self._problem = base.ProblemDefinition(self._information)
        ends = [self._state(start), self._state(goal)]
        self._problem.setStartAndGoalStates(*ends)  # which copies them
        self._planner = getattr(geometric, OMPL[planner])(self._information)
        if hasattr(self._planner, "setRange"):
            self._planner.setRange(RANGE)
        self._planner.setProblemDefinition(self._problem)
        self._planner.setup()

    @property
    def examined(self) -> int:
        """Return how many positions were examined."""
        return self._examiner.count

    def advance(self) -> bool:
        """Search for a while; return whether there is a path."""
        examiner, until = self._examiner, self.examined + SLICE
        self._planner.solve(self._base.PlannerTerminationCondition(lambda: examiner.count >= until))
        return bool(self._problem.hasExactSolution())

    def path(self, *, simplify: bool) -> Array:
        """Return the path, with shortcuts if it is to be simplified."""
        path, simplifier = self._problem.getSolutionPath(), self._geometric.PathSimplifier(self._information)
        if simplify:
            simplifier.reduceVertices(path)
            simplifier.partialShortcutPath(path, SHORTCUTS, SHORTCUTS)
            simplifier.collapseCloseVertices(path)
        states = (path.getState(index) for index in range(path.getStateCount()))
        return np.array([[state[index] for index in range(self._size)] for state in states])

    def close(self) -> None:
        """Let go of everything, in the order in which it refers to each other."""
        for name in ("_planner", "_problem", "_information", "_space"):
            if hasattr(self, name):
                delattr(self, name)

    def _bounds(self, low: Array, high: Array) -> Any:
        bounds = self._base.RealVectorBounds(self._size)
        for index, (least, greatest) in enumerate(zip(low.tolist(), high.tolist(), strict=True)):
            bounds.setLow(index, least)
            bounds.setHigh(index, greatest)
        return bounds

    def _state(self, values: Array) -> Any:
        state = self._space.allocState()
        for index, value in enumerate(values.tolist()):
            state[index] = value
        return state


Projected = Callable[[Array], "Array | None"]

STEP, LEAST = 0.15, 0.02  # [rad] between points of a tree, and towards a sample below which an extension ends
WALKS = 4  # each of so many attempts to shorten a path may be no straight line


class _Tree:
    """Points that are connected with the first one."""

    def __init__(self, root: Array) -> None:
        self._points, self._parents, self.size = np.empty((256, len(root))), [-1], 1
        self._points[0] = root

    def __getitem__(self, index: int) -> Array:
        found: Array = self._points[index]
        return found

    def add(self, point: Array, parent: int) -> int:
        if self.size == len(self._points):
            self._points = np.concatenate((self._points, np.empty_like(self._points)))
        self._points[self.size] = point
        self._parents.append(parent)
        self.size += 1
        return self.size - 1

    def nearest(self, point: Array) -> int:
        return int(np.argmin(np.sum((self._points[: self.size] - point) ** 2, axis=1)))

    def branch(self, index: int) -> list[Array]:
        found = []
        while index >= 0:
            found.append(self._points[index])
            index = self._parents[index]
        return found


def kept_path(
    space: JointSpace, start: Array, goal: Array, is_fit: IsFree, projected: Projected, *, seed: int, resolution: float
) -> Generator[int, None, Array]:
    """Search a path and shorten it; return its points, of shape (m, n). Yield how many positions were examined.

    `is_fit` is whether positions are free and keep what is to be kept, `projected` finds those nearby that keep it.
    It goes on until it has found one: close it to give up. The same arguments give the same path.
    """
    search = _KeptSearch(space, is_fit, projected, seed, resolution)
    trees = [_Tree(start), _Tree(goal)]
    while True:
        sample = search.sample()
        for _ in range(2):
            reached = search.extended(trees[0], sample)
            yield search.examined
            met = search.extended(trees[1], trees[0][reached])
            yield search.examined
            if np.max(np.abs(trees[1][met] - trees[0][reached])) < 1e-9:
                one, other = trees[0].branch(reached)[::-1], trees[1].branch(met)
                path = np.stack([*one, *other[1:]])
                return search.shortened(path[::-1] if np.array_equal(path[0], goal) else path)
            trees.reverse()


class _KeptSearch:
    """What extends trees."""

    def __init__(self, space: JointSpace, is_fit: IsFree, projected: Projected, seed: int, resolution: float) -> None:
        self.examined = 0
        self._space, self._is_fit, self._projected, self._resolution = space, is_fit, projected, resolution
        self._random = np.random.default_rng(seed)

    def sample(self) -> Array:
        found: Array = self._space.samples(1, int(self._random.integers(2**31)))[0]
        return found

    def extended(self, tree: _Tree, aim: Array) -> int:
        """Grow a tree towards positions until something is in the way; return the last point."""
        here = tree.nearest(aim)
        while True:
            away = aim - tree[here]
            distance = float(np.linalg.norm(away))
            if distance < 1e-9:
                return here
            there = aim if distance <= STEP else tree[here] + away * (STEP / distance)
            self.examined += 1
            found = there if distance <= STEP and self._is_fit(there) else self._projected(there)
            if found is None or (float(np.linalg.norm(aim - found)) > distance - LEAST / 2 and found is not aim):
                return here
            if np.linalg.norm(found - tree[here]) > 2 * STEP or not self._is_line_fit(tree[here], found):
                return here
            here = tree.add(found, here)

    def shortened(self, path: Array) -> Array:
        """Return a path with shortcuts between random points of it, if a tree leads from one to the other."""
        for number in range(SHORTCUTS):
            if len(path) < 3:
                break
            first, last = np.sort(self._random.choice(len(path), 2, replace=False)).tolist()
            is_far = last - first > 1
            middle = self._between(path[first], path[last], walks=number % WALKS == 0) if is_far else None
            if middle is not None and _length(middle) < _length(path[first : last + 1]) - LEAST:
                path = np.concatenate((path[:first], middle, path[last + 1 :]))
        return path

    def _between(self, first: Array, last: Array, *, walks: bool) -> Array | None:
        if self._is_line_fit(first, last):
            return np.stack((first, last))
        if not walks:
            return None
        tree = _Tree(first)
        end = self.extended(tree, last)
        return np.stack(tree.branch(end)[::-1]) if np.max(np.abs(tree[end] - last)) < 1e-9 else None

    def _is_line_fit(self, first: Array, last: Array) -> bool:
        points = interpolated((first, last), self._resolution)[1:]
        self.examined += len(points)
        return all(self._is_fit(point) for point in points)


def _length(path: Array) -> float:
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
