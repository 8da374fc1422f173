"""A thing of the planning scene that is where the robot is."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rbxcompose.body.model import Body, BodyJoint, Geometry
from rbxcompose.body.solid_boxes import box_within, penetration
from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.geometry import Vector3
from rbxcompose.model.arm_goals import length_of
from rbxcompose.model.robot import Robot
from rbxcompose.motion.scene import PlacedObject
from rbxcompose.sections.arms import arms
from rbxcompose.sections.scene import scene

_ON_AXIS = 0.001  # [m]
_TIMES = 10.0  # as large as the longest arm is long: a unit is wrong
_UNIT = "is a unit wrong? A number without a unit counts in metres: for centimetres, write '20 cm'"
_FARTHER = "place it farther away, or name the link below 'touches'"
_INTO = 0.01  # [m]: what stands against the robot, or a little beside its place, is no mistake
_SOLID = ("box", "cylinder", "capsule", "sphere")


@check("RBX2246", Severity.WARNING, closed=())
def object_in_robot(robot: Robot) -> Iterator[Finding]:
    """A thing of the scene is where the robot is."""
    contents, description = robot.manifest.contents, robot.manifest.body
    if description is None or not contents.of(arms):
        return
    body = description.body
    points = list(_fixed_points(body))
    longest = max(length_of(robot, body, one) for one in contents.of(arms).values())
    for one in contents.of(scene).objects:
        into = body.still[one.link].compose(one.pose).inverse() if one.link in body.still else None
        for link, point in points if into and one.shape.kind in ("box", "sphere", "cylinder") else ():
            if into and link not in one.touches and _contains(one.shape, into.apply(point)):
                yield object_in_robot.at(
                    robot.key("scene", "objects", one.name),
                    f"'{one.name}' is where '{link}' always is, so every arm with this link collides at its start",
                    help=_UNIT if max(one.shape.size) > _TIMES * longest else _FARTHER,
                    related=[Related(body.links[link].span, "the link")],
                )
                break
        else:
            yield from _in_still_link(robot, body, one)


def _in_still_link(robot: Robot, body: Body, one: PlacedObject) -> Iterator[Finding]:
    """Yield the finding about a thing that reaches into a link that nothing moves."""
    still = body.still
    box = box_within(one.shape, still[one.link].compose(one.pose)) if one.link in still else None
    for link in still if box else ():
        for shape in body.links[link].collisions if link not in one.touches else ():
            other = box_within(shape.geometry, still[link].compose(shape.origin))
            if box and other and penetration(box, other) > _INTO:
                yield object_in_robot.at(
                    robot.key("scene", "objects", one.name),
                    f"'{one.name}' reaches into '{link}', which nothing moves out of it",
                    help=_FARTHER,
                    related=[Related(body.links[link].span, "the link")],
                )
                return


def _fixed_points(body: Body) -> Iterator[tuple[str, Vector3]]:
    """Yield points of solid links that a joint turns and yet leaves in place, in the frame of the root [m]."""
    poses = body.poses({})
    for joint in body.joints_downwards:
        if joint.parent in body.still and joint.moves and not joint.slides:
            for shape in body.links[joint.child].collisions:
                if shape.geometry.kind in _SOLID and _is_on_axis(joint, shape.origin.translation):
                    yield joint.child, poses[joint.child].apply(shape.origin.translation)


def _is_on_axis(joint: BodyJoint, point: Vector3) -> bool:
    (x, y, z), (ax, ay, az) = point, joint.axis
    return math.hypot(y * az - z * ay, z * ax - x * az, x * ay - y * ax) < _ON_AXIS


def _contains(shape: Geometry, point: Vector3) -> bool:
    if shape.kind == "sphere":
        return math.hypot(*point) < shape.size[0]
    if shape.kind == "cylinder":
        return math.hypot(*point[:2]) < shape.size[0] and abs(point[2]) < shape.size[1] / 2.0
    return all(abs(at) < size / 2.0 for at, size in zip(point, shape.size, strict=True))
