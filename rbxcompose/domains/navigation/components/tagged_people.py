"""Tracking people by tags that they carry."""

from __future__ import annotations

import math
from typing import Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.geometry import Transform3, rotate
from rbxcompose.domains.navigation.people import NamedTracks, PersonSighting
from rbxcompose.domains.navigation.people_reports import BLIND, PeopleConfig, TellsPeople
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs.poses import pose_of
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.msgs.vision_msgs import Detection3D, Detection3DArray

SQUARE = 0.5  # score from which on it is known how a tag is turned


class TaggedPeopleConfig(PeopleConfig):
    """Which tags people carry."""

    topic: TopicName = "tags"
    """Where tags are told that a camera sees."""
    frame: str = "camera_optical_frame"
    """The frame of that camera."""
    tags: list[sdk.Name] = []
    """The names of tags that people carry; without any, all that are seen are carried by people."""
    behind: sdk.Length = Field(0.25, ge=0)
    """From a tag to the middle of who carries it, behind the tag."""


@sdk.component("tagged_people")
class TaggedPeople(TellsPeople[TaggedPeopleConfig]):
    """Tells where people are who carry tags, by the names of these, as `people_tracker` does by a laser.

    Example:
        people: {type: tagged_people, frame: camera_optical_frame, tags: [guide]}
    """

    rate = 10.0

    @classmethod
    def ports(cls, config: TaggedPeopleConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with those of its camera."""
        return super().ports(config) | {
            "tags": sdk.In(Detection3DArray, config.topic).named("tags"),
            "camera": sdk.Looks(source=config.frame, target=config.stands_in).named("camera"),
        }

    def configure(self) -> None:
        """Know nobody yet."""
        self.tracks = NamedTracks(self.config.forget)
        self.newest: Detection3DArray | None = None  # that is not taken yet
        self.problem = ""
        self.taken = -math.inf  # when tags were taken last [s]

    def on_tags(self, message: Detection3DArray) -> None:
        """Take what a camera sees, now or as soon as it is known from where it was seen."""
        self.newest = message
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
        self.newest, self.problem, self.taken = None, "", self.now
        for one in message.detections:
            is_placed = bool(one.results) and one.results[0].hypothesis.score > 0.0
            if is_placed and (one.id in self.config.tags or not self.config.tags):
                self.see(one, at)

    def see(self, one: Detection3D, camera: Transform3) -> None:
        """Take a tag that a camera at a pose in the fixed frame sees."""
        tag = pose_of(one.bbox.center)
        away = math.hypot(*tag.translation)
        if not 0.0 < away <= self.config.farthest:  # also of what is no number
            return
        x, y, z = tag.translation
        inwards = rotate(tag.rotation, (0.0, 0.0, -1.0))
        if one.results[0].hypothesis.score < SQUARE:
            inwards = x / away, y / away, z / away
        dx, dy, _ = rotate(camera.rotation, inwards)
        level = math.hypot(dx, dy) or 1.0
        at, behind = camera.apply(tag.translation), self.config.behind
        self.tracks.see(one.id, PersonSighting(at[0] + dx / level * behind, at[1] + dy / level * behind), self.now)

    def step(self, dt: float) -> None:
        """Publish who is seen, and what missions read."""
        self.take_tags()
        found = self.tracks.people(self.now)
        self.tell(found)
        silent = f"no tags have been told for {BLIND:g} s" if self.bound["tags"].age > BLIND else ""
        self.report(found, silent or self.problem, self.taken)
