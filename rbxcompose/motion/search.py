"""A search for a path through the positions of joints, by OMPL; none of OMPL's states leaves this module."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from contextlib import closing
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbxcompose.motion.joint_space import JointSpace
from rbxcompose.motion.planner_types import OMPL

Array = NDArray[np.float64]
IsFree = Callable[[Array], bool]
Ompl = Any  # of an extra, without types

SLICE = 2_000  # examined positions, after which a search lets others run
SHORTCUTS = 60  # attempts to shorten a path
RANGE = 0.8  # [rad], the longest step of a tree
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
    simplify: bool = True,
) -> Generator[int, None, Array]:
    """Search a path and shorten it; return its points, of shape (m, n). Yield how many positions were examined.

    It goes on until it has found one: close it to give up. The same arguments give the same path. Straight lines
    between points are examined at least every `resolution` [rad or m] of the joints' Euclidean distance.
    """
    with closing(_Search(space, start, goal, is_free, planner, seed, resolution)) as search:
        while not search.advance():
            yield search.examined
        return search.path(simplify=simplify)


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
        self, space: JointSpace, start: Array, goal: Array, is_free: IsFree, planner: str, seed: int, resolution: float
    ) -> None:
        from ompl import base, geometric, util

        util.setLogLevel(util.LOG_NONE)
        util.RNG.setSeed(1 + seed % SEEDS)  # for all that is made from here on; 0 would be the time
        self._size, self._examiner = len(start), _Examiner(is_free, len(start))
        self._base, self._geometric = base, geometric
        self._space = base.RealVectorStateSpace(self._size)
        self._space.setBounds(self._bounds(space, start, goal))
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

    def _bounds(self, space: JointSpace, start: Array, goal: Array) -> Any:
        """Return the ranges; joints without an end may turn half a turn beyond both ends."""
        bounds = self._base.RealVectorBounds(self._size)
        low, high = np.minimum(start, goal) - math.pi, np.maximum(start, goal) + math.pi
        for index, (least, greatest) in enumerate(zip(space.lower, space.upper, strict=True)):
            bounds.setLow(index, float(least if np.isfinite(least) else low[index]))
            bounds.setHigh(index, float(greatest if np.isfinite(greatest) else high[index]))
        return bounds

    def _state(self, values: Array) -> Any:
        state = self._space.allocState()
        for index, value in enumerate(values.tolist()):
            state[index] = value
        return state
