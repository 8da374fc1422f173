"""Which points are within shapes that are known: those of the robot's links, and of things around it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from rbxcompose.body.model import Body, Geometry
from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import Transform3, rotate
from rbxcompose.motion.coal_shapes import Shapes
from rbxcompose.motion.scene import PlacedObject
from rbxcompose.motion.scene_shapes import OCTREE, PLANE

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


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
        for one in (*self._body, *self._objects):
            found |= _within(one, points, poses[one.link].compose(one.pose), padding)
        return found

    def _of_objects(self, objects: Iterable[PlacedObject]) -> Iterator[FilledSpace]:
        for one in objects:
            for piece in one.all_pieces:
                if piece.shape.kind != OCTREE:
                    yield self._space(one.link, piece.shape, piece.pose)

    def _space(self, link: str, shape: Geometry, pose: Transform3) -> FilledSpace:
        if shape.kind == PLANE:
            return FilledSpace(link, shape, pose, np.zeros(3), np.zeros(3))
        coal = self._shapes.of(shape)
        coal.computeLocalAABB()
        box = coal.aabb_local
        return FilledSpace(link, shape, pose, np.array(box.min_), np.array(box.max_))


def _within(one: FilledSpace, points: Array, pose: Transform3, padding: float) -> Flags:
    turn = np.array([rotate(pose.rotation, axis) for axis in _AXES]).T
    own = (points - pose.translation) @ turn  # in the frame of the shape
    if one.shape.kind == PLANE:
        *normal, offset = one.shape.size
        return np.asarray(own @ normal + offset <= padding)
    inside: Flags = np.all((own >= one.low - padding) & (own <= one.high + padding), axis=1)
    if one.shape.kind == "sphere":
        inside &= np.einsum("ij,ij->i", own, own) <= (one.shape.size[0] + padding) ** 2
    elif one.shape.kind in ("cylinder", "cone", "capsule"):
        inside &= own[:, 0] ** 2 + own[:, 1] ** 2 <= (one.shape.size[0] + padding) ** 2
    return inside
