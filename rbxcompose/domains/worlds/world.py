"""The world of a robot: its map, what stands and moves in it, and the robot's outline; as a value and as a message."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from functools import cache, cached_property
from typing import Any

from rbxcompose.base.arrays import Array, Bools, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.worlds.contact import TOUCHING, FirstContact, first_contact, in_polygon, overlap, touching
from rbxcompose.domains.worlds.grid_map import GridMap, MapError
from rbxcompose.domains.worlds.ray_casting import Rays
from rbxcompose.domains.worlds.shapes import (
    CircleFootprint,
    Point2,
    ShapePath,
    WorldBox,
    WorldCylinder,
    WorldHole,
    WorldHull,
    WorldLight,
    WorldMesh,
    WorldShape,
    WorldTag,
)
from rbxcompose.msgs import rbxcompose_msgs as ours
from rbxcompose.msgs.nav_msgs import MapMetaData, OccupancyGrid
from rbxcompose.msgs.poses import message_of, pose_in, pose_message, pose_of
from rbxcompose.msgs.std_msgs import Header

MAP_FRAME = "map"
ROUNDING = 1e-9  # [m]
FORESEEN = 0.1  # [s] for which a robot is taken to go on as it did when it was heard


@cache
def no_walls() -> GridMap:
    """Return the map of a world that has none; it is always the same one."""
    return GridMap(np.zeros((1, 1), np.int8), 1.0)


@dataclass(frozen=True)
class SimulatedWorld:
    """What a robot is in, and where and how large it is; `start` is in `map`, lengths are in metres."""

    name: str = ""
    grid: GridMap = field(default_factory=no_walls)
    shapes: tuple[WorldShape, ...] = ()
    start: Pose2 = Pose2()
    radius: float = 0.2
    height: float = 0.5
    colours: tuple[str, ...] = ()
    """Of the shapes; empty for those without."""
    holes: tuple[WorldHole, ...] = ()
    lights: tuple[WorldLight, ...] = ()
    robots: tuple[WorldShape, ...] = ()
    """Others that share it, where they start."""
    motion: RobotsMotion | None = None
    """Where those are now; None before it is known."""

    @cached_property
    def rays(self) -> Rays:
        """Return what casts rays in the map."""
        return Rays(self.grid)

    def with_moved(self, places: Mapping[str, tuple[Pose2, float]]) -> SimulatedWorld:
        """Return the same with things elsewhere: their poses in `map`, and the heights [m] of their middles."""
        moved = (
            replace(shape, pose=places[shape.name][0], z=max(0.0, places[shape.name][1] - shape.solid.height / 2))
            if shape.name in places
            else shape
            for shape in self.shapes
        )
        return self._changed(("rays", "_extents"), shapes=tuple(moved))

    def with_robots(self, message: ours.WorldRobots, now: float) -> SimulatedWorld:
        """Return the same with other robots where a message says that they are at robot time `now` [s]."""
        places = np.array((message.xs, message.ys, message.headings, message.speeds, message.turn_rates)).T
        told = dict(zip(message.names, places, strict=True))
        known = self.motion.at_first if self.motion else (_at_start(robot) for robot in self.robots)
        rows = [told.get(robot.name, row) for robot, row in zip(self.robots, known, strict=True)]
        motion = RobotsMotion(np.array(rows, float).reshape(-1, 5), now)
        return self._changed(("rays", "_extents", "_standing", "_still", "_moving"), motion=motion)

    def robots_at(self, time: float) -> Array:
        """Return x, y [m] and heading [rad] in `map` of each other robot at a time [s] (n, 3)."""
        if self.motion is None:
            return np.array([_at_start(robot)[:3] for robot in self.robots], float).reshape(-1, 3)
        return self.motion.at(time)

    def robots_standing(self, time: float) -> list[WorldShape]:
        """Return the other robots where they are at a time [s]."""
        places = self.robots_at(time).tolist()
        return [replace(robot, pose=Pose2(*at)) for robot, at in zip(self.robots, places, strict=True)]

    def _changed(self, kept: Sequence[str], **changes: Any) -> SimulatedWorld:
        """Return the same with other values, for which what was computed of the `kept` attributes still holds."""
        made = replace(self, **changes)
        made.__dict__.update({name: self.__dict__[name] for name in kept if name in self.__dict__})
        return made

    def first_contact(self, before: Pose2, after: Pose2, time: float) -> FirstContact | None:
        """Return what the robot touches first on its way between two near poses in `map` at a time [s]."""
        middle, reach = ((before.x + after.x) / 2, (before.y + after.y) / 2), self.radius + before.distance(after) / 2
        near = self.shapes_near(middle, reach, time, 0.0, self.height)
        return first_contact(self.grid, near, CircleFootprint(self.radius), before, after)

    def touched_by(self, pose: Pose2, time: float) -> frozenset[str]:
        """Return what moves and is up to 1 mm from a robot at a pose in `map`, or in it, at a time [s]."""
        footprint = CircleFootprint(self.radius + TOUCHING)
        near = [shape.at(time) for shape in self._moving if shape.is_between(0.0, self.height)]
        near += self._robots_near((pose.x, pose.y), footprint.radius, time, 0.0) if self.robots else []
        return frozenset(shape.name for shape in near if overlap(no_walls(), [shape], footprint, pose)[1])

    @property
    def moving(self) -> frozenset[str]:
        """Return the names of what moves: shapes with a path, and other robots."""
        return frozenset(shape.name for shape in (*self._moving, *self.robots))

    def touching(self, pose: Pose2, within: float, time: float) -> Array:
        """Return the directions in which something is within `within` [m] of the robot, in its frame (n,) [rad]."""
        near = self.shapes_near((pose.x, pose.y), self.radius + within, time, 0.0, self.height)
        return touching(self.grid, near, CircleFootprint(self.radius), pose, within)

    def over_holes(self, pose: Pose2, points: Sequence[Point2]) -> Bools:
        """Return below which points in the frame of a robot at `pose` there is no ground (n,)."""
        placed = [pose.compose(Pose2(x, y)) for x, y in points]
        x, y = [at.x for at in placed], [at.y for at in placed]
        missing = np.zeros(len(placed), bool)
        for hole in self.holes:
            missing |= in_polygon(hole.corners, x, y)
        return missing

    def distances(self, origin: Point2, angles: Array, most: float, time: float, z: float) -> Array:
        """Return how far rays at the height `z` [m] go from a point of `map` at `angles` [rad]; inf beyond `most`."""
        return self.rays.cast(origin, angles, most, self.shapes_near(origin, most, time, z, z), z)

    def shapes_near(self, place: Point2, reach: float, time: float, low: float, high: float) -> list[WorldShape]:
        """Return the convex shapes within `reach` [m] of a point of `map` and at heights from `low` to `high` [m] as
        they stand at a time [s]; of those that move, all."""
        x, y, extents, bottoms, tops = self._standing
        is_near = np.hypot(x - place[0], y - place[1]) <= extents + (reach + ROUNDING)
        near = [self._still[index] for index in np.flatnonzero(is_near & (bottoms <= high) & (low <= tops))]
        near += [shape.at(time) for shape in self._moving if shape.is_between(low, high)]
        return near + self._robots_near(place, reach, time, low) if self.robots else near

    def _robots_near(self, place: Point2, reach: float, time: float, low: float) -> list[WorldShape]:
        places, (extents, tops) = self.robots_at(time), self._extents
        is_near = np.hypot(places[:, 0] - place[0], places[:, 1] - place[1]) <= extents + (reach + ROUNDING)
        near = [(self.robots[index], places[index].tolist()) for index in np.flatnonzero(is_near & (low <= tops))]
        return [WorldShape(robot.name, robot.solid, Pose2(*at)) for robot, at in near]

    @cached_property
    def _extents(self) -> Array:
        """Return how far each other robot extends, and how high it is (2, n) [m]."""
        return np.array([(robot.solid.reach, robot.solid.height) for robot in self.robots], float).reshape(-1, 2).T

    @cached_property
    def _moving(self) -> list[WorldShape]:
        return [part for shape in self.shapes if shape.path is not None for part in shape.convex]

    @cached_property
    def _still(self) -> list[WorldShape]:
        return [part for shape in self.shapes if shape.path is None for part in shape.convex]

    @cached_property
    def _standing(self) -> Array:
        """Return x, y, how far it extends, and the heights of bottom and top of each shape that stands (5, n) [m]."""
        rows = [(one.pose.x, one.pose.y, one.solid.reach, one.z, one.z + one.solid.height) for one in self._still]
        return np.array(rows, float).reshape(-1, 5).T


@dataclass(frozen=True, slots=True, eq=False)
class RobotsMotion:
    """How robots move since a robot time [s]: x, y [m], heading [rad], speed [m/s], turn rate [rad/s] of each."""

    at_first: Array
    """(n, 5)."""
    since: float

    def at(self, time: float) -> Array:
        """Return x, y and heading of each at a time [s] (n, 3); after `FORESEEN` they stand."""
        age = min(max(time - self.since, 0.0), FORESEEN)
        x, y, heading, speed, turn_rate = self.at_first.T
        return np.stack(
            (x + np.cos(heading) * speed * age, y + np.sin(heading) * speed * age, heading + turn_rate * age), 1
        )


def _at_start(robot: WorldShape) -> tuple[float, ...]:
    return robot.pose.x, robot.pose.y, robot.pose.heading, 0.0, 0.0


def grid_message(grid: GridMap, stamp: Header) -> OccupancyGrid:
    """Return a map as a message."""
    rows, columns = grid.cells.shape
    about = MapMetaData(stamp.stamp, grid.resolution, columns, rows, message_of(grid.origin))
    return OccupancyGrid(stamp, about, grid.cells.ravel())


def grid_of(message: OccupancyGrid) -> GridMap:
    """Return the map of a message; one without cells has no walls.

    Raises:
        MapError: if it is none.
    """
    about = message.info
    if not len(message.data):
        return no_walls()
    if len(message.data) != about.height * about.width:
        raise MapError(f"{len(message.data)} cells are no map of {about.width} x {about.height}")
    cells = np.asarray(message.data, np.int8).reshape(about.height, about.width)
    return GridMap(cells, about.resolution, pose_in(about.origin))


def world_message(world: SimulatedWorld, header: Header, time: float = 0.0) -> ours.World:
    """Return a world as a message; `time` is robot time [s] at the stamp of the header."""
    grid = OccupancyGrid(header=header) if world.grid is no_walls() else grid_message(world.grid, header)
    colours = world.colours or ("",) * len(world.shapes)
    shapes = tuple(map(_shape_message, world.shapes, colours))
    at = world.start
    return ours.World(
        world.name,
        grid,
        shapes,
        tuple(ours.WorldHole(hole.name, *map(np.array, zip(*hole.corners, strict=True))) for hole in world.holes),
        tuple(ours.WorldLight(lamp.name, *lamp.at, lamp.colour, lamp.strength) for lamp in world.lights),
        tuple(_shape_message(robot, "") for robot in world.robots),
        at.x,
        at.y,
        at.heading,
        world.radius,
        world.height,
        time,
    )


def world_of(message: ours.World) -> SimulatedWorld:
    """Return the world of a message.

    Raises:
        MapError: if its map is none.
        ValueError: if a shape or a hole is none.
    """
    shapes = tuple(map(_shape_of, message.shapes))
    start = Pose2(message.x, message.y, message.heading)
    colours = tuple(shape.colour for shape in message.shapes)
    holes = tuple(
        WorldHole(hole.name, tuple((float(x), float(y)) for x, y in zip(hole.xs, hole.ys, strict=True)))
        for hole in message.holes
    )
    lights = tuple(
        WorldLight(lamp.name, (lamp.x, lamp.y, lamp.z), lamp.colour, lamp.strength) for lamp in message.lights
    )
    return SimulatedWorld(
        message.name,
        grid_of(message.map),
        shapes,
        start,
        message.radius,
        message.height,
        colours,
        holes,
        lights,
        tuple(map(_shape_of, message.robots)),
    )


def _shape_message(shape: WorldShape, colour: str) -> ours.WorldShape:
    times, xs, ys = zip(*shape.path.points, strict=True) if shape.path else ((), (), ())
    kind, numbers, parts = "box", tuple[float, ...](), tuple[tuple[float, WorldHull], ...]()
    match shape.solid:
        case WorldBox(size=size):
            numbers = size
        case WorldCylinder(radius=radius, height=height):
            kind, numbers = "cylinder", (radius, height)
        case WorldMesh(parts=parts):
            kind = "mesh"
        case WorldHull() as hull:
            kind, parts = "mesh", ((0.0, hull),)
    return ours.WorldShape(
        shape.name,
        kind,
        np.array(numbers),
        shape.pose.x,
        shape.pose.y,
        shape.z,
        shape.pose.heading,
        np.array(times, float),
        np.array(xs, float),
        np.array(ys, float),
        shape.path is not None and shape.path.repeats,
        shape.path is not None and shape.path.turns,
        colour,
        shape.mass,
        tuple(_hull_message(*part) for part in parts),
        tuple(ours.WorldTag(tag.number, tag.family, tag.size, pose_message(tag.place)) for tag in shape.tags),
    )


def _hull_message(low: float, hull: WorldHull) -> ours.WorldHull:
    corners = np.array(hull.corners, float) + np.array((0.0, 0.0, low))
    return ours.WorldHull(corners.ravel(), np.array(hull.triangles, np.uint32).ravel())


def _hull_of(message: ours.WorldHull) -> tuple[float, WorldHull]:
    corners = np.asarray(message.corners, float).reshape(-1, 3)
    low = float(corners[:, 2].min())
    triangles = np.asarray(message.triangles, int).reshape(-1, 3)
    if triangles.size and triangles.max() >= len(corners):
        raise ValueError("a triangle of a mesh has a corner that does not exist")
    return low, WorldHull(
        tuple((x, y, z) for x, y, z in (corners - (0.0, 0.0, low)).tolist()),
        tuple((a, b, c) for a, b, c in triangles.tolist()),
    )


def _shape_of(message: ours.WorldShape) -> WorldShape:
    numbers = [float(number) for number in message.size]
    solid: WorldBox | WorldCylinder | WorldMesh
    if message.kind == "mesh":
        solid = WorldMesh(tuple(map(_hull_of, message.hulls)))
    elif message.kind == "box":
        x, y, z = numbers
        solid = WorldBox((x, y, z))
    else:
        solid = WorldCylinder(*numbers)
    points = tuple(
        (float(t), float(x), float(y)) for t, x, y in zip(message.times, message.xs, message.ys, strict=True)
    )
    path = ShapePath(points, message.repeats, message.turns) if points else None
    pose = Pose2(message.x, message.y, message.heading)
    tags = tuple(WorldTag(tag.number, tag.family, tag.size, pose_of(tag.pose)) for tag in message.tags)
    return WorldShape(message.name, solid, pose, message.z, path, message.mass, tags)
