"""How a gripper may take hold of an object. The frame between its fingers has x ahead and y across the fingers.

Poses are in the frame of the body's root, lengths in [m], angles in [rad].
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import product

from rbxcompose.base import geometry
from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.arms.motion.scene import PlacedObject, ScenePiece
from rbxcompose.domains.body.model import Geometry

SOLIDS = ("box", "cylinder", "sphere")
PITCHES = (0.0, 0.1, -0.1, 0.2, -0.2, 0.3, -0.3)
SIDES = (0.0, 0.4, -0.4, 0.8, -0.8)  # about the vertical, from the direction from which the arm comes
FACING = 1.1  # between that direction and the face of a box
FROM_ABOVE = 0.5  # quality of a grasp from above, beside one from the side
FROM_BELOW = 0.5  # of one whose wrist is lower than the fingers, where the thing that the object is put on will be
TURNED = 0.05  # how much worse a gripper upside down is, so that the other way is tried first
SHALLOW = (0.0, 0.01, 0.02)  # how far a gripper from above stays back: fingers that are longer would meet the table
DEPTH = 0.03  # of an object before the middle of the fingers, at most; it would else meet the palm
LEVEL = 0.1  # sine of the angle by which fingers may close out of the horizontal


@dataclass(frozen=True, slots=True)
class Grasp:
    """A pose of the frame between the fingers, and the width of what is between them then; better ones first."""

    pose: geometry.Transform3
    width: float
    quality: float


def solid_of(thing: PlacedObject) -> ScenePiece | None:
    """Return the shape of an object and its pose in the object's frame; None unless it shows how to hold the object."""
    return ScenePiece(thing.shape, thing.shape_pose) if not thing.pieces and thing.shape.kind in SOLIDS else None


def _quality(turn: geometry.Quaternion, pitch: float) -> float:
    is_from_below = geometry.rotate(turn, (1.0, 0.0, 0.0))[2] > LEVEL / 2
    return (1.0 - abs(pitch)) * (FROM_BELOW if is_from_below else 1.0)


def grasps_of(shape: Geometry, pose: geometry.Transform3, bearing: float, widest: float) -> list[Grasp]:
    """Return grasps of a box, cylinder or sphere, the best first; none if each is wider than the gripper opens.

    `bearing` is the direction from the arm to the object, seen from above.
    """
    found = [
        Grasp(geometry.Transform3(_held_at(shape, pose, turn, back), turn), width, _quality(turn, pitch) * worth)
        for turned, worth, back in _sides(shape, pose, bearing)
        if (width := _width(shape, pose, turned)) < widest
        for pitch in PITCHES
        for turn in (geometry.multiply(turned, geometry.quaternion_from_rpy(0.0, pitch, 0.0)),)
    ]
    return sorted(found, key=lambda grasp: -grasp.quality)


def widths_of(shape: Geometry, pose: geometry.Transform3, bearing: float) -> list[float]:
    """Return the widths of the grasps of a box, cylinder or sphere, however wide, see `grasps_of`."""
    return [_width(shape, pose, turned) for turned, _, _ in _sides(shape, pose, bearing)]


def _width(shape: Geometry, pose: geometry.Transform3, turned: geometry.Quaternion) -> float:
    return 2 * extent(shape, pose.rotation, geometry.rotate(turned, (0.0, 1.0, 0.0)))


def least_width(shape: Geometry) -> float:
    """Return the least distance between fingers on both sides of an object."""
    match shape.kind:
        case "box":
            return min(shape.size)
        case "cylinder":
            return min(2 * shape.size[0], shape.size[1])
    return 2 * shape.size[0]


def extent(shape: Geometry, rotation: geometry.Quaternion, direction: geometry.Vector3) -> float:
    """Return how far a turned object reaches from its middle along a unit vector."""
    x, y, z = geometry.rotate(geometry.conjugate(rotation), direction)
    match shape.kind:
        case "box":
            return sum(abs(part) * size for part, size in zip((x, y, z), shape.size, strict=True)) / 2
        case "cylinder":
            return math.hypot(x, y) * shape.size[0] + abs(z) * shape.size[1] / 2
    return shape.size[0]


def reach_of(thing: PlacedObject, rotation: geometry.Quaternion, direction: geometry.Vector3) -> float | None:
    """Return how far an object turned by `rotation` reaches from its origin along a unit vector, if that is known."""
    if (solid := solid_of(thing)) is None:
        return None
    x, y, z = geometry.rotate(rotation, solid.pose.translation)
    ahead = x * direction[0] + y * direction[1] + z * direction[2]
    return ahead + extent(solid.shape, geometry.multiply(rotation, solid.pose.rotation), direction)


def _held_at(shape: Geometry, pose: geometry.Transform3, turn: geometry.Quaternion, back: float) -> geometry.Vector3:
    """Return where fingers that come from a direction hold an object: a deep one not at its middle."""
    ahead = geometry.rotate(turn, (1.0, 0.0, 0.0))
    back += max(0.0, extent(shape, pose.rotation, ahead) - DEPTH)
    x, y, z = (at - back * part for at, part in zip(pose.translation, ahead, strict=True))
    return (x, y, z)


def _sides(
    shape: Geometry, pose: geometry.Transform3, bearing: float
) -> Iterator[tuple[geometry.Quaternion, float, float]]:
    """Yield rotations of the gripper before it is pitched, their worth, and how far it stays back."""
    for yaw, worth in _yaws(shape, pose, bearing):
        for roll in (0.0, math.pi):
            yield geometry.quaternion_from_rpy(roll, 0.0, yaw), worth * (1.0 - TURNED * (roll > 0.0)), 0.0
    above = geometry.quaternion_about((0.0, 1.0, 0.0), math.pi / 2)
    for yaw, back in product(_closing_from_above(shape, pose, bearing), SHALLOW):
        yield geometry.multiply(geometry.quaternion_from_rpy(0.0, 0.0, yaw), above), FROM_ABOVE * (1.0 - back), back


def _yaws(shape: Geometry, pose: geometry.Transform3, bearing: float) -> Iterable[tuple[float, float]]:
    """Return directions from the side with their worth: across faces of a box, any about what is round."""
    if shape.kind == "box":
        ways = [axis for axis in _level_axes(pose, "xyz") if abs(_between(axis, bearing)) <= FACING]
        return sorted(((yaw, math.cos(_between(yaw, bearing) / 2)) for yaw in ways), key=lambda pair: -pair[1])
    if shape.kind == "cylinder" and (lying := _level_axes(pose, "z")):
        return [(yaw, 1.0) for yaw in lying if abs(_between(yaw, bearing)) <= FACING]  # along it
    return [(bearing + side, math.cos(side / 2)) for side in SIDES]


def _closing_from_above(shape: Geometry, pose: geometry.Transform3, bearing: float) -> list[float]:
    """Return the yaws of a gripper that points down: it closes across a box, or across a cylinder that lies."""
    if shape.kind == "box":
        return _level_axes(pose, "xyz")
    if shape.kind == "cylinder" and (lying := _level_axes(pose, "z")):
        return lying
    return [bearing + side for side in SIDES]


def _level_axes(pose: geometry.Transform3, axes: str) -> list[float]:
    """Return the directions of those axes that are level, seen from above, both ways."""
    units = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
    turned = [geometry.rotate(pose.rotation, units[name]) for name in axes]
    level = [math.atan2(y, x) for x, y, z in turned if abs(z) <= LEVEL]
    return [angle + half for angle, half in product(level, (0.0, math.pi))]


def _between(value: float, other: float) -> float:
    return math.remainder(value - other, math.tau)
