"""Tracking people by tags that they carry."""

from __future__ import annotations

import math

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.geometry import rotate
from rbxcompose.domains.navigation.people import NamedTracks, PersonSighting
from rbxcompose.domains.navigation.reports import BLIND, PeopleConfig, TellsPeople
from rbxcompose.domains.vision.tag_watcher import SQUARE, TagWatcher, TagWatcherConfig, WatchedTag


class TaggedPeopleConfig(PeopleConfig, TagWatcherConfig):
    """Which tags people carry."""

    tags: list[sdk.Name] = []
    """The names of tags that people carry; without any, all that are seen are carried by people."""
    behind: sdk.Length = Field(0.25, ge=0)
    """From a tag to the middle of who carries it, behind the tag."""


@sdk.component("tagged_people")
class TaggedPeople(TellsPeople[TaggedPeopleConfig], TagWatcher[TaggedPeopleConfig]):
    """Tells where people are who carry tags, by the names of these, as `people_tracker` does by a laser.

    Example:
        people: {type: tagged_people, frame: camera_optical_frame, tags: [guide]}
    """

    rate = 10.0

    @classmethod
    def fixed_frame(cls, config: TaggedPeopleConfig) -> str:
        """Return the frame in which people are."""
        return config.stands_in

    def configure(self) -> None:
        """Know nobody yet."""
        super().configure()
        self.tracks = NamedTracks(self.config.forget)

    def see(self, tags: list[WatchedTag]) -> None:
        """Take who carries the tags of a picture."""
        for tag in tags:
            if tag.away > self.config.farthest or not (tag.name in self.config.tags or not self.config.tags):
                continue
            at = tag.pose.translation
            inwards = rotate(tag.pose.rotation, (0.0, 0.0, -1.0))
            if tag.score < SQUARE:
                inwards = at[0] - tag.camera.translation[0], at[1] - tag.camera.translation[1], 0.0
            level = math.hypot(*inwards[:2]) or 1.0
            dx, dy = (self.config.behind * part / level for part in inwards[:2])
            self.tracks.see(tag.name, PersonSighting(at[0] + dx, at[1] + dy), self.now)

    def step(self, dt: float) -> None:
        """Publish who is seen, and what missions read."""
        self.take_tags()
        found = self.tracks.people(self.now)
        self.tell(found)
        self.report(found, self.trouble(BLIND), self.taken)
