"""The transform tree of one process, kept from the bus, and look-ups in it."""

from __future__ import annotations

from dataclasses import dataclass

from rbxcompose.body.transforms import TransformTree
from rbxcompose.bus.bus import Bus
from rbxcompose.clock import Clock
from rbxcompose.geometry import Pose2, Transform3
from rbxcompose.msgs.geometry_msgs import TransformStamped
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.qos import Qos


@dataclass(frozen=True, slots=True)
class Lookup:
    """The newest pose of frame `source` in frame `target`."""

    tree: TransformTree
    target: str
    source: str

    def now(self) -> Pose2 | None:
        """Return the pose [m, m, rad], or None while the frames are not connected."""
        found = self.tree.lookup(self.target, self.source)
        return found.to_pose2() if found else None


class Frames:
    """Feeds a transform tree from `/tf` and `/tf_static`."""

    def __init__(self, owner: str, bus: Bus, clock: Clock) -> None:
        self.tree = TransformTree()
        self._clock = clock
        bus.subscribe(owner, "/tf", TFMessage, Qos.STATE, lambda message: self._take(message, static=False))
        bus.subscribe(owner, "/tf_static", TFMessage, Qos.LATCHED, lambda message: self._take(message, static=True))

    def _take(self, message: TFMessage, *, static: bool) -> None:
        for one in message.transforms:
            self.tree.set(
                one.header.frame_id, one.child_frame_id, _transform(one), stamp=self._clock.now(), static=static
            )


def _transform(message: TransformStamped) -> Transform3:
    at, turn = message.transform.translation, message.transform.rotation
    return Transform3((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w))
