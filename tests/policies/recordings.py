"""Recordings for tests of data sets, of messages that they make."""

from __future__ import annotations

from collections.abc import Iterable
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image as Pillow

from rbxcompose.base.clock import NANOSECONDS
from rbxcompose.msgs.cdr import encode
from rbxcompose.msgs.sensor_msgs import CompressedImage, Image, JointState
from rbxcompose.msgs.types import Message
from rbxcompose.runtime.recording.files import RecordingWriter
from rbxcompose.runtime.recording.topics import Recorded, RecordedTopic, definition_of

Timed = tuple[float, str, Message]
"""When a message came [s], its topic, and the message."""
BEGIN = 1_795_000_000 * NANOSECONDS + 1  # [ns since 1970] of all times
SIZE = 64, 48  # [pixels] of pictures, width and height


def write_recording(
    path: Path, messages: Iterable[Timed], *, is_sorted: bool = True, silent: Iterable[RecordedTopic] = ()
) -> Path:
    """Write messages in the order of their times, or as they come, and declare topics without any."""
    with path.open("wb") as file:
        writer = RecordingWriter(file)
        for time, name, message in sorted(messages, key=lambda each: each[0]) if is_sorted else messages:
            stamp = BEGIN + round(time * NANOSECONDS)
            topic = RecordedTopic(name, message.TYPE, "RIHS01_00", definition=definition_of(message.TYPE))
            writer.add(Recorded(topic, stamp, stamp, 0, encode(message)))
        for topic in silent:
            writer.declare(topic)
        writer.finish()
    return path


def joints(**positions: float) -> JointState:
    return JointState(name=tuple(positions), position=np.array(list(positions.values())))


def picture(brightness: int, width: int = SIZE[0], height: int = SIZE[1]) -> Image:
    """A picture of one red."""
    colours = np.zeros((height, width, 3), np.uint8)
    colours[:, :, 0] = brightness
    return Image(height=height, width=width, encoding="rgb8", step=3 * width, data=colours.tobytes())


def jpeg(brightness: int) -> CompressedImage:
    """A compressed picture of one grey."""
    written = BytesIO()
    Pillow.new("L", SIZE, brightness).save(written, "JPEG")
    return CompressedImage(format="jpeg", data=written.getvalue())


def arm_with_cameras(seconds: float = 2.0, rise: float = 1.0) -> list[Timed]:
    """Two joints whose positions rise, commands 0.1 ahead, and two cameras that get brighter, one of them slowly."""
    found: list[Timed] = []
    for turn in range(round(seconds * 50) + 1):
        time, at = turn / 50, rise * turn / 50
        found.append((10 + time, "/joint_states", joints(lift=at, pan=-at)))
        found.append((10 + time, "/joint_commands", joints(pan=-at - 0.1, lift=at + 0.1)))
    found += [(10 + turn / 15, "/front/image", picture(100 + 2 * turn)) for turn in range(int(seconds * 15) + 1)]
    found += [(10 + turn / 5, "/hand/image/compressed", jpeg(50 + 10 * turn)) for turn in range(int(seconds * 5) + 1)]
    return found
