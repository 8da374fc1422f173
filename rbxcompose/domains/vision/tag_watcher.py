"""What all have in common that drive by tags: they know where tags are in `odom`, and where the robot is."""

from __future__ import annotations

import math
from typing import Any, TypeVar

from rbxcompose import sdk
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs.poses import pose_of
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.msgs.vision_msgs import Detection3DArray

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
    """In `odom`."""
    away: float
    """From the camera [m]."""
    score: float


C = TypeVar("C", bound=TagWatcherConfig)


class TagWatcher(sdk.Component[C]):
    """Takes what a camera sees, as soon as it is known from where it was seen."""

    @classmethod
    def ports(cls, config: C) -> dict[str, sdk.Port[Any]]:
        """Return the ports: what the camera sees, and where it and the robot are."""
        return super().ports(config) | {
            "tags": sdk.In(Detection3DArray, config.topic).named("tags"),
            "camera": sdk.Looks(source=config.frame, target=ODOM).named("camera"),
            "base": sdk.Looks(source=BASE, target=ODOM).named("base"),
        }

    def configure(self) -> None:
        """Know no tags yet."""
        self.newest: Detection3DArray | None = None  # that is not taken yet
        self.heard = -math.inf  # [s]
        self.problem = ""

    def on_tags(self, message: Detection3DArray) -> None:
        """Take what the camera sees, now or in a later step."""
        self.newest, self.heard = message, self.now
        self.take_tags()

    def take_tags(self) -> None:
        """Take the newest tags, unless that has been done."""
        if (message := self.newest) is None:
            return
        if (frame := message.header.frame_id.lstrip("/")) not in ("", self.config.frame):
            self.problem = f"tags are in '{frame}', and expected in '{self.config.frame}'"
            return
        try:
            at = self.bound["camera"].transform(at=to_nanoseconds(message.header.stamp) or None)
        except LookupError as error:
            self.problem = str(error)
            return
        self.newest, self.problem = None, ""
        found = []
        for one in message.detections:
            pose = pose_of(one.bbox.center)
            score = one.results[0].hypothesis.score if one.results else 0.0
            if score > 0.0 and all(map(math.isfinite, (*pose.translation, *pose.rotation))):
                found.append(WatchedTag(one.id, at.compose(pose), math.hypot(*pose.translation), score))
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
        return self.problem
