"""The middle of several tags."""

from __future__ import annotations

from typing import Any

from rbxcompose import sdk
from rbxcompose.base.arrays import np
from rbxcompose.domains.vision.tag_watcher import names_of
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs.geometry_msgs import Point, Pose, PoseStamped
from rbxcompose.msgs.vision_msgs import Detection3DArray


class TagsCogConfig(sdk.Config):
    """Which tags."""

    topic: TopicName = "tags"
    """Where a `tag_detector` tells what its camera sees."""
    tags: list[str] = []
    """Names or numbers of the tags that count; without any, all do."""


@sdk.component("tags_cog")
class TagsCog(sdk.Component[TagsCogConfig]):
    """Publishes the middle of the tags that are seen, as a target; nothing while none is.

    Example:
        middle: {type: tags_cog, tags: [left, right]}
    """

    target = sdk.Out(PoseStamped, "target_pose", qos="command")

    @classmethod
    def ports(cls, config: TagsCogConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with the topic of the tags."""
        return super().ports(config) | {"seen": sdk.In(Detection3DArray, config.topic).named("seen")}

    def on_seen(self, message: Detection3DArray) -> None:
        """Publish the middle of those that count; one without a pose does not."""
        wanted = {*self.config.tags}
        chosen = [one for one in message.detections if not wanted or wanted & names_of(one)]
        placed = [one.bbox.center.position for one in chosen if one.results and one.results[0].hypothesis.score > 0.0]
        places = [(at.x, at.y, at.z) for at in placed]
        finite = [place for place in places if np.isfinite(place).all()]
        if finite:
            middle = np.mean(finite, axis=0).tolist()
            self.target(PoseStamped(message.header, Pose(Point(*middle))))
