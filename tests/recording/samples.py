"""Recordings for tests."""

from __future__ import annotations

import io
from collections.abc import Iterable

from rbxcompose.msgs import cdr
from rbxcompose.msgs.geometry_msgs import (
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.std_msgs import Header, String
from rbxcompose.msgs.types import Message
from rbxcompose.runtime.recording.files import RecordingWriter
from rbxcompose.runtime.recording.topics import Recorded, RecordedTopic, definition_of
from rbxcompose.sdk.ports import Qos

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND


def topic(name: str, type: type[Message], qos: Qos = Qos.STATE) -> RecordedTopic:
    return RecordedTopic(name, type.TYPE, type.HASH, qos, definition_of(type.TYPE))


ODOM = topic("/odom", Odometry)
TWIST = topic("/cmd_vel", Twist, Qos.COMMAND)
MAP = topic("/map", String, Qos.LATCHED)


def recorded(topic: RecordedTopic, message: Message, at: float, sequence: int = 1) -> Recorded:
    time = START + round(at * SECOND)
    return Recorded(topic, time, time - 1000, sequence, cdr.encode(message))


def odometry(number: int) -> Odometry:
    pose = Pose(position=Point(x=number / 7, y=-2.5), orientation=Quaternion(z=0.6, w=0.8))
    return Odometry(
        header=Header(frame_id="odom"),
        child_frame_id="base_link",
        pose=PoseWithCovariance(pose=pose),
        twist=TwistWithCovariance(twist=twist(number)),
    )


def twist(number: int) -> Twist:
    return Twist(linear=Vector3(x=number / 3), angular=Vector3(z=-1e-3 * number))


def some(count: int = 60) -> list[Recorded]:
    """Three topics; one is latched."""
    messages = [recorded(MAP, String(data="the map"), 0.0)]
    for number in range(count):
        messages.append(recorded(ODOM, odometry(number), number / 10, number + 1))
        messages.append(recorded(TWIST, twist(number), number / 10 + 0.01, number + 1))
    return messages


def written(messages: Iterable[Recorded], flush_every: int = 10) -> bytes:
    """The bytes of a finished file with several chunks."""
    return _file(messages, flush_every, is_finished=True)


def unfinished(messages: Iterable[Recorded], flush_every: int = 10) -> bytes:
    """The bytes that a killed recorder leaves."""
    return _file(messages, flush_every, is_finished=False)


def _file(messages: Iterable[Recorded], flush_every: int, *, is_finished: bool) -> bytes:
    file = io.BytesIO()
    writer = RecordingWriter(file)
    for number, message in enumerate(messages, 1):
        writer.add(message)
        if number % flush_every == 0:
            writer.flush()
    if is_finished:
        writer.finish()
    return file.getvalue()
