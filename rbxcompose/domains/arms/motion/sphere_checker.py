"""Examines positions in compiled code first, and by coal the pairs of shapes whose spheres are near to each other.

**Why that is as safe as coal alone.** Coal examines every pair of shapes whose boxes along the axes overlap, and leaves
out the others, since a shape is within its box. Here spheres, and hulls in them, take the place of boxes: a shape is
within these by arithmetic (`sphere_trees`), so shapes whose spheres are apart, or whose hulls have a plane between them
(`compiled_convex`), are apart. All positions are examined, on all pairs; every pair that is called near is judged by
coal, on the shapes themselves. Tests compare both on many positions.
What spheres alone say decides only where the fast search goes: the last examination never relies on it.
"""

from __future__ import annotations

from collections.abc import Collection, Generator, Mapping

import numpy as np

from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion.collisions import MeshChecker
from rbxcompose.domains.arms.motion.compiled_collisions import CompiledModel, near_pairs, workspace
from rbxcompose.domains.arms.motion.fast_search import compile_search, fast_path
from rbxcompose.domains.arms.motion.groups import Array, JointSpace
from rbxcompose.domains.arms.motion.sphere_model import Trees, compiled_model
from rbxcompose.domains.body.link_pairs import LinkPair
from rbxcompose.domains.body.model import Geometry

ROOM = 4_096  # near pairs of one call, at least
SAMPLES, SEED = 64, 1
"""Positions at which it is seen how well spheres distinguish pairs."""
BLURRED = 0.1
"""A pair whose spheres are near in a greater share of positions, most of them free, is left out of the fast search."""


class SphereChecker:
    """Gives the same answers as a `MeshChecker`, faster, and searches ways. One thread at a time may use it."""

    def __init__(self, mesh: MeshChecker, trees: Trees) -> None:
        """Build it; `trees` are spheres of shapes that were fitted before, and get those of new ones."""
        self.mesh, self._trees = mesh, trees
        self._clear: CompiledModel | None = None
        self._positions: Mapping[str, float] | None = None  # nothing is made before it is used: scenes change often

    def is_free(self, values: Array) -> bool:
        """Return whether nothing collides at positions of shape (n,)."""
        return self.mesh.is_free(values)  # which is as fast for a single one

    def colliding(self, values: Array) -> list[LinkPair]:
        """Return all pairs that collide."""
        return self.mesh.colliding(values)

    def without(self, pairs: Collection[LinkPair]) -> MeshChecker:
        """Return a checker of the same shapes that does not watch some pairs."""
        return self.mesh.without(pairs)

    def in_the_way(self, values: Array, shape: Geometry, at: Transform3, ignored: Collection[str]) -> list[str]:
        """Return the links and objects but those `ignored` that a shape is within."""
        return self.mesh.in_the_way(values, shape, at, ignored)

    def first_bad(self, points: Array) -> int | None:
        """Return the first of some positions, of shape (m, n), where something collides; None if there is none."""
        self._refresh()
        points, begin = np.ascontiguousarray(points), 0  # another layout would be compiled anew
        while begin < len(points):
            if not (count := near_pairs(self._model, points[begin:], self._found, self._work)):
                return None
            near = self._found[:count]
            whole = len(points) - begin if count < len(self._found) else int(near[-1, 0])
            indices, starts = np.unique(near[:, 0], return_index=True)
            for index, some in zip(indices.tolist(), np.split(near[:, 1], starts[1:]), strict=True):
                if index < whole and self.mesh.collides(points[begin + index], some.tolist()):
                    return int(begin + index)
            begin += whole
        return None

    def prepare(self, space: JointSpace) -> None:
        """Compile what is not in the caches, and look at what the body has without objects."""
        self.first_bad(np.clip(0.0, space.lower, space.upper)[None])
        compile_search(self._model, self._work, len(space.joints))

    def ways(
        self, space: JointSpace, start: Array, goal: Array, *, seed: int, resolution: float, simplify: bool
    ) -> Generator[int, None, Array | str]:
        """Search a way as `fast_path` does."""
        self._refresh()
        if self._clear is None:
            self._clear = self._without_blurred(space)
        return fast_path(
            self._clear,
            workspace(self._clear),
            space,
            (start, goal),
            seed=seed,
            resolution=resolution,
            simplify=simplify,
        )

    def _refresh(self) -> None:
        """Take over where the other joints of the body are."""
        positions = self.mesh.kinematics.positions
        if positions is not self._positions and positions != self._positions:
            self._clear, self._model = None, compiled_model(self.mesh, self._trees)
            self._work = workspace(self._model)
            self._found = np.empty((max(ROOM, len(self._model.firsts) + 1), 2), dtype=np.int64)  # those of a point fit
        self._positions = positions

    def _without_blurred(self, space: JointSpace) -> CompiledModel:
        points, model = space.samples(SAMPLES, SEED), self._model
        near = np.empty((SAMPLES * max(1, len(model.firsts)), 2), dtype=np.int64)
        near = near[: near_pairs(model, points, near, self._work)]
        pairs, counts = np.unique(near[:, 1], return_counts=True)
        blurred = [
            pair
            for pair in pairs[counts > BLURRED * SAMPLES].tolist()
            if np.mean([self.mesh.collides(points[at], [pair]) for at in near[near[:, 1] == pair, 0]]) < 0.5
        ]
        kept = np.setdiff1d(np.arange(len(model.firsts)), blurred)
        columns = ("firsts", "seconds", "margins", "reaches", "coupled")
        return model._replace(**{name: getattr(model, name)[kept] for name in columns})
