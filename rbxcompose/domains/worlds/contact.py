"""Where a robot that moves touches a map or a shape first."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

from rbxcompose.base.arrays import Array, ArrayLike, Bools, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Pose2, wrap_angle
from rbxcompose.domains.worlds.grid_map import SOLID, GridMap
from rbxcompose.domains.worlds.shapes import (
    CircleFootprint,
    Footprint,
    Point2,
    PolygonFootprint,
    WorldBox,
    WorldCylinder,
    WorldHull,
    WorldShape,
)

MAP = "map"  # what was hit, if it is no shape
STRIDE = 1e-3  # no point of the robot moves further between two poses that are examined [m]
STAGE = 0.1  # nor within what is examined together [m]
REFINED = 16  # poses between the last free one and the first that is not, examined twice
NOISE = 1e-12  # depth that is rounding [m]
TOUCHING = 1e-3  # what is so near to a robot touches it [m]


@dataclass(frozen=True, slots=True)
class FirstContact:
    """The end of a free motion."""

    part: float
    """How much of the motion is free, from 0 to 1."""
    pose: Pose2
    """Where the robot is then, in `map`; it overlaps nothing that it did not overlap before."""
    what: str
    """`map`, or the name of the shape."""


@dataclass(frozen=True, slots=True, eq=False)
class _Obstacles:
    """What is near, in `map` [m]: rectangles, circles, and polygons, with the name of each in this order."""

    rectangles: Array
    """(n, 6): x, y, cosine and sine of the heading, half of length and width."""
    circles: Array
    """(n, 3): x, y, radius."""
    polygons: tuple[tuple[PolygonFootprint, Pose2], ...]
    names: tuple[str, ...]


def pose_between(before: Pose2, after: Pose2, part: float) -> Pose2:
    """Return the pose after a part of a motion, in which place and heading change evenly, on the shorter way."""
    turned = wrap_angle(after.heading - before.heading)
    return Pose2(
        before.x + (after.x - before.x) * part,
        before.y + (after.y - before.y) * part,
        wrap_angle(before.heading + turned * part),
    )


def overlap(grid: GridMap, shapes: Sequence[WorldShape], footprint: Footprint, pose: Pose2) -> tuple[float, str]:
    """Return how deep a robot at a pose in `map` is in the map or a shape [m], and in which; 0 and nothing if in none.

    What is unknown, or beside the map, is free.
    """
    near = _near(grid, shapes, footprint.reach, pose, pose)
    if near is None:
        return 0.0, ""
    gaps = _gaps(near, footprint, np.array([[pose.x, pose.y, pose.heading]]))[0]
    deepest = int(gaps.argmin())
    return (-float(gaps[deepest]), near.names[deepest]) if gaps[deepest] < 0 else (0.0, "")


def first_contact(
    grid: GridMap, shapes: Sequence[WorldShape], footprint: Footprint, before: Pose2, after: Pose2
) -> FirstContact | None:
    """Return what a robot touches first on its way from a pose in `map` to a near one, or None if the way is free.

    The way is that of `pose_between`. Occupied cells are solid squares; what is unknown, or beside the map, is free.
    All `shapes` count, at whatever height they are. A robot that already overlaps the map or a shape may move as long
    as it gets no deeper into it. Nothing thicker than 1 mm is passed through, and the free part ends within 5 um of the
    contact.
    """
    reach = footprint.reach
    length = before.distance(after) + abs(wrap_angle(after.heading - before.heading)) * reach
    stages = max(1, math.ceil(length / STAGE))
    for stage in range(stages):
        begin, end = stage / stages, (stage + 1) / stages
        places = pose_between(before, after, begin), pose_between(before, after, end)
        near = _near(grid, shapes, reach, *places)
        if near is not None and (found := _first(near, footprint, before, after, begin, end, length)) is not None:
            return found
    return None


def touching(
    grid: GridMap, shapes: Sequence[WorldShape], footprint: CircleFootprint, pose: Pose2, within: float
) -> Array:
    """Return the directions in which a round robot touches something, in its frame (n,) [rad].

    What is up to `within` [m] away from its rim counts, as for the bumpers of a robot, which stand out by so much.
    """
    near = _near(grid, shapes, footprint.radius + within, pose, pose)
    if near is None:
        return np.empty(0)
    points, away = _around_circle(near, pose)
    points = points[away - footprint.radius <= within]
    return np.arctan2(points[:, 1], points[:, 0])


def _near(grid: GridMap, shapes: Sequence[WorldShape], reach: float, before: Pose2, after: Pose2) -> _Obstacles | None:
    """Return what a robot that extends so far may touch between two poses, or None."""
    (x, y), span = ((before.x + after.x) / 2, (before.y + after.y) / 2), reach + before.distance(after) / 2 + NOISE
    cos, sin = math.cos(grid.origin.heading), math.sin(grid.origin.heading)
    side, dx, dy = grid.resolution, x - grid.origin.x, y - grid.origin.y
    u, v, cells = (cos * dx + sin * dy) / side, (cos * dy - sin * dx) / side, span / side
    low, left = max(math.floor(v - cells), 0), max(math.floor(u - cells), 0)
    window = grid.cells[low : max(math.floor(v + cells) + 1, 0), left : max(math.floor(u + cells) + 1, 0)] >= SOLID
    boxes: list[tuple[float, ...]] = []
    circles: list[tuple[float, ...]] = []
    polygons: list[tuple[PolygonFootprint, Pose2]] = []
    names: dict[str, list[str]] = {"box": [], "circle": [], "polygon": []}
    for shape in shapes:
        at, solid = shape.pose, shape.solid
        if math.hypot(at.x - x, at.y - y) > span + solid.reach:
            continue
        match solid:
            case WorldBox(size=size):
                boxes.append((at.x, at.y, math.cos(at.heading), math.sin(at.heading), size[0] / 2, size[1] / 2))
                names["box"].append(shape.name)
            case WorldCylinder(radius=radius):
                circles.append((at.x, at.y, radius))
                names["circle"].append(shape.name)
            case WorldHull(footprint=outline):
                polygons.append((outline, at))
                names["polygon"].append(shape.name)
            case _:
                raise TypeError(f"'{shape.name}' is not convex")
    if not (window.any() or boxes or circles or polygons):
        return None
    rows, columns = np.nonzero(window)
    squares = np.empty((rows.size, 6))
    squares[:, :2] = grid.to_points(np.stack((columns + (left + 0.5), rows + (low + 0.5)), -1))
    squares[:, 2:] = cos, sin, side / 2, side / 2
    rectangles = np.concatenate((squares, np.array(boxes).reshape(-1, 6)))
    named = [name for kind in names.values() for name in kind]
    return _Obstacles(rectangles, np.array(circles).reshape(-1, 3), tuple(polygons), (*(MAP,) * rows.size, *named))


def _first(
    near: _Obstacles, footprint: Footprint, before: Pose2, after: Pose2, begin: float, end: float, length: float
) -> FirstContact | None:
    """Return the contact in a stage of a motion, whose points move by `length` [m] at most from 0 to 1."""

    start = np.array((before.x, before.y, before.heading))
    change = np.array((after.x - before.x, after.y - before.y, wrap_angle(after.heading - before.heading)))

    def gaps(parts: Array) -> Array:
        return _gaps(near, footprint, start + change * parts[:, None])

    at_first = gaps(np.array([begin]))[0]
    if (at_first > length * (end - begin)).all():
        return None
    # What overlaps at the beginning of a stage may get no deeper; the cells count as one thing, along which to move.
    allowed = np.minimum(at_first, 0.0) - NOISE
    cells = near.names.count(MAP)
    allowed[:cells] = allowed[:cells].min(initial=-NOISE)
    count = max(1, math.ceil(length * (end - begin) / STRIDE))
    hit = np.zeros(len(near.names), bool)
    for poses in (count, REFINED, REFINED):
        parts = np.linspace(begin, end, poses + 1)
        too_deep = gaps(parts[1:]) < allowed
        too_deep[-1] |= hit
        if not too_deep.any():
            return None
        first = int(too_deep.any(1).argmax())
        begin, end, hit = float(parts[first]), float(parts[first + 1]), too_deep[first]
    what = near.names[int(hit.argmax())]
    return FirstContact(begin, pose_between(before, after, begin), what)


def _gaps(near: _Obstacles, footprint: Footprint, poses: Array) -> Array:
    """Return how far a robot at poses (p, 3) is from each obstacle [m], (p, n); less than 0 is how deep it overlaps.

    Between corners it may be less than the distance, but has the same sign.
    """
    if isinstance(footprint, CircleFootprint):
        centres = poses[:, None, None, :2]
        return np.concatenate(
            (
                _outside_rectangles(near.rectangles, centres)[..., 0] - footprint.radius,
                np.hypot(*np.moveaxis(poses[:, None, :2] - near.circles[:, :2], -1, 0))
                - (near.circles[:, 2] + footprint.radius),
                *(
                    outside_polygon(polygon, _into(at, poses[:, None, :2])) - footprint.radius
                    for polygon, at in near.polygons
                ),
            ),
            1,
        )
    corners, normals, offsets = _edges(footprint)
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    turn = np.moveaxis(np.array([[cos, -sin], [sin, cos]]), -1, 0)
    placed = corners @ turn.swapaxes(1, 2) + poses[:, None, :2]
    x, y = _in_rectangles(near.rectangles, placed[:, None])
    half = near.rectangles[:, 4:]
    by_sides = np.maximum(
        np.maximum(x.min(-1), -x.max(-1)) - half[:, 0], np.maximum(y.min(-1), -y.max(-1)) - half[:, 1]
    )
    turned = normals @ turn.swapaxes(1, 2)
    nx, ny = turned[:, None, :, 0], turned[:, None, :, 1]
    cx, cy, c, s, a, b = near.rectangles.T[:, :, None]
    extent = np.abs(nx * c + ny * s) * a + np.abs(ny * c - nx * s) * b
    middle = nx * (cx - poses[:, 0, None, None]) + ny * (cy - poses[:, 1, None, None])
    by_edges = (middle - extent - offsets).max(-1)
    to_rectangles: Array = np.maximum(by_sides, by_edges)
    away = near.circles[:, :2] - poses[:, None, :2]
    to_circles = outside_polygon(footprint, away @ turn) - near.circles[:, 2]
    to_polygons = [_between(footprint, poses, polygon, at) for polygon, at in near.polygons]
    return np.concatenate((to_rectangles, to_circles, *to_polygons), 1)


def _into(at: Pose2, points: Array) -> Array:
    """Return points of `map` (..., 2) in the frame of a pose."""
    return (points - (at.x, at.y)) @ _turn(at)


def _between(footprint: PolygonFootprint, poses: Array, polygon: PolygonFootprint, at: Pose2) -> Array:
    """Return how far a robot at poses (p, 3) is from a polygon at a pose (p, 1), or less than 0.

    It is the largest gap between them along the normals of their edges.
    """
    corners, normals, offsets = _edges(footprint)
    others, facing, limits = _edges(polygon)
    placed = others @ _turn(at).T + (at.x, at.y)
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    turn = np.moveaxis(np.array([[cos, -sin], [sin, cos]]), -1, 0)
    seen = (placed - poses[:, None, :2]) @ turn  # the polygon in the frame of the robot (p, k, 2)
    by_robot = ((seen @ normals.T).min(1) - offsets).max(1)
    robot = _into(at, corners @ turn.swapaxes(1, 2) + poses[:, None, :2])
    by_polygon = ((robot @ facing.T).min(1) - limits).max(1)
    return np.asarray(np.maximum(by_robot, by_polygon)[:, None])


@lru_cache(maxsize=64)
def _edges(footprint: PolygonFootprint) -> tuple[Array, Array, Array]:
    """Return corners (k, 2), the outward normals (k, 2) of the edges behind them, and their distances to the origin."""
    corners = np.array(footprint.points)
    along = np.roll(corners, -1, 0) - corners
    normals = np.stack((along[:, 1], -along[:, 0]), -1) / np.hypot(along[:, 0], along[:, 1])[:, None]
    return corners, normals, (normals * corners).sum(-1)


def _in_rectangles(rectangles: Array, points: Array) -> tuple[Array, Array]:
    """Return points of `map` (..., 1 or n, k, 2) in the frames of rectangles: x and y (..., n, k)."""
    cx, cy, cos, sin = rectangles.T[:4, :, None]
    x, y = points[..., 0] - cx, points[..., 1] - cy
    return x * cos + y * sin, y * cos - x * sin


def _outside_rectangles(rectangles: Array, points: Array) -> Array:
    """Return how far points of `map` (..., 1, k, 2) are outside of rectangles, or less than 0: (..., n, k)."""
    x, y = _in_rectangles(rectangles, points)
    x, y = np.abs(x) - rectangles[:, 4, None], np.abs(y) - rectangles[:, 5, None]
    return np.hypot(np.maximum(x, 0.0), np.maximum(y, 0.0)) + np.minimum(np.maximum(x, y), 0.0)


def _nearest(footprint: PolygonFootprint, points: Array) -> Array:
    """Return the points on the outline of a polygon that are nearest to points (..., 2) of its frame."""
    corners, _, _ = _edges(footprint)
    along = np.roll(corners, -1, 0) - corners
    part = ((points[..., None, :] - corners) * along).sum(-1) / (along**2).sum(-1)
    on_edges = corners + along * np.clip(part, 0.0, 1.0)[..., None]
    best = ((points[..., None, :] - on_edges) ** 2).sum(-1).argmin(-1)
    return np.take_along_axis(on_edges, best[..., None, None], -2)[..., 0, :]


def outside_polygon(footprint: PolygonFootprint, points: Array) -> Array:
    """Return how far points (..., 2) of its frame are outside of a polygon, or less than 0: (...)."""
    _, normals, offsets = _edges(footprint)
    beyond = (points @ normals.T - offsets).max(-1)
    away = points - _nearest(footprint, points)
    return np.asarray(np.where(beyond < 0, beyond, np.hypot(away[..., 0], away[..., 1])))


def _around_circle(near: _Obstacles, pose: Pose2) -> tuple[Array, Array]:
    """Return where obstacles are, as points of the frame of a robot (n, 2), and how far from its middle.

    The points are the nearest ones of rectangles and polygons, and the middles of circles.
    """
    x, y, cos, sin, a, b = near.rectangles.T
    u, v = _in_rectangles(near.rectangles, np.array([[[pose.x, pose.y]]]))
    u, v = np.clip(u[:, 0], -a, a), np.clip(v[:, 0], -b, b)
    on_rectangles = np.stack((x + u * cos - v * sin, y + u * sin + v * cos), -1)
    here = np.array((pose.x, pose.y))
    on_polygons = [
        _nearest(polygon, _into(at, here[None])) @ _turn(at).T + (at.x, at.y) for polygon, at in near.polygons
    ]
    found = (np.concatenate((on_rectangles, near.circles[:, :2], *on_polygons)) - here) @ _turn(pose)
    away = np.hypot(found[:, 0], found[:, 1])
    away[len(on_rectangles) : len(on_rectangles) + len(near.circles)] -= near.circles[:, 2]
    return found, away


def _turn(pose: Pose2) -> Array:
    """Return the matrix that turns rows of `map` into the frame of a pose."""
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    return np.array([[cos, -sin], [sin, cos]])


def in_polygon(corners: Sequence[Point2], x: ArrayLike, y: ArrayLike) -> Bools:
    """Return which points (...) are in a polygon: those from which a line to the right crosses its sides oddly."""
    px, py = np.asarray(x, float), np.asarray(y, float)
    inside = np.zeros(px.shape, bool)
    for (x0, y0), (x1, y1) in zip(corners, (*corners[1:], *corners[:1]), strict=True):
        if y0 != y1:
            crosses = (y0 > py) != (y1 > py)
            inside ^= crosses & (px < x0 + (py - y0) * (x1 - x0) / (y1 - y0))
    return inside
