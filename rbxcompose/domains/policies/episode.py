"""An episode: what of a robot's messages a policy learns from, as frames at a steady rate.

A frame has the state and the pictures that were the newest ones at its time, and as its action the last command before
the next frame: where a policy that sees this frame should lead the robot.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import field
from enum import Enum
from typing import Any

from rbxcompose.base.clock import NANOSECONDS
from rbxcompose.base.dataclass import dataclass
from rbxcompose.msgs.geometry_msgs import Twist, TwistStamped
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.sensor_arrays import DEPTHS
from rbxcompose.msgs.sensor_msgs import CompressedImage, Image, JointState

STATE, ACTION, PICTURES = "observation.state", "action", "observation.images"
POSITION, VELOCITIES = ".pos", ("x.vel", "y.vel", "theta.vel")
_ENDINGS = ("compressed", "image", "image_raw", "image_color", "rgb")  # of topics, which say nothing about the camera


class SampleRole(Enum):
    """What the messages of a topic are to an episode."""

    JOINTS = STATE, JointState.TYPE, "joint_states"
    JOINT_COMMANDS = ACTION, JointState.TYPE, "joint_commands"
    MOTION = STATE, Odometry.TYPE, "odom"
    MOTION_COMMANDS = ACTION, Twist.TYPE, "cmd_vel"
    STAMPED_MOTION_COMMANDS = ACTION, TwistStamped.TYPE, "cmd_vel"
    PICTURE = PICTURES, Image.TYPE, ""
    JPEG = PICTURES, CompressedImage.TYPE, ""

    def __init__(self, feature: str, type: str, topic: str) -> None:
        self.feature, self.type, self.topic = feature, type, topic
        """`topic` is the last word of the topic's name; empty for any."""


_DRIVING = (SampleRole.MOTION_COMMANDS, SampleRole.STAMPED_MOTION_COMMANDS)


def role_of(topic: str, type: str) -> SampleRole | None:
    """Return what the messages of a topic are to an episode; None if they are nothing to it."""
    words = topic.split("/")
    return next((role for role in SampleRole if role.type == type and role.topic in ("", words[-1])), None)


def camera_of(topic: str) -> str:
    """Return the name of the camera of a topic: `/head/image_raw/compressed` is of `head`."""
    words = topic.strip("/").split("/")
    while len(words) > 1 and words[-1] in _ENDINGS:
        words.pop()
    return "_".join(words)


@dataclass(frozen=True, slots=True)
class Sample:
    """A message of which a frame may be made: `time` [ns] is when it arrived."""

    time: int
    topic: str
    role: SampleRole
    numbers: Mapping[str, float]
    """By name: `JOINT.pos` [rad or m], `x.vel` [m/s], `theta.vel` [rad/s]; none of a silent topic of commands."""
    picture: Any = None
    """The message of a picture: it is decoded when a frame needs it."""


def sample_of(time: int, topic: str, role: SampleRole, message: Any) -> Sample | None:
    """Return what of a message is a sample: no depths, and no numbers that are not finite."""
    if role.feature == PICTURES:
        is_depth = role is SampleRole.PICTURE and message.encoding in DEPTHS
        return None if is_depth else Sample(time, topic, role, {}, message)
    if role in (SampleRole.JOINTS, SampleRole.JOINT_COMMANDS):
        found = {f"{name}{POSITION}": float(at) for name, at in zip(message.name, message.position, strict=False)}
    else:
        twist = message
        while hasattr(twist, "twist"):  # with a stamp or a covariance
            twist = twist.twist
        found = dict(zip(VELOCITIES, map(float, (twist.linear.x, twist.linear.y, twist.angular.z)), strict=True))
    return Sample(time, topic, role, {name: value for name, value in found.items() if math.isfinite(value)})


@dataclass(frozen=True, slots=True)
class Features:
    """What each frame has: the names of its numbers in their order, and the topics of its cameras."""

    state: tuple[str, ...]
    action: tuple[str, ...]
    cameras: Mapping[str, str]
    """The topic of each camera by its name."""
    start: int
    """When everything had been there once [ns]."""


class NoEpisodeError(ValueError):
    """Raised for messages of which no episode can be made."""


def features_of(samples: Iterable[Sample]) -> Features:
    """Return what the frames of an episode have, and when they begin.

    Raises:
        NoEpisodeError: if there is no state or no action.
    """
    first: dict[str, dict[str, int]] = {STATE: {}, ACTION: {}, PICTURES: {}}
    began: int | None = None
    is_driven = False
    for sample in samples:
        is_driven |= sample.role in _DRIVING
        began = sample.time if began is None else began
        if sample.role.feature == PICTURES:
            first[PICTURES].setdefault(sample.topic, sample.time)
        for name in sample.numbers:
            first[sample.role.feature].setdefault(name, sample.time)
    if began is None or not first[STATE]:
        raise NoEpisodeError("nothing on 'joint_states' or 'odom': there is no state to learn from")
    if not first[ACTION]:
        raise NoEpisodeError("nothing on 'joint_commands' or 'cmd_vel': there is no command to learn")
    if is_driven and set(VELOCITIES) & first[STATE].keys():
        # That a base rests while nobody commands it is a command, too.
        first[ACTION] |= dict.fromkeys(VELOCITIES, began)
    cameras: dict[str, str] = {}
    for topic in sorted(first[PICTURES], key=len):  # the shortest name of a camera is the raw picture
        cameras.setdefault(camera_of(topic), topic)
    commands = [time for name, time in first[ACTION].items() if name not in VELOCITIES]
    start = max(*first[STATE].values(), *commands, *(first[PICTURES][topic] for topic in cameras.values()))
    return Features(_ordered(first[STATE]), _ordered(first[ACTION]), dict(sorted(cameras.items())), start)


def _ordered(names: Collection[str]) -> tuple[str, ...]:
    """Return joints by the alphabet, as buses may come in any order, then velocities."""
    joints = sorted(name for name in names if name not in VELOCITIES)
    return *joints, *(name for name in VELOCITIES if name in names)


@dataclass(frozen=True, slots=True)
class EpisodeFrame:
    """One frame: numbers in the order of the features, and the message of each camera."""

    state: tuple[float, ...]
    action: tuple[float, ...]
    pictures: Mapping[str, Any]


@dataclass(slots=True)
class Episode:
    """Makes frames of samples in the order of time."""

    features: Features
    rate: int
    """[Hz]"""
    repeated: dict[str, int] = field(default_factory=dict)
    """How many frames of each camera have the picture of the frame before."""
    _numbers: dict[str, dict[str, float]] = field(
        default_factory=lambda: {STATE: {}, ACTION: dict.fromkeys(VELOCITIES, 0.0)}
    )
    _pictures: dict[str, Any] = field(default_factory=dict)
    _count: int = 0
    _seen: tuple[tuple[float, ...], dict[str, Any]] | None = None

    def frames(self, samples: Iterable[Sample]) -> Iterator[EpisodeFrame]:
        """Yield the frames; the last one ends with the last sample."""
        names = {topic: name for name, topic in self.features.cameras.items()}
        for sample in samples:
            while sample.time > self._due():
                yield from self._next()
            if sample.role.feature != PICTURES:
                self._numbers[sample.role.feature].update(sample.numbers)
            elif (name := names.get(sample.topic)) is not None:
                self._pictures[name] = sample.picture

    def _due(self) -> int:
        """Return when the next frame begins [ns]: a whole number, as a float of times since 1970 misses by 100 ns."""
        return self.features.start + self._count * NANOSECONDS // self.rate

    def _next(self) -> Iterator[EpisodeFrame]:
        if self._seen is not None:
            state, pictures = self._seen
            yield EpisodeFrame(state, self._of(ACTION, self.features.action), pictures)
            for name in self.features.cameras:
                self.repeated[name] = self.repeated.get(name, 0) + (pictures[name] is self._pictures[name])
        self._seen = self._of(STATE, self.features.state), dict(self._pictures)
        self._count += 1

    def _of(self, feature: str, names: Iterable[str]) -> tuple[float, ...]:
        return tuple(self._numbers[feature][name] for name in names)
