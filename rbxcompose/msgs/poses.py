"""Poses, transforms and velocities in messages."""

from __future__ import annotations

from rbxcompose.base.geometry import Pose2, Transform3, Velocity2
from rbxcompose.msgs.geometry_msgs import Point, Pose, Quaternion, Transform, Twist, Vector3


def pose_of(message: Pose) -> Transform3:
    """Return a pose."""
    at, turn = message.position, message.orientation
    return Transform3((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w))


def pose_message(pose: Transform3) -> Pose:
    """Return a pose as a message."""
    return Pose(Point(*pose.translation), Quaternion(*pose.rotation))


def transform_of(message: Transform) -> Transform3:
    """Return a transform."""
    at, turn = message.translation, message.rotation
    return Transform3((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w))


def transform_message(pose: Transform3) -> Transform:
    """Return a transform as a message."""
    return Transform(Vector3(*pose.translation), Quaternion(*pose.rotation))


def twist_message(velocity: Velocity2) -> Twist:
    """Return the velocity of a base as a message."""
    return Twist(linear=Vector3(x=velocity.linear), angular=Vector3(z=velocity.angular))


def pose_in(message: Pose) -> Pose2:
    """Return the planar part of a pose."""
    return pose_of(message).to_pose2()


def message_of(pose: Pose2) -> Pose:
    """Return a planar pose as a message."""
    return pose_message(Transform3.from_pose2(pose))
