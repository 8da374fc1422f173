"""Points the camera of a head at things, and follows a point with it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.config import Config
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Vector3
from rbxcompose.base.printable import plain
from rbxcompose.base.units import ANGLE, LENGTH, TIME
from rbxcompose.domains.arms.arm_config import ArmJointConfig
from rbxcompose.domains.arms.motion.gaze import NEAREST, Aiming, Gaze
from rbxcompose.domains.arms.motion.scene import SCENE_LIMITS
from rbxcompose.domains.arms.motion.scene_messages import placed_object
from rbxcompose.domains.arms.reasons import REASONS, GraspReason, MotionReason
from rbxcompose.domains.body.urdf import body_of
from rbxcompose.domains.servos.limits import MotionLimits
from rbxcompose.msgs.control_msgs import FollowJointTrajectory
from rbxcompose.msgs.geometry_msgs import PointStamped
from rbxcompose.msgs.rbxcompose_msgs import LookAtPoint, SceneObjects
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.stamps import to_duration
from rbxcompose.msgs.trajectory_msgs import JointTrajectory, JointTrajectoryPoint

LOOK, FOLLOW, SCENE, TARGET, STREAM = "look", "follow", "scene", "target", "stream"  # its ports
SETTLING = 3.0  # [s] in which joints, the scene and frames become known
CLOSE = math.radians(1)  # [rad] by which it may look past a point, unless a goal says otherwise
OUTCOMES = (*REASONS, str(GraspReason.UNKNOWN_OBJECT))
MEASURES = {**dict.fromkeys(("x", "y", "z"), LENGTH), "tolerance": ANGLE, "duration": TIME}
LookGoal = sdk.ServedGoal[LookAtPoint.Goal, LookAtPoint.Result, LookAtPoint.Feedback]
LATER = (MotionReason.UNKNOWN_START, MotionReason.UNKNOWN_SCENE)  # may be known soon


@dataclass(frozen=True, slots=True)
class NoAim:
    """Why a head cannot look at something."""

    reason: MotionReason | GraspReason
    text: str


class HeadConfig(Config):
    """A head, and the body that it is part of."""

    name: str
    """Its name, which begins the topic of its action."""
    skill: str
    """The name of its skill."""
    urdf: str
    """Text of the URDF of the whole body."""
    camera: str
    """The link that looks along its x."""
    joints: dict[str, ArmJointConfig] = Field(min_length=1)
    """The joints that turn the camera."""
    controller: str
    """The controller that leads them."""
    follow: str
    """The action of the controller."""
    stream: str = ""
    """The topic on which the controller takes trajectories; empty if it takes none."""
    sees_scene: bool = False
    """Whether the robot has a scene whose objects it can look at."""
    frames: tuple[str, ...] = ()
    """Frames outside of the body in which points may be."""


@sdk.component("head")
class Head(sdk.Component[HeadConfig]):
    """Turns a head so that its camera looks at a point, or at the middle of an object of the scene.

    The action is `NAME/look_at`. Points on the topic `NAME/target` are followed as they come. Where the head is, the
    rest of the body is: it may not collide on its way, so nothing is examined.

    Example:
        neck: {type: head, name: neck, skill: look_at, camera: face, controller: look,
          follow: look/follow_joint_trajectory, joints: {pan: {lower: -1, upper: 1}},
          urdf: '<robot name="neck"><link name="base"/><link name="face"/>
          <joint name="pan" type="revolute"><parent link="base"/><child link="face"/><axis xyz="0 0 1"/>
          <limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'}
    """

    made_by = "Each entry of `heads` runs one."
    rate = 20.0
    steps_for_goals = True
    joint_states = sdk.In(JointState, "joint_states", is_open=True)

    @classmethod
    def ports(cls, config: HeadConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports: its goals, those of its controller, the scene, and a look at each frame outside."""
        look: sdk.ServesAction[Any, Any, Any] = sdk.ServesAction(
            LookAtPoint,
            f"{config.name}/look_at",
            claims=config.controller,
            skill=config.skill,
            outcomes=dict.fromkeys(OUTCOMES, "failure"),
            measures=MEASURES,
        )
        found: dict[str, sdk.Port[Any]] = {
            LOOK: look.named(LOOK),
            FOLLOW: sdk.CallsAction(FollowJointTrajectory, config.follow).named(FOLLOW),
        }
        if config.sees_scene:
            found[SCENE] = sdk.In(SceneObjects, "scene", qos="latched", limits=SCENE_LIMITS).named(SCENE)
        if config.stream:
            topic = f"{config.name}/target"
            found[TARGET] = sdk.In(PointStamped, topic, qos="command", is_open=True, may_be_silent=True).named(TARGET)
            found[STREAM] = sdk.Out(JointTrajectory, config.stream).named(STREAM)
        root = body_of(config.urdf).root
        looks = {_look(frame): sdk.Looks(source=frame, target=root).named(_look(frame)) for frame in config.frames}
        return super().ports(config) | found | looks

    def configure(self) -> None:
        """Read the body."""
        self.body = body_of(self.config.urdf)
        limits = {name: MotionLimits(joint.lower, joint.upper) for name, joint in self.config.joints.items()}
        self.gaze = Gaze(self.body, self.config.camera, limits)
        self.positions: dict[str, float] = {}
        self.objects: Mapping[str, Vector3] | None = None  # middles in the frame of their links; None while unknown
        self.links: Mapping[str, str] = {}
        self.goal: LookGoal | None = None
        self.sent: sdk.SentGoal | None = None
        self.began, self.said = 0.0, ""

    @property
    def occupation(self) -> str:
        """Return that it moves."""
        return f"head {self.name} moves" if self.sent is not None else ""

    def on_joint_states(self, message: JointState) -> None:
        """Note where joints are."""
        self.positions.update(zip(message.name, message.position.tolist(), strict=False))

    def on_scene(self, message: SceneObjects) -> None:
        """Note where objects are."""
        placed = [placed_object(object_) for object_ in message.objects]
        self.objects = {object_.name: object_.pose.compose(object_.shape_pose).translation for object_ in placed}
        self.links = {object_.name: object_.link for object_ in placed}

    def on_target(self, message: PointStamped) -> None:
        """Look at a point that moves; goals come first."""
        at = message.point
        found = self.aimed((at.x, at.y, at.z), message.header.frame_id) if self.goal is None else None
        self.said, before = found.text if isinstance(found, NoAim) else "", self.said
        if self.said and self.said != before:
            self.warn(f"a target is not followed: {self.said}")
        if isinstance(found, Aiming):
            self.bound[STREAM](trajectory(found, 0.0))

    def accept_look(self, goal: LookAtPoint.Goal) -> str:
        """Refuse what is no goal."""
        if not all(map(math.isfinite, (goal.x, goal.y, goal.z, goal.tolerance, goal.duration))):
            return "the goal is not finite"
        return "its tolerance and its duration are not below 0" if min(goal.tolerance, goal.duration) < 0.0 else ""

    def step(self, dt: float) -> None:
        """Begin with a new goal; end one that was cancelled."""
        goal = self.bound[LOOK].current
        if goal is not self.goal:
            self.let_go()
            self.goal, self.began = goal, self.now
        if goal is None:
            return
        if goal.cancel_requested:
            self.let_go()
            goal.canceled(LookAtPoint.Result(outcome=MotionReason.INTERRUPTED, message="it was cancelled"))
            self.goal = None
        elif self.sent is None:
            self.begin(goal)
        else:
            goal.feedback(LookAtPoint.Feedback(angle=self.past(goal.request)))

    def begin(self, goal: LookGoal) -> None:
        """Send the head to where it looks at the point, or report why it cannot."""
        found = self.aim(goal.request)
        if isinstance(found, Aiming) and found.angle > (most := goal.request.tolerance or CLOSE):
            words = ", ".join(f"'{name}'" for name in found.blocked) or "its joints"
            text = f"it would look {math.degrees(found.angle):.1f} deg past it, more than {math.degrees(most):.1f} deg"
            found = NoAim(MotionReason.GOAL_OUT_OF_REACH, f"{text}: {words} can go no farther")
        if isinstance(found, Aiming):
            wanted = FollowJointTrajectory.Goal(trajectory=trajectory(found, goal.request.duration))
            self.sent = self.bound[FOLLOW](wanted, lambda end: self.arrived(goal, end))
        elif found.reason not in LATER or self.now - self.began >= SETTLING:
            self.fail(goal, found)

    def arrived(self, goal: LookGoal, end: sdk.Ended[FollowJointTrajectory.Result]) -> None:
        """End the goal with the motion, if it is still wanted."""
        if goal is not self.goal:
            return
        self.sent = None
        if end.outcome is sdk.Outcome.SUCCEEDED:
            self.goal = None
            goal.succeeded(LookAtPoint.Result(angle=self.past(goal.request)))
        else:
            said = end.result.error_string if end.result is not None else ""
            text = said or end.message or f"its trajectory was {end.outcome}"
            self.fail(goal, NoAim(MotionReason.NOT_FOLLOWED, text))

    def fail(self, goal: LookGoal, failure: NoAim) -> None:
        """End the goal."""
        self.goal = None
        result = LookAtPoint.Result(outcome=failure.reason, message=failure.text)
        goal.aborted(f"{failure.reason}: {failure.text}", result)

    def let_go(self) -> None:
        """Let the head come to rest."""
        sent, self.sent, self.goal = self.sent, None, None
        if sent is not None:
            sent.cancel()

    # Where points are

    def aim(self, request: LookAtPoint.Goal) -> Aiming | NoAim:
        """Return how to look at what a goal names."""
        point = self.point_of(request)
        return point if isinstance(point, NoAim) else self.aimed(*point)

    def past(self, request: LookAtPoint.Goal) -> float:
        """Return by how much the camera looks past what a goal names now [rad]; nan if that is unknown."""
        found = self.point_of(request)
        point = found if isinstance(found, NoAim) else self.in_root(*found)
        return math.nan if isinstance(point, NoAim) else self.gaze.angle(point, self.positions)

    def point_of(self, request: LookAtPoint.Goal) -> tuple[Vector3, str] | NoAim:
        """Return a point, and its frame."""
        if not request.object:
            return (request.x, request.y, request.z), request.frame
        if self.objects is None:
            why = "no planning scene has been received" if self.config.sees_scene else "this robot has no scene"
            return NoAim(MotionReason.UNKNOWN_SCENE, why)
        if request.object not in self.objects:
            there = ", ".join(sorted(self.objects)) or "none"
            text = f"there is no object '{request.object}' in the scene; there: {there}"
            return NoAim(GraspReason.UNKNOWN_OBJECT, text)
        return self.objects[request.object], self.links[request.object]

    def aimed(self, point: Vector3, frame: str) -> Aiming | NoAim:
        """Return how to look at a point of a frame."""
        there = self.in_root(point, frame)
        if isinstance(there, NoAim):
            return there
        if missing := [name for name in self.config.joints if name not in self.positions]:
            return NoAim(MotionReason.UNKNOWN_START, f"nothing has reported where '{missing[0]}' is")
        if self.gaze.distance(there, self.positions) < NEAREST:
            return NoAim(MotionReason.GOAL_OUT_OF_REACH, "the point is within the camera")
        return self.gaze.aimed(there, self.positions)

    def in_root(self, point: Vector3, frame: str) -> Vector3 | NoAim:
        """Return where a point of a frame is in the body's root."""
        if not all(map(math.isfinite, point)):
            return NoAim(MotionReason.UNKNOWN_GOAL, "the point is not finite")
        if not frame or frame in self.body.links:
            return self.body.poses(self.positions)[frame or self.body.root].apply(point)
        if frame not in self.config.frames:
            known = f"; frames outside of the body: {', '.join(self.config.frames)}" if self.config.frames else ""
            return NoAim(MotionReason.UNKNOWN_GOAL, f"there is no link '{plain(frame)}'{known}")
        try:
            return self.bound[_look(frame)].transform().apply(point)  # type: ignore[no-any-return]
        except LookupError as error:
            return NoAim(MotionReason.UNKNOWN_SCENE, str(error))


def trajectory(aim: Aiming, duration: float) -> JointTrajectory:
    """Return the way to an aim; a duration of 0 s is as fast as the joints can."""
    positions = np.array([*aim.positions.values()])
    point = JointTrajectoryPoint(positions=positions, time_from_start=to_duration(duration))
    return JointTrajectory(joint_names=tuple(aim.positions), points=(point,))


def _look(frame: str) -> str:
    return f"in_{frame}"
