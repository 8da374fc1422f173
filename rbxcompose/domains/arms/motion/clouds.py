"""Clouds of points: their bytes, which points are known shapes, which cells are occupied."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3, rotate
from rbxcompose.domains.arms.motion.collisions import Shapes
from rbxcompose.domains.arms.motion.groups import Array
from rbxcompose.domains.arms.motion.scene import OCTREE, PLANE, PlacedObject
from rbxcompose.domains.body.model import Body, Geometry

Keys = NDArray[np.int64]
_BITS = 21  # of the number of a cell along each axis
_HALF, _MASK = 1 << (_BITS - 1), (1 << _BITS) - 1


class SeenCells:
    """Cells with sides of `side` [m]; each is forgotten `forget` [s] after it was seen last."""

    def __init__(self, side: float, forget: float) -> None:
        self.side, self.forget = side, forget
        self._keys: Keys = np.empty(0, dtype=np.int64)  # sorted
        self._seen: Array = np.empty(0)

    def __len__(self) -> int:
        return len(self._keys)

    def found(self, points: Array, least: int = 1) -> Array:
        """Return the middles of the cells with at least so many of the points, of shape (n, 3); all in [m]."""
        keys, counts = np.unique(self._key(points), return_counts=True)
        return self._middles(keys[counts >= least])

    def see(self, middles: Array, now: float) -> bool:
        """Note that cells are seen at a time [s], and forget old ones; return whether others are there than before."""
        new, before = np.unique(self._key(middles)), self._keys
        is_kept = (self._seen > now - self.forget) & (self._seen <= now) & ~np.isin(before, new, assume_unique=True)
        keys = np.concatenate((before[is_kept], new))
        order = np.argsort(keys)
        self._keys = keys[order]
        self._seen = np.concatenate((self._seen[is_kept], np.full(len(new), now)))[order]
        return not np.array_equal(before, self._keys)

    def middles(self) -> Array:
        """Return the middles of all cells [m], of shape (n, 3)."""
        return self._middles(self._keys)

    def _key(self, points: Array) -> Keys:
        cells = np.floor(points / self.side).astype(np.int64) + _HALF
        cells = cells[np.all((cells >= 0) & (cells <= _MASK), axis=1)]
        return np.asarray(cells[:, 0] << 2 * _BITS | cells[:, 1] << _BITS | cells[:, 2])

    def _middles(self, keys: Keys) -> Array:
        cells = np.stack([keys >> 2 * _BITS, keys >> _BITS & _MASK, keys & _MASK], axis=1)
        return (cells - _HALF + 0.5) * self.side


Flags = NDArray[np.bool_]
_UNIT_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True, slots=True)
class FilledSpace:
    """A shape that moves with a link, at a pose in its frame; of a mesh the box around it, from `low` to `high`."""

    link: str
    shape: Geometry
    pose: Transform3
    low: Array
    high: Array


class SpaceFilter:
    """Tells points that are within the collision shapes of a body, or of objects."""

    def __init__(self, body: Body, meshes: Mapping[str, Path] = MappingProxyType({})) -> None:
        """Measure the shapes of a body.

        Raises:
            ModuleNotFoundError: without the extra `arm`.
            ValueError: if a mesh cannot be read.
        """
        self._shapes = Shapes(meshes)
        self._objects: tuple[FilledSpace, ...] = ()
        self._body = tuple(
            self._space(link.name, shape.geometry, shape.origin)
            for link in body.links.values()
            for shape in link.collisions
        )

    def place(self, objects: Iterable[PlacedObject]) -> None:
        """Tell points within these objects, too; an octree is none of them: it is made of points."""
        self._objects = tuple(self._of_objects(objects))

    def within(self, points: Array, poses: Mapping[str, Transform3], padding: float) -> Flags:
        """Return which points, of shape (n, 3) in the root's frame, are less than `padding` [m] from a shape.

        `poses` are those of links in the root's frame.
        """
        found = np.zeros(len(points), dtype=bool)
        for space in (*self._body, *self._objects):
            found |= _within(space, points, poses[space.link].compose(space.pose), padding)
        return found

    def _of_objects(self, objects: Iterable[PlacedObject]) -> Iterator[FilledSpace]:
        for thing in objects:
            for piece in thing.all_pieces:
                if piece.shape.kind != OCTREE:
                    yield self._space(thing.link, piece.shape, piece.pose)

    def _space(self, link: str, shape: Geometry, pose: Transform3) -> FilledSpace:
        if shape.kind == PLANE:
            return FilledSpace(link, shape, pose, np.zeros(3), np.zeros(3))
        coal = self._shapes.of(shape)
        coal.computeLocalAABB()
        box = coal.aabb_local
        return FilledSpace(link, shape, pose, np.array(box.min_), np.array(box.max_))


def _within(space: FilledSpace, points: Array, pose: Transform3, padding: float) -> Flags:
    turn = np.array([rotate(pose.rotation, axis) for axis in _UNIT_AXES]).T
    own = (points - pose.translation) @ turn  # in the frame of the shape
    if space.shape.kind == PLANE:
        *normal, offset = space.shape.size
        return np.asarray(own @ normal + offset <= padding)
    inside: Flags = np.all((own >= space.low - padding) & (own <= space.high + padding), axis=1)
    if space.shape.kind == "sphere":
        inside &= np.einsum("ij,ij->i", own, own) <= (space.shape.size[0] + padding) ** 2
    elif space.shape.kind in ("cylinder", "cone", "capsule"):
        inside &= own[:, 0] ** 2 + own[:, 1] ** 2 <= (space.shape.size[0] + padding) ** 2
    return inside
