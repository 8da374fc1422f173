"""How much room a robot takes: its outline seen from above, and its height."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product

from rbxcompose.base.geometry import Vector3
from rbxcompose.domains.body.model import Body, Geometry
from rbxcompose.domains.worlds.shapes import Point2, convex_hull

RIM = 48  # points on the rim of what is round: up to 0.2 % of its radius is lost


def outline_of(body: Body) -> tuple[float, float]:
    """Return the radius around the origin of the root, and the height [m], of the collision shapes at rest.

    Meshes are not read. Both are 0 if there are no other shapes.
    """
    radius = height = 0.0
    for x, y, z in _points(body):
        radius, height = max(radius, math.hypot(x, y)), max(height, z)
    return radius, height


def hull_of(body: Body) -> tuple[Point2, ...]:
    """Return the corners of the convex hull of the collision shapes at rest, seen from above [m]; meshes are not read.

    They turn left. There are none if there are no other shapes.
    """
    return convex_hull((x, y) for x, y, _ in _points(body))


def sections_of(body: Body, height: float) -> Iterator[tuple[str, tuple[Point2, ...]]]:
    """Yield the link and the corners of each collision shape at rest that is at a height [m], seen from above."""
    poses = body.poses({})
    for name, link in body.links.items():
        for shape in link.collisions:
            points = [poses[name].compose(shape.origin).apply(point) for point in _outermost(shape.geometry)]
            if points and min(z for *_, z in points) <= height <= max(z for *_, z in points):
                yield name, convex_hull((x, y) for x, y, _ in points)


def _points(body: Body) -> Iterator[Vector3]:
    poses = body.poses({})
    for name, link in body.links.items():
        for shape in link.collisions:
            yield from map(poses[name].compose(shape.origin).apply, _outermost(shape.geometry))


def _outermost(geometry: Geometry) -> Iterator[Vector3]:
    rim = [(math.cos(math.tau * turn / RIM), math.sin(math.tau * turn / RIM)) for turn in range(RIM)]
    match geometry.kind, geometry.size:
        case "box", (x, y, z):
            yield from product((-x / 2, x / 2), (-y / 2, y / 2), (-z / 2, z / 2))
        case ("cylinder" | "capsule") as form, (radius, length):
            top = length / 2 + (radius if form == "capsule" else 0.0)
            yield from ((radius * x, radius * y, z) for x, y in rim for z in (-top, top))
        case "sphere", (radius, *_):
            yield from ((radius * x, radius * y, 0.0) for x, y in rim)
            yield from ((0.0, 0.0, -radius), (0.0, 0.0, radius))
