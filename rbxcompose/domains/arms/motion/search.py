"""A search for a path through the positions of joints, by OMPL, also one that keeps constraints."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from contextlib import closing
from typing import Any

import numpy as np

from rbxcompose.domains.arms.motion.groups import Array, JointSpace
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
