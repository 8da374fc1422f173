"""The transform tree of one process, kept from the bus, and look-ups in it."""

from __future__ import annotations

import threading
from collections.abc import Callable

from rbxcompose.body.transform_errors import TransformError
from rbxcompose.body.transforms import TransformAnswer, TransformTree
from rbxcompose.bus.bus import Bus
from rbxcompose.clock import NANOSECONDS, Clock
from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import Pose2, Transform3
from rbxcompose.levels import Level
from rbxcompose.msgs.geometry_msgs import TransformStamped
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.printable import plain
from rbxcompose.qos import Qos

MOST_TOLD = 20  # things about transforms that are logged


@dataclass(frozen=True, slots=True)
class Lookup:
    """The pose of frame `source` in frame `target`, newest or at a time."""

    frames: Frames
    target: str
    source: str

    def now(self) -> Pose2 | None:
        """Return the pose [m, m, rad], or None while the frames are not connected."""
        found = self.frames.lookup(self.target, self.source)
        return found.to_pose2() if found else None

    def transform(self, *, at: int | None = None) -> Transform3:
        """Return the newest pose, or that at a stamp [ns], interpolated.

        Raises:
            LookupError: if there is none; the text names the frames or the times that there are.
        """
        return self.frames.transform(self.target, self.source, at)


class Frames:
    """Feeds a transform tree from `/tf` and `/tf_static`.

    Poses are published often and looked up rarely. In real time, the process is not woken for each of them: they are
    taken when somebody looks one up. On any other clock it is, so that the order of events at an instant is the same in
    each run.
    """

    def __init__(
        self, owner: str, bus: Bus, clock: Clock, *, is_patient: bool, log: Callable[[Level, str], None]
    ) -> None:
        self.tree = TransformTree()
        self._clock, self._log = clock, log
        self._told: set[str] = set()
        self._lock = threading.Lock()  # who looks back from another thread must not see a history that changes
        self._moving = bus.subscribe(owner, "/tf", TFMessage, Qos.STATE, self._move, is_patient=is_patient)
        bus.subscribe(owner, "/tf_static", TFMessage, Qos.LATCHED, self._fix)

    def lookup(self, target: str, source: str) -> Transform3 | None:
        """Return the newest pose of frame `source` in frame `target`, or None while they are not connected."""
        self._moving.catch_up()
        return self.tree.lookup(target, source)

    def transform(self, target: str, source: str, at: int | None = None) -> Transform3:
        """Return the newest pose of frame `source` in frame `target`, or that at a stamp [ns].

        Raises:
            TransformError: if there is none.
        """
        self._moving.catch_up()
        with self._lock:
            found = self.tree.lookup(target, source) if at is None else self.tree.lookup_at(target, source, at)
            if found is None:
                raise self.tree.problem(target, source) or TransformError(f"'{source}' has no pose in '{target}'")
        return found

    def hurry(self) -> None:
        """Take each pose when it arrives: another thread looks them up and must not take them itself."""
        self._moving.hurry()

    def _fix(self, message: TFMessage) -> None:
        self._take(message, 0.0, static=True)

    def _move(self, message: TFMessage) -> None:
        self._take(message, self._moving.age, static=False)

    def _take(self, message: TFMessage, age: float, *, static: bool) -> None:
        received, unstamped = self._clock.now() - age, self._clock.stamp() - round(age * NANOSECONDS)
        with self._lock:
            for one in message.transforms:
                time = to_nanoseconds(one.header.stamp) or unstamped
                parent, child, pose = one.header.frame_id, one.child_frame_id, _transform(one)
                answer = self.tree.set(parent, child, pose, stamp=received, static=static, measured=time)
                if answer.message:
                    self._tell(answer)

    def _tell(self, answer: TransformAnswer) -> None:
        """Log once what is unusual about a transform; after very many such, nothing more."""
        text = plain(answer.message)
        if text in self._told or len(self._told) == MOST_TOLD:
            return
        self._told.add(text)
        if answer.accepted:
            self._log(Level.OK, text)
        else:
            self._log(Level.WARN, f"a transform is refused: {text}")


def _transform(message: TransformStamped) -> Transform3:
    at, turn = message.transform.translation, message.transform.rotation
    return Transform3((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w))
