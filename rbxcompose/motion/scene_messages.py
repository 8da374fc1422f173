"""Objects of the planning scene as messages of our own, and back."""

from __future__ import annotations

import numpy as np

from rbxcompose.body.model import Geometry
from rbxcompose.geometry import Transform3
from rbxcompose.motion.scene import PlacedObject, ScenePiece
from rbxcompose.msgs.geometry_msgs import Point, Pose, Quaternion
from rbxcompose.msgs.rbxcompose_msgs import SceneObject, SceneShape
from rbxcompose.msgs.std_msgs import ColorRGBA


def pose_message(pose: Transform3) -> Pose:
    """Return a pose as a message."""
    (x, y, z), (qx, qy, qz, qw) = pose.translation, pose.rotation
    return Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw))


def pose_of(message: Pose) -> Transform3:
    """Return the pose of a message."""
    at, turn = message.position, message.orientation
    return Transform3((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w))


def object_message(one: PlacedObject) -> SceneObject:
    """Return an object as a message; an opacity of 0 is no colour."""
    red, green, blue, alpha = one.colour or (0.0, 0.0, 0.0, 0.0)
    return SceneObject(
        name=one.name,
        link=one.link,
        pose=pose_message(one.pose),
        shapes=tuple(_shape_message(each) for each in one.own_pieces),
        touches=one.touches,
        touches_objects=one.touches_objects,
        padding=one.padding,
        color=ColorRGBA(r=red, g=green, b=blue, a=alpha),
    )


def placed_object(message: SceneObject) -> PlacedObject:
    """Return the object of a message; without a shape, it is one that cannot be."""
    pieces = [_piece(one) for one in message.shapes] or [ScenePiece(Geometry("nothing"), Transform3())]
    color = message.color
    return PlacedObject(
        message.name,
        pieces[0].shape,
        message.link,
        pose_of(message.pose),
        message.touches,
        message.touches_objects,
        tuple(pieces[1:]),
        (color.r, color.g, color.b, color.a) if color.a else None,
        message.padding,
        pieces[0].pose,
    )


def _shape_message(piece: ScenePiece) -> SceneShape:
    one = piece.shape
    return SceneShape(
        kind=one.kind,
        size=np.array(one.size, dtype=np.float64),
        file=one.file,
        points=np.array(one.points, dtype=np.float64),
        triangles=np.array(one.triangles, dtype=np.uint32),
        pose=pose_message(piece.pose),
    )


def _piece(message: SceneShape) -> ScenePiece:
    size, points, triangles = (each.tolist() for each in (message.size, message.points, message.triangles))
    shape = Geometry(message.kind, tuple(size), message.file, tuple(points), tuple(triangles))
    return ScenePiece(shape, pose_of(message.pose))
