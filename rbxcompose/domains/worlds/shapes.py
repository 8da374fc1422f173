"""What is in a world beside its map: boxes, cylinders, meshes, holes, lamps; and outlines from above, of robots too."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Iterator
from functools import lru_cache
from itertools import pairwise, product

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Pose2, Transform3, Vector3
from rbxcompose.domains.body.model import Body, Geometry

Point2 = tuple[float, float]
FLAT = 1e-12  # an area that is none [m^2]
STRAIGHT = 1e-9  # a turn that is none [rad]
LEAST_AREA = 1e-6  # of a hole [m^2]
RIM = 48  # points on the rim of what is round: up to 0.2 % of its radius is lost


@dataclass(frozen=True, slots=True)
class CircleFootprint:
    """A circle around the origin of a frame; its radius [m] may be 0."""

    radius: float

    @property
    def reach(self) -> float:
        """Return how far it extends from the origin [m]."""
        return self.radius

    @property
    def inner(self) -> float:
        """Return the radius of the largest circle around the origin that it covers [m]."""
        return self.radius


@dataclass(frozen=True, slots=True)
class PolygonFootprint:
    """A convex polygon; its corners (x, y) [m] are kept so that they turn left, without those that make no corner.

    Raises:
        ValueError: if it is not convex, or has fewer than three corners.
    """

    points: tuple[Point2, ...]

    def __post_init__(self) -> None:
        corners = tuple(point for i, point in enumerate(self.points) if point != self.points[i - 1])
        around = zip((*corners[-1:], *corners), corners, (*corners[1:], *corners[:1]), strict=False)
        corners = tuple(at for before, at, after in around if abs(_turn(before, at, after)) > STRAIGHT)
        for points in (corners, corners[::-1]):
            turns = [_turn(points[i - 2], points[i - 1], points[i]) for i in range(len(points))]
            if len(points) > 2 and min(turns) > 0 and sum(turns) < 7:  # a star turns around twice
                object.__setattr__(self, "points", points)
                return
        raise ValueError("a footprint is a convex polygon")

    @property
    def reach(self) -> float:
        """Return how far it extends from the origin [m]."""
        return max(math.hypot(x, y) for x, y in self.points)

    @property
    def inner(self) -> float:
        """Return the radius of the largest circle around the origin that it covers [m]; below 0 if it is outside."""
        edges = zip(self.points, (*self.points[1:], self.points[0]), strict=True)
        return min((ax * by - ay * bx) / math.hypot(bx - ax, by - ay) for (ax, ay), (bx, by) in edges)


Footprint = CircleFootprint | PolygonFootprint


def _turn(a: Point2, b: Point2, c: Point2) -> float:
    """Return the angle by which a way turns left at its middle point [rad]."""
    (ux, uy), (vx, vy) = (b[0] - a[0], b[1] - a[1]), (c[0] - b[0], c[1] - b[1])
    return math.atan2(ux * vy - uy * vx, ux * vx + uy * vy)


@dataclass(frozen=True, slots=True)
class WorldBox:
    """A box, centred above the origin of its frame."""

    size: Vector3
    """Along x, y and z [m]."""

    @property
    def height(self) -> float:
        """Return how high it is [m]."""
        return self.size[2]

    @property
    def reach(self) -> float:
        """Return how far it extends from its middle, seen from above [m]."""
        return math.hypot(self.size[0], self.size[1]) / 2

    @property
    def footprint(self) -> PolygonFootprint:
        """Return its outline from above, in its own frame."""
        x, y = self.size[0] / 2, self.size[1] / 2
        return PolygonFootprint(((x, y), (-x, y), (-x, -y), (x, -y)))


@dataclass(frozen=True, slots=True)
class WorldCylinder:
    """An upright cylinder around the z axis of its frame."""

    radius: float
    height: float

    @property
    def reach(self) -> float:
        """Return how far it extends from its middle, seen from above [m]."""
        return self.radius

    @property
    def footprint(self) -> CircleFootprint:
        """Return its outline from above, in its own frame."""
        return CircleFootprint(self.radius)


@dataclass(frozen=True, slots=True)
class WorldHull:
    """A convex part of a mesh; the lowest of its corners is at a height of 0."""

    corners: tuple[Vector3, ...]
    """In the frame of the mesh [m]."""
    triangles: tuple[tuple[int, int, int], ...]
    """Its sides by their corners, which turn left for who is outside."""

    @property
    def height(self) -> float:
        """Return how high it is [m]."""
        return max(z for _, _, z in self.corners)

    @property
    def reach(self) -> float:
        """Return how far it extends from the origin, seen from above [m]."""
        return max(math.hypot(x, y) for x, y, _ in self.corners)

    @property
    def footprint(self) -> PolygonFootprint:
        """Return its outline from above."""
        return _outline(self)


@lru_cache(maxsize=256)
def _outline(hull: WorldHull) -> PolygonFootprint:
    return PolygonFootprint(convex_hull((x, y) for x, y, _ in hull.corners))


def convex_hull(points: Iterable[Point2]) -> tuple[Point2, ...]:
    """Return the corners of the smallest convex polygon around points, which turn left: Andrew's monotone chain (1979).

    Less than a nanometre counts as nothing.
    """
    found, halves = sorted({(round(x, 9), round(y, 9)) for x, y in points}), list[Point2]()
    for ordered in (found, found[::-1]):
        half: list[Point2] = []
        for point in ordered:
            while len(half) > 1 and _area(half[-2], half[-1], point) <= FLAT:
                half.pop()
            half.append(point)
        halves += half[:-1]
    return tuple(halves)


def _area(a: Point2, b: Point2, c: Point2) -> float:
    """Return twice the area of a triangle, above 0 if it turns left [m^2]."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


@dataclass(frozen=True, slots=True)
class WorldMesh:
    """Convex parts, each above the ground by a height [m]."""

    parts: tuple[tuple[float, WorldHull], ...]

    @property
    def height(self) -> float:
        """Return how high it reaches [m]."""
        return max(low + hull.height for low, hull in self.parts)

    @property
    def reach(self) -> float:
        """Return how far it extends from the origin, seen from above [m]."""
        return max(hull.reach for _, hull in self.parts)


ConvexSolid = WorldBox | WorldCylinder | WorldHull


@dataclass(frozen=True, slots=True)
class ShapePath:
    """Where something is at which time: on straight lines between points.

    Before the first and after the last point it stands there; if it repeats, it is at the first one again when it
    reaches the last.

    Raises:
        ValueError: if there is no point, times do not increase, or a number is not finite.
    """

    points: tuple[tuple[float, float, float], ...]
    """Time [s], x and y in `map` [m]."""
    repeats: bool = False
    turns: bool = False
    """Whether it faces where it goes."""

    def __post_init__(self) -> None:
        if not self.points or not all(map(math.isfinite, (number for point in self.points for number in point))):
            raise ValueError("a path has points of three finite numbers")
        if any(after[0] <= before[0] for before, after in pairwise(self.points)):
            raise ValueError("the times of a path increase")

    def place_at(self, time: float) -> Point2:
        """Return x and y [m] at a time [s]."""
        time, after = self._between(time)
        if after in (0, len(self.points)):
            return self.points[0 if after == 0 else -1][1:]
        (t0, x0, y0), (t1, x1, y1) = self.points[after - 1 : after + 1]
        part = (time - t0) / (t1 - t0)
        return x0 + (x1 - x0) * part, y0 + (y1 - y0) * part

    def heading_at(self, time: float, otherwise: float) -> float:
        """Return the direction in which it goes, or went last [rad]; before that, where it will go."""
        if not self.turns:
            return otherwise
        _, after = self._between(time)
        ways = [(b[1] - a[1], b[2] - a[2]) for a, b in pairwise(self.points)]
        for dx, dy in (*ways[: max(after, 1)][::-1], *ways):
            if dx or dy:
                return math.atan2(dy, dx)
        return otherwise

    def _between(self, time: float) -> tuple[float, int]:
        """Return a time [s] within the path, if it repeats, and the number of the first point after it."""
        first, last = self.points[0], self.points[-1]
        if self.repeats and time > last[0] > first[0]:
            time = first[0] + (time - first[0]) % (last[0] - first[0])
        return time, bisect_right(self.points, time, key=lambda point: point[0])


@dataclass(frozen=True, slots=True)
class WorldTag:
    """A square tag on a thing, as cameras see it."""

    number: int
    family: str
    size: float
    """The side of its black square [m]."""
    place: Transform3
    """In the frame of the thing, with z above its base: x to the right of the tag, y up, z out of it."""


@dataclass(frozen=True, slots=True)
class WorldShape:
    """A thing in a world, which moves if it has a path."""

    name: str
    solid: ConvexSolid | WorldMesh
    pose: Pose2
    """In `map`."""
    z: float = 0.0
    """Height of its base above the ground [m]."""
    path: ShapePath | None = None
    mass: float = 0.0
    """Of one that can be pushed [kg]; 0 if it stands fast."""
    tags: tuple[WorldTag, ...] = ()

    def pose_at(self, time: float) -> Pose2:
        """Return its pose in `map` at a time [s]."""
        if self.path is None:
            return self.pose
        return Pose2(*self.path.place_at(time), self.path.heading_at(time, self.pose.heading))

    def at(self, time: float) -> WorldShape:
        """Return the shape as it stands at a time [s]."""
        if self.path is None:
            return self
        return WorldShape(self.name, self.solid, self.pose_at(time), self.z, tags=self.tags)

    def is_between(self, low: float, high: float) -> bool:
        """Return whether some of it is at heights from `low` to `high` [m]; both may be the same."""
        return self.z <= high and low <= self.z + self.solid.height

    @property
    def convex(self) -> tuple[WorldShape, ...]:
        """Return its convex parts, at the same pose and with the same name, without tags."""
        if not isinstance(self.solid, WorldMesh):
            return (self,)
        return tuple(
            WorldShape(self.name, hull, self.pose, self.z + low, self.path, self.mass) for low, hull in self.solid.parts
        )

    @property
    def outlines(self) -> tuple[Footprint, ...]:
        """Return the outlines of its convex parts from above, in its own frame."""
        if isinstance(self.solid, WorldMesh):
            return tuple(hull.footprint for _, hull in self.solid.parts)
        return (self.solid.footprint,)


@dataclass(frozen=True, slots=True)
class WorldLight:
    """A lamp, which shines in all directions."""

    name: str
    at: Vector3
    """In `map` [m]."""
    colour: str = ""
    strength: float = 0.6
    """From 0 to 1."""


@dataclass(frozen=True, slots=True)
class WorldHole:
    """A part of the ground that is not there, by the corners of a polygon in `map` [m].

    Raises:
        ValueError: if it encloses no area.
    """

    name: str
    corners: tuple[Point2, ...]

    def __post_init__(self) -> None:
        if len(self.corners) < 3:
            raise ValueError("an area has at least three corners")
        sides = zip(self.corners, (*self.corners[1:], self.corners[0]), strict=True)
        if abs(sum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in sides)) < 2 * LEAST_AREA:
            raise ValueError("the corners of an area are on one line, or its sides cross")


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
