"""Objects of the planning scene as MoveIt's messages have them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import zip_longest

import numpy as np

from rbxcompose.body.model import Geometry
from rbxcompose.geometry import Transform3
from rbxcompose.motion.scene import PlacedObject, SceneError, ScenePiece
from rbxcompose.motion.scene_messages import pose_message, pose_of
from rbxcompose.motion.scene_shapes import MOST_POINTS
from rbxcompose.msgs.geometry_msgs import Point, Pose
from rbxcompose.msgs.moveit_msgs import CollisionObject
from rbxcompose.msgs.shape_msgs import Mesh, MeshTriangle, Plane, SolidPrimitive
from rbxcompose.msgs.std_msgs import Header

KINDS = {
    SolidPrimitive.BOX: "box",
    SolidPrimitive.SPHERE: "sphere",
    SolidPrimitive.CYLINDER: "cylinder",
    SolidPrimitive.CONE: "cone",
}
_LENGTH_FIRST = ("cylinder", "cone")  # MoveIt's sizes are height and radius, ours radius and length
_NUMBERS = {kind: number for number, kind in KINDS.items()}


def object_of(message: CollisionObject, root: str) -> PlacedObject:
    """Return the object of a message; without a frame it stands in that of the root.

    Raises:
        SceneError: if it has no shapes, or one that there is not.
    """
    pieces = list(pieces_of(message))
    if not pieces:
        raise SceneError(f"'{message.id}' has no shapes")
    first, *rest = pieces
    link, pose = message.header.frame_id or root, pose_of(message.pose)
    return PlacedObject(message.id, first.shape, link, pose, pieces=tuple(rest), shape_pose=first.pose)


def pieces_of(message: CollisionObject) -> Iterator[ScenePiece]:
    """Yield the shapes of a message, in the frame of the object; raises as `object_of` does."""
    yield from _placed([_primitive(one) for one in message.primitives], message.primitive_poses)
    yield from _placed([_mesh(one) for one in message.meshes], message.mesh_poses)
    yield from _placed([_plane(one) for one in message.planes], message.plane_poses)


def _placed(shapes: Sequence[Geometry], poses: Sequence[Pose]) -> Iterator[ScenePiece]:
    """Yield shapes with their poses; without any poses, all are where the object is."""
    if poses and len(poses) != len(shapes):
        raise SceneError(f"it has {len(shapes)} shapes of one kind and {len(poses)} poses of them")
    for shape, pose in zip_longest(shapes, poses):
        yield ScenePiece(shape, Transform3() if pose is None else pose_of(pose))


def _primitive(message: SolidPrimitive) -> Geometry:
    kind, size = KINDS.get(message.type, ""), message.dimensions.tolist()
    if not kind:
        raise SceneError(f"there is no shape of the type {message.type}: {', '.join(KINDS.values())}")
    return Geometry(kind, tuple(reversed(size)) if kind in _LENGTH_FIRST else tuple(size))


def _mesh(message: Mesh) -> Geometry:
    if max(len(message.vertices), len(message.triangles)) > 2 * MOST_POINTS:
        raise SceneError(f"its mesh has {len(message.vertices):,} corners and {len(message.triangles):,} triangles")
    points = tuple(value for one in message.vertices for value in (one.x, one.y, one.z))
    triangles = tuple(value for one in message.triangles for value in one.vertex_indices.tolist())
    return Geometry("mesh", (1.0, 1.0, 1.0), points=points, triangles=triangles)


def _plane(message: Plane) -> Geometry:
    return Geometry("plane", tuple(message.coef.tolist()))


def collision_object(one: PlacedObject) -> CollisionObject:
    """Return an object as a message; meshes in files and octrees, which it cannot hold, are left out."""
    pieces = one.own_pieces
    simple = [each for each in pieces if each.shape.kind in _NUMBERS]
    meshes = [each for each in pieces if each.shape.kind == "mesh" and each.shape.points]
    planes = [each for each in pieces if each.shape.kind == "plane"]
    return CollisionObject(
        header=Header(frame_id=one.link),
        pose=pose_message(one.pose),
        id=one.name,
        primitives=tuple(_primitive_message(each.shape) for each in simple),
        primitive_poses=tuple(pose_message(each.pose) for each in simple),
        meshes=tuple(_mesh_message(each.shape) for each in meshes),
        mesh_poses=tuple(pose_message(each.pose) for each in meshes),
        planes=tuple(Plane(coef=np.array(each.shape.size)) for each in planes),
        plane_poses=tuple(pose_message(each.pose) for each in planes),
    )


def _primitive_message(shape: Geometry) -> SolidPrimitive:
    size = tuple(reversed(shape.size)) if shape.kind in _LENGTH_FIRST else shape.size
    return SolidPrimitive(type=_NUMBERS[shape.kind], dimensions=np.array(size, dtype=np.float64))


def _mesh_message(shape: Geometry) -> Mesh:
    corners = np.array(shape.points).reshape(-1, 3) * shape.size
    triangles = np.array(shape.triangles, dtype=np.uint32).reshape(-1, 3)
    return Mesh(
        triangles=tuple(MeshTriangle(vertex_indices=one) for one in triangles),
        vertices=tuple(Point(x=x, y=y, z=z) for x, y, z in corners.tolist()),
    )
