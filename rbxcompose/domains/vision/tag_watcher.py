"""What all have in common that use tags: they know where tags and the robot are in a fixed frame, such as `odom`."""

from __future__ import annotations

import math
from typing import Any, TypeVar

from rbxcompose import sdk
from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Pose2, Transform3
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs.poses import pose_of
from rbxcompose.msgs.vision_msgs import Detection3D, Detection3DArray
from rbxcompose.sdk.bound import NewestMessage

BASE, ODOM = "base_footprint", "odom"
SQUARE = 0.5  # score from which on it is known how a tag is turned


class TagWatcherConfig(sdk.Config):
    """Whose tags it knows."""

    topic: TopicName = "tags"
    """Where a `tag_detector` tells what its camera sees."""
    frame: str = "camera_optical_frame"
    """The optical frame of that camera."""


@dataclass(frozen=True, slots=True)
class WatchedTag:
    """A tag or a board that a camera saw."""

    name: str
    pose: Transform3
    """In the fixed frame."""
    away: float
    """From the camera [m]."""
    score: float
    camera: Transform3
    """Its pose in that frame when it saw the tag."""
    covariance: Array
    """Of the pose, about the axes of the camera (6, 6): position [m^2], then rotation [rad^2]."""
    names: frozenset[str]
    """Its name and its number."""


def names_of(seen: Detection3D) -> frozenset[str]:
    """Return the name and the number of what was seen."""
    return frozenset((seen.id, *(result.hypothesis.class_id for result in seen.results)))


C = TypeVar("C", bound=TagWatcherConfig)


class TagWatcher(sdk.Component[C]):
    """Takes what a camera sees, as soon as it is known from where it was seen."""

    @classmethod
    def ports(cls, config: C) -> dict[str, sdk.Port[Any]]:
        """Return the ports: what the camera sees, and where it and the robot are."""
        fixed = cls.fixed_frame(config)
        return super().ports(config) | {
            "tags": sdk.In(Detection3DArray, config.topic).named("tags"),
            "camera": sdk.Looks(source=config.frame, target=fixed).named("camera"),
            "base": sdk.Looks(source=BASE, target=fixed).named("base"),
        }

    @classmethod
    def capabilities(cls, config: C) -> tuple[sdk.Capability, ...]:
        """Declare the frame of its tags."""
        return (*super().capabilities(config), sdk.MeasuresIn("tags", sdk.Setting(config.frame, "frame")))

    @classmethod
    def fixed_frame(cls, config: C) -> str:
        """Return the frame in which places of tags are kept."""
        return ODOM

    def configure(self) -> None:
        """Know no tags yet."""
        self.newest = NewestMessage[Detection3DArray](self.config.frame, "tags are in '{}', and expected in '{}'")
        self.heard = self.taken = -math.inf  # when something came, and could be used [s]
        self.base_then = Pose2()  # where the robot was in that frame when the newest picture was taken

    def on_tags(self, message: Detection3DArray) -> None:
        """Take what the camera sees, now or in a later step."""
        self.heard = self.now
        self.newest.put(message)
        self.take_tags()

    def take_tags(self) -> None:
        """Take the newest tags, unless that has been done."""
        if (placed := self.newest.take(self.now, self.bound["camera"], self.bound["base"])) is None:
            return
        message, (at, base) = placed
        self.taken = self.now
        self.base_then = base.to_pose2()
        found = []
        for one in message.detections:
            pose = pose_of(one.bbox.center)
            score = one.results[0].hypothesis.score if one.results else 0.0
            if score > 0.0 and all(map(math.isfinite, (*pose.translation, *pose.rotation))):
                spread = np.asarray(one.results[0].pose.covariance, float).reshape(6, 6)
                away = math.hypot(*pose.translation)
                found.append(WatchedTag(one.id, at.compose(pose), away, score, at, spread, names_of(one)))
        self.see(found)

    def see(self, tags: list[WatchedTag]) -> None:
        """Take the tags of a picture whose places are known."""
        raise NotImplementedError

    @property
    def silent(self) -> float:
        """Return for how long the camera has told nothing [s]."""
        return self.now - self.heard

    def trouble(self, silence: float) -> str:
        """Return what is wrong with the camera, which may be silent for a time [s]; empty if nothing is."""
        if self.silent > silence:
            told = f"nothing for {self.silent:.1f} s" if self.silent < math.inf else "nothing yet"
            return f"the camera has told {told}"
        return self.newest.problem
