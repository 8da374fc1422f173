"""Leads the tip of an arm, and perhaps a head, after a point that somebody tells."""

from __future__ import annotations

import math
from typing import Any

from rbxcompose import sdk
from rbxcompose.base.geometry import Transform3, Vector3
from rbxcompose.base.printable import plain
from rbxcompose.base.units import TIME
from rbxcompose.domains.arms.motion.pursuit import Chase, Pursuit, PursuitSettings
from rbxcompose.msgs.geometry_msgs import Point, PointStamped, PoseStamped
from rbxcompose.msgs.poses import pose_message
from rbxcompose.msgs.rbxcompose_msgs import FollowPoint, MoveArm
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.msgs.std_msgs import Header

FOLLOW, TARGET, POSE, REST, HEAD = "follow", "target", "pose", "rest", "head"  # its ports
SEEN, TIP = "seen", "tip"  # its looks
PATIENCE = 2.0  # [s] without a point, unless a goal says otherwise
LOST = "lost"


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
        follow: sdk.ServesAction[Any, Any, Any] = sdk.ServesAction(
            FollowPoint,
            f"{config.name}/follow",
            claims=config.controller,
            skill=f"follow_{config.name}",
            outcomes={LOST: "failure"},
            measures={"patience": TIME},
        )
        found: dict[str, sdk.Port[Any]] = {
            FOLLOW: follow.named(FOLLOW),
            TARGET: sdk.In(PointStamped, config.target, qos="command", is_open=True, may_be_silent=True).named(TARGET),
            POSE: sdk.Out(PoseStamped, f"{config.arm}/servo/pose", qos="command").named(POSE),
            SEEN: sdk.Looks(source=config.frame, target=config.base).named(SEEN),
            TIP: sdk.Looks(source=config.tip, target=config.base).named(TIP),
        }
        if config.rest:
            found[REST] = sdk.CallsAction(MoveArm, f"{config.arm}/move").named(REST)
        if config.head:
            found[HEAD] = sdk.Out(PointStamped, f"{config.head}/target", qos="command").named(HEAD)
        return found

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
            one = self.config
            settings = PursuitSettings(one.length, one.share, one.moved, one.close, one.farthest)
            self.core = Pursuit(settings, one.shoulder, self.now)
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
