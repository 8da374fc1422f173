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

    frames: Frames
    target: str
    source: str

    def now(self) -> Pose2 | None:
        """Return the pose [m, m, rad], or None while the frames are not connected."""
        found = self.frames.lookup(self.target, self.source)
        return found.to_pose2() if found else None


class Frames:
    """Feeds a transform tree from `/tf` and `/tf_static`.

    Poses are published often and looked up rarely. In real time, the process is not woken for each of them: they are
    taken when somebody looks one up. On any other clock it is, so that the order of events at an instant is the same in
    each run.
    """

    def __init__(self, owner: str, bus: Bus, clock: Clock, *, is_patient: bool) -> None:
        self.tree = TransformTree()
        self._clock = clock
        self._moving = bus.subscribe(owner, "/tf", TFMessage, Qos.STATE, self._move, is_patient=is_patient)
        bus.subscribe(owner, "/tf_static", TFMessage, Qos.LATCHED, self._fix)

    def lookup(self, target: str, source: str) -> Transform3 | None:
        """Return the newest pose of frame `source` in frame `target`, or None while they are not connected."""
        self._moving.catch_up()
        return self.tree.lookup(target, source)

    def hurry(self) -> None:
        """Take each pose when it arrives: another thread looks them up and must not take them itself."""
        self._moving.hurry()

    def _fix(self, message: TFMessage) -> None:
        self._take(message, self._clock.now(), static=True)

    def _move(self, message: TFMessage) -> None:
        self._take(message, self._clock.now() - self._moving.age, static=False)

    def _take(self, message: TFMessage, stamp: float, *, static: bool) -> None:
        for one in message.transforms:
            self.tree.set(one.header.frame_id, one.child_frame_id, _transform(one), stamp=stamp, static=static)


def _transform(message: TransformStamped) -> Transform3:
    at, turn = message.transform.translation, message.transform.rotation
    return Transform3((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w))
