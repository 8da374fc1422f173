"""Leads the tip of an arm, and perhaps a head, after a point that somebody tells.

The four distances are those of `arm_tracker` in "ROS By Example, Volume 2" by R. Patrick Goebel. Points are in the
frame of the link that carries the arm, lengths in [m], times are robot time [s].
"""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Any

from rbxcompose import sdk
from rbxcompose.base.geometry import Quaternion, Transform3, Vector3, quaternion_from_rpy
from rbxcompose.base.printable import plain
from rbxcompose.base.units import TIME
from rbxcompose.msgs.geometry_msgs import Point, PointStamped, PoseStamped
from rbxcompose.msgs.poses import pose_message
from rbxcompose.msgs.rbxcompose_msgs import FollowPoint, MoveArm
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.msgs.std_msgs import Header


class Chase(StrEnum):
    """What an arm does while it follows a point."""

    WAITING = "waiting"  # no point has come yet, or lately
    FOLLOWING = "following"
    THERE = "there"
    FAR = "far"  # the point is beyond what the arm cares for: it rests


class ArmTrackerConfig(sdk.Config):
    """An arm, the point that it follows, and the distances; lengths in [m]."""

    name: str
    """Its name, which begins the topic of its action."""
    arm: str
    """The arm."""
    controller: str
    """The controller of the arm."""
    base: str
    """The link that carries the arm."""
    tip: str
    """The link at its end."""
    shoulder: tuple[float, float, float]
    """Where the arm begins, in the frame of its base."""
    target: str
    """The topic with the point."""
    frame: str
    """The frame in which the point is told."""
    rest: str = ""
    """The pose to which the arm goes when the point is too far away; empty if it stays where it is."""
    head: str = ""
    """The head that looks at the point; empty if none does."""
    length: float
    """How far the arm reaches from its shoulder."""
    share: float = 0.9
    """How much of that it uses."""
    moved: float = 0.01
    """A point that moved by less is where it was."""
    close: float = 0.025
    """The tip is there when it is nearer than this."""
    farthest: float = 1.2
    """Beyond this the arm rests."""


class Pursuit:
    """Follows a point; `shoulder` is where the arm begins."""

    def __init__(self, settings: ArmTrackerConfig, now: float) -> None:
        self.state, self.goal, self.distance = Chase.WAITING, settings.shoulder, math.inf
        self._settings, self._shoulder = settings, settings.shoulder
        self._seen: Vector3 | None = None
        self._at = now

    def see(self, now: float, point: Vector3) -> None:
        """Take where the point is now."""
        self._at = now
        if self._seen is None or math.dist(self._seen, point) >= self._settings.moved:
            self._seen = point
            self.goal = self._within(point)
            self.state = Chase.FAR if math.dist(point, self._shoulder) > self._settings.farthest else Chase.FOLLOWING

    def is_lost(self, now: float, patience: float) -> bool:
        """Return whether no point has come for so long."""
        return now - self._at > patience

    def next(self, tip: Vector3) -> tuple[Vector3, Quaternion] | None:
        """Return where the tip should go, pointing away from the shoulder; None if it should not move."""
        self.distance = math.dist(tip, self.goal)
        if self.state is not Chase.FOLLOWING:
            return None
        if self.distance <= self._settings.close:
            self.state = Chase.THERE
            return None
        x, y, z = (to - at for to, at in zip(self.goal, self._shoulder, strict=True))
        return self.goal, quaternion_from_rpy(0.0, -math.atan2(z, math.hypot(x, y)), math.atan2(y, x))

    def _within(self, point: Vector3) -> Vector3:
        """Return the point, or the one in its direction that is as far as the arm should reach."""
        away = math.dist(point, self._shoulder)
        share = min(1.0, self._settings.share * self._settings.length / max(away, 1e-9))
        x, y, z = (at + (to - at) * share for to, at in zip(point, self._shoulder, strict=True))
        return (x, y, z)


FOLLOW, TARGET, POSE, REST, HEAD = "follow", "target", "pose", "rest", "head"  # its ports
SEEN, TIP = "seen", "tip"  # its looks
PATIENCE = 2.0  # [s] without a point, unless a goal says otherwise
LOST = "lost"


@sdk.component("arm_tracker")
class ArmTracker(sdk.Component[ArmTrackerConfig]):
    """Follows a point with the tip of an arm, as long as a goal of its action `NAME/follow` lasts.

    The tip points away from the shoulder. The arm slows down and stops for what it would hit, as it does when somebody
    leads it by hand. Points are followed until none has come for a while: then the goal fails with `lost`.

    Example:
        chase: {type: arm_tracker, name: chase, arm: neck, controller: look, base: base, tip: face, target: point,
          shoulder: [0, 0, 0], frame: camera, length: 0.4}
    """

    made_by = "Each entry of `trackers` runs one."
    rate = 20.0
    steps_for_goals = True

    @classmethod
    def ports(cls, config: ArmTrackerConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports: its goals, the point, those of the arm and of the head."""
        found: dict[str, sdk.Port[Any]] = {
            FOLLOW: sdk.ServesAction(
                FollowPoint,
                f"{config.name}/follow",
                claims=config.controller,
                skill=f"follow_{config.name}",
                outcomes={LOST: "failure"},
                measures={"patience": TIME},
            ),
            TARGET: sdk.In(PointStamped, config.target, qos="command", is_open=True, may_be_silent=True),
            POSE: sdk.Out(PoseStamped, f"{config.arm}/servo/pose", qos="command"),
            SEEN: sdk.Looks(source=config.frame, target=config.base),
            TIP: sdk.Looks(source=config.tip, target=config.base),
        }
        if config.rest:
            found[REST] = sdk.CallsAction(MoveArm, f"{config.arm}/move")
        if config.head:
            found[HEAD] = sdk.Out(PointStamped, f"{config.head}/target", qos="command")
        return {name: port.named(name) for name, port in found.items()}

    def configure(self) -> None:
        """Follow nothing yet."""
        self.goal: sdk.ServedGoal[FollowPoint.Goal, FollowPoint.Result, FollowPoint.Feedback] | None = None
        self.resting: sdk.SentGoal | None = None
        self.rests = self.is_moving = False  # it was sent to where it rests, and is on its way
        self.problem = ""

    def accept_follow(self, goal: FollowPoint.Goal) -> str:
        """Refuse what is no time."""
        return "" if 0.0 <= goal.patience < math.inf else "its patience is not finite, or below 0"

    def on_target(self, message: PointStamped) -> None:
        """Note where the point is."""
        if self.goal is None:
            return
        frame, at = message.header.frame_id, message.point
        problem = ""
        if frame not in ("", self.config.frame):
            problem = f"the point is in '{plain(frame)}', and expected in '{self.config.frame}'"
        elif not all(map(math.isfinite, (at.x, at.y, at.z))):
            problem = "the point is not finite"
        else:
            try:
                sent = to_nanoseconds(message.header.stamp)
                point: Vector3 = self.bound[SEEN].transform(at=sent or None).apply((at.x, at.y, at.z))
            except LookupError as error:
                problem = str(error)
        if problem and problem != self.problem:
            self.warn(f"a point is left out: {problem}")
        self.problem = problem
        if not problem:
            self.core.see(self.now, point)
            if self.config.head:
                x, y, z = point
                header = Header(frame_id=self.config.base)
                self.bound[HEAD](PointStamped(header=header, point=Point(x=x, y=y, z=z)))

    def step(self, dt: float) -> None:
        """Lead the arm for one cycle."""
        goal = self.bound[FOLLOW].current
        if goal is not self.goal:
            self.end()
            self.goal, self.began = goal, self.now
            self.core = Pursuit(self.config, self.now)
        if goal is None:
            return
        patience = goal.request.patience or PATIENCE
        if goal.cancel_requested:
            self.end()
            goal.canceled()
        elif self.core.is_lost(self.now, patience):
            self.end()
            text = self.problem or f"no point has come on '{self.config.target}' for {patience:g} s"
            goal.aborted(f"{LOST}: {text}", FollowPoint.Result(outcome=LOST, message=text))
        else:
            self.lead()
            goal.feedback(FollowPoint.Feedback(state=self.core.state, distance=self.core.distance))

    def lead(self) -> None:
        """Command the arm, or let it rest."""
        try:
            tip = self.bound[TIP].transform().translation
        except LookupError:
            return  # nothing has reported where the arm is
        wanted = self.core.next(tip)
        if self.core.state is Chase.FAR and self.config.rest:
            if not self.rests:
                self.rests = self.is_moving = True
                self.resting = self.bound[REST](MoveArm.Goal(pose=self.config.rest), self.rested)
        elif self.is_moving:
            self.let_go()  # commands count when that has ended
        elif wanted is not None:
            self.rests = False
            pose = pose_message(Transform3(*wanted))
            self.bound[POSE](PoseStamped(header=Header(frame_id=self.config.base), pose=pose))

    def rested(self, end: sdk.Ended[MoveArm.Result]) -> None:
        """Know that the arm moves no more, and log why it did not go where it rests."""
        self.is_moving, self.resting = False, None
        if end.outcome not in (sdk.Outcome.SUCCEEDED, sdk.Outcome.CANCELED):
            self.warn(f"the arm does not go to '{self.config.rest}': {end.message}")

    def let_go(self) -> None:
        """End the motion of the arm to where it rests; commands by hand end by themselves."""
        sent, self.resting, self.rests = self.resting, None, False
        if sent is not None:
            sent.cancel()

    def end(self) -> None:
        """Follow nothing any more."""
        self.let_go()
        self.goal = None
