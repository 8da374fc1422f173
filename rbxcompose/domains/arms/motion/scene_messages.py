"""Objects of the planning scene as messages of our own, and as markers for RViz and Foxglove."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.geometry import Transform3, Vector3, quaternion_between
from rbxcompose.domains.arms.motion.octree_files import read_cells
from rbxcompose.domains.arms.motion.parametrisation import Trajectory
from rbxcompose.domains.arms.motion.scene import Colour, PlacedObject, ScenePiece
from rbxcompose.domains.body.model import Geometry
from rbxcompose.msgs.geometry_msgs import Point, PoseStamped
from rbxcompose.msgs.geometry_msgs import Vector3 as Vector3Message
from rbxcompose.msgs.nav_msgs import Path as PathMessage
from rbxcompose.msgs.poses import pose_message, pose_of
from rbxcompose.msgs.rbxcompose_msgs import SceneObject, SceneShape
from rbxcompose.msgs.stamps import to_duration, to_time
from rbxcompose.msgs.std_msgs import ColorRGBA, Header
from rbxcompose.msgs.trajectory_msgs import JointTrajectory, JointTrajectoryPoint
from rbxcompose.msgs.visualization_msgs import Marker, MarkerArray


def joint_trajectory(names: tuple[str, ...], motion: Trajectory, *, begin: int = 1, stamp: int = 0) -> JointTrajectory:
    """Return a motion from its point `begin` on, usually without where the arm is now; `stamp` is its start [ns]."""
    rows = zip(motion.times[begin:].tolist(), motion.positions[begin:], motion.velocities[begin:], strict=True)
    points = tuple(
        JointTrajectoryPoint(positions=at, velocities=speed, time_from_start=to_duration(time))
        for time, at, speed in rows
    )
    return JointTrajectory(header=Header(stamp=to_time(stamp)), joint_names=names, points=points)


NO_COLOUR = (0.0, 0.0, 0.0, 0.0)


def object_message(object_: PlacedObject) -> SceneObject:
    """Return an object as a message; an opacity of 0 is no colour."""
    return SceneObject(
        name=object_.name,
        link=object_.link,
        pose=pose_message(object_.pose),
        shapes=tuple(_shape_message(each) for each in object_.own_pieces),
        touches=object_.touches,
        touches_objects=object_.touches_objects,
        padding=object_.padding,
        color=colour_message(object_.colour or NO_COLOUR),
    )


def colour_message(colour: Colour) -> ColorRGBA:
    """Return a colour as a message."""
    red, green, blue, alpha = colour
    return ColorRGBA(r=red, g=green, b=blue, a=alpha)


def placed_object(message: SceneObject) -> PlacedObject:
    """Return the object of a message; without a shape, it is one that cannot be."""
    pieces = [_piece(shape) for shape in message.shapes] or [ScenePiece(Geometry("nothing"), Transform3())]
    color = message.color
    return PlacedObject.of(
        message.name,
        message.link,
        pose_of(message.pose),
        pieces,
        touches=message.touches,
        touches_objects=message.touches_objects,
        colour=(color.r, color.g, color.b, color.a) if color.a else None,
        padding=message.padding,
    )


def _shape_message(piece: ScenePiece) -> SceneShape:
    geometry = piece.shape
    return SceneShape(
        kind=geometry.kind,
        size=np.array(geometry.size, dtype=np.float64),
        file=geometry.file,
        points=np.array(geometry.points, dtype=np.float64),
        triangles=np.array(geometry.triangles, dtype=np.uint32),
        pose=pose_message(piece.pose),
    )


def _piece(message: SceneShape) -> ScenePiece:
    size, points, triangles = (each.tolist() for each in (message.size, message.points, message.triangles))
    shape = Geometry(message.kind, tuple(size), message.file, tuple(points), tuple(triangles))
    return ScenePiece(shape, pose_of(message.pose))


SAND = (0.85, 0.7, 0.45, 1.0)
_SHEET = (4.0, 4.0, 0.002)  # [m] of a plane that is shown
_SIDES = 24  # of a cone
Points = Sequence[Sequence[float]] | Array


def markers(objects: Sequence[PlacedObject]) -> MarkerArray:
    """Return markers in place of all that were there before; each is named by its object.

    Raises:
        ValueError: if the file of an octree cannot be read.
    """
    found = [Marker(action=Marker.DELETEALL)]
    for object_ in objects:
        found += [_marker(object_, piece, number) for number, piece in enumerate(object_.all_pieces)]
    return MarkerArray(markers=tuple(found))


def path_of(way: Sequence[Vector3], frame: str) -> PathMessage:
    """Return positions [m] in a frame as a path."""
    header = Header(frame_id=frame)
    poses = (PoseStamped(header=header, pose=pose_message(Transform3(point))) for point in way)
    return PathMessage(header=header, poses=tuple(poses))


def _marker(object_: PlacedObject, piece: ScenePiece, number: int) -> Marker:
    kind, scale, points, at = _shown(piece.shape)
    return Marker(
        header=Header(frame_id=object_.link),
        ns=object_.name,
        id=number,
        type=kind,
        pose=pose_message(piece.pose.compose(at)),
        scale=Vector3Message(x=scale[0], y=scale[1], z=scale[2]),
        color=colour_message(object_.colour or SAND),
        frame_locked=True,
        points=tuple(Point(x=float(x), y=float(y), z=float(z)) for x, y, z in points),
        mesh_resource=Path(piece.shape.file).as_uri() if kind == Marker.MESH_RESOURCE else "",
    )


def _shown(shape: Geometry) -> tuple[int, Vector3, Points, Transform3]:
    """Return the type of a marker, its scale, its points, and where it is in the frame of the shape."""
    match shape.kind:
        case "box":
            return Marker.CUBE, _vector(shape.size), (), Transform3()
        case "sphere":
            return Marker.SPHERE, (2 * shape.size[0],) * 3, (), Transform3()
        case "cylinder":
            radius, length = shape.size
            return Marker.CYLINDER, (2 * radius, 2 * radius, length), (), Transform3()
        case "plane":
            a, b, c, d = shape.size
            return (
                Marker.CUBE,
                _SHEET,
                (),
                Transform3((-a * d, -b * d, -c * d), quaternion_between((0.0, 0.0, 1.0), (a, b, c))),
            )
        case "octree":
            cells, side = np.array(shape.points).reshape(-1, 3), shape.size[0]
            if shape.file:
                cells, side = _read(shape.file, side)
            return Marker.CUBE_LIST, (side,) * 3, cells, Transform3()
        case "mesh" if shape.file:
            return Marker.MESH_RESOURCE, _vector(shape.size), (), Transform3()
        case "mesh":
            corners = np.array(shape.points).reshape(-1, 3)
            return Marker.TRIANGLE_LIST, _vector(shape.size), corners[list(shape.triangles)], Transform3()
    return Marker.TRIANGLE_LIST, (1.0, 1.0, 1.0), list(_cone(*shape.size)), Transform3()


def _cone(radius: float, length: float) -> Iterator[Vector3]:
    turns = [math.tau * side / _SIDES for side in range(_SIDES + 1)]
    rim = [(radius * math.cos(turn), radius * math.sin(turn), -length / 2) for turn in turns]
    for first, second in pairwise(rim):
        yield from (first, second, (0.0, 0.0, length / 2), second, first, (0.0, 0.0, -length / 2))


def _vector(values: Sequence[float]) -> Vector3:
    x, y, z = values
    return x, y, z


@lru_cache(maxsize=8)
def _read(file: str, side: float) -> tuple[Array, float]:
    return read_cells(Path(file), side)
