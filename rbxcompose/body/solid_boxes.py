"""Boxes within solid shapes, and whether two boxes overlap: exact for boxes, never too much for round shapes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product

from rbxcompose.body.model import Geometry
from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import Transform3, Vector3, rotate

_PARALLEL = 1e-9  # length of a cross product of two unit vectors below which they count as parallel


@dataclass(frozen=True, slots=True)
class SolidBox:
    """A box with its middle at `pose`, and half of its lengths along the axes there [m]."""

    pose: Transform3
    half: Vector3

    @property
    def axes(self) -> list[Vector3]:
        """Return its three axes."""
        return [rotate(self.pose.rotation, one) for one in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]


def box_within(shape: Geometry, pose: Transform3) -> SolidBox | None:
    """Return a box of which no part is outside of a shape; None for what has no simple one, such as a mesh."""
    match shape.kind, shape.size:
        case "box", (x, y, z):
            return SolidBox(pose, (x / 2.0, y / 2.0, z / 2.0))
        case "cylinder", (radius, length):
            across = radius / math.sqrt(2.0)
            return SolidBox(pose, (across, across, length / 2.0))
        case "sphere", (radius,):
            return SolidBox(pose, (radius / math.sqrt(3.0),) * 3)
    return None


def penetration(one: SolidBox, other: SolidBox) -> float:
    """Return how far two boxes reach into each other [m], at most 0 if they are apart.

    They are apart if an axis of one of them, or a normal to an axis of each, separates them (S. Gottschalk et al.,
    OBBTree, 1996). Otherwise the least overlap along these is what would have to be moved.
    """
    first, second = one.axes, other.axes
    way = _less(other.pose.translation, one.pose.translation)
    return min(
        _reach(one, first, axis) + _reach(other, second, axis) - abs(_dot(way, axis))
        for axis in (*first, *second, *_normals(first, second))
    )


def _normals(first: list[Vector3], second: list[Vector3]) -> Iterator[Vector3]:
    for (ax, ay, az), (bx, by, bz) in product(first, second):
        x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        if (length := math.hypot(x, y, z)) > _PARALLEL:
            yield x / length, y / length, z / length


def _reach(box: SolidBox, axes: list[Vector3], along: Vector3) -> float:
    return sum(half * abs(_dot(axis, along)) for half, axis in zip(box.half, axes, strict=True))


def _dot(one: Vector3, other: Vector3) -> float:
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]


def _less(one: Vector3, other: Vector3) -> Vector3:
    return one[0] - other[0], one[1] - other[1], one[2] - other[2]
