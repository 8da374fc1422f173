"""Points the camera of a head at things, and follows what moves with it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.arrays import np
from rbxcompose.base.config import Config
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Vector3
from rbxcompose.base.printable import plain
from rbxcompose.base.units import ANGLE, LENGTH, TIME
from rbxcompose.domains.arms.arm_config import ArmJointConfig
from rbxcompose.domains.arms.motion.gaze import NEAREST, Aiming, Gaze, HeadTracker
from rbxcompose.domains.arms.motion.scene import SCENE_LIMITS
from rbxcompose.domains.arms.motion.scene_messages import placed_object
from rbxcompose.domains.arms.reasons import REASONS, GraspReason, MotionReason
from rbxcompose.domains.arms.section_models import HeadTracking
from rbxcompose.domains.body.urdf import body_of
from rbxcompose.domains.servos.limits import MotionLimits
from rbxcompose.msgs.control_msgs import FollowJointTrajectory, PointHead
from rbxcompose.msgs.geometry_msgs import Point, PointStamped, PoseStamped
from rbxcompose.msgs.rbxcompose_msgs import LookAtPoint, SceneObjects
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.stamps import to_duration, to_seconds, to_time
from rbxcompose.msgs.trajectory_msgs import JointTrajectory, JointTrajectoryPoint

LOOK, POINT, FOLLOW, SCENE, STREAM = "look", "point", "follow", "scene", "stream"  # its ports
TARGET, POSE = "target", "pose"
STATIONARY = 1.5  # times as fast as on average is a joint in the middle of a motion from rest to rest
SETTLING = 3.0  # [s] in which joints, the scene and frames become known
CLOSE = math.radians(1)  # [rad] by which it may look past a point, unless a goal says otherwise
OUTCOMES = (*REASONS, str(GraspReason.UNKNOWN_OBJECT))
MEASURES = {**dict.fromkeys(("x", "y", "z"), LENGTH), "tolerance": ANGLE, "duration": TIME}
HeadGoal = sdk.ServedGoal[Any, Any, Any]  # of `look_at` or of `point_head`
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
    tracks: HeadTracking = HeadTracking()
    """What it follows by itself."""


@sdk.component("head")
class Head(sdk.Component[HeadConfig]):
    """Turns a head so that its camera looks at a point, or at the middle of an object of the scene.

    The actions are `NAME/look_at`, and `NAME/point_head` as in `control_msgs`. Without a goal it follows points on the
    topic `NAME/target`, or what `tracks` says. Where the head is, the rest of the body is: it may not collide on its
    way, so nothing is examined.

    Example:
        neck: {type: head, name: neck, skill: look_at, camera: face, controller: look,
          follow: look/follow_joint_trajectory, joints: {pan: {lower: -1, upper: 1}},
          urdf: '<robot name="neck"><link name="base"/><link name="face"/>
          <joint name="pan" type="revolute"><parent link="base"/><child link="face"/><axis xyz="0 0 1"/>
          <limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'}
    """

    made_by = "Each entry of `heads` runs one."
    rate = 20.0
    joint_states = sdk.In(JointState, "joint_states", is_open=True)

    @classmethod
    def ports(cls, config: HeadConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports: its goals, those of its controller, the scene, and a look at each frame outside."""
        found: dict[str, sdk.Port[Any]] = {
            LOOK: sdk.ServesAction(
                LookAtPoint,
                f"{config.name}/look_at",
                claims=config.controller,
                skill=config.skill,
                outcomes=dict.fromkeys(OUTCOMES, "failure"),
                measures=MEASURES,
            ),
            POINT: sdk.ServesAction(PointHead, f"{config.name}/point_head", claims=config.controller, skill=None),
            FOLLOW: sdk.CallsAction(FollowJointTrajectory, config.follow),
        }
        if config.sees_scene:
            found[SCENE] = sdk.In(SceneObjects, "scene", qos="latched", limits=SCENE_LIMITS)
        if config.stream:
            topic = f"{config.name}/target"
            found[TARGET] = sdk.In(PointStamped, topic, qos="command", is_open=True, may_be_silent=True)
            found[STREAM] = sdk.Out(JointTrajectory, config.stream)
            if (poses := config.tracks.topic) is not None:
                found[POSE] = sdk.In(PoseStamped, poses, qos="command", may_be_silent=True)
        root = body_of(config.urdf).root
        found |= {_look(frame): sdk.Looks(source=frame, target=root) for frame in config.frames}
        return super().ports(config) | {name: port.named(name) for name, port in found.items()}

    def configure(self) -> None:
        """Read the body."""
        self.body = body_of(self.config.urdf)
        self.limits = {name: MotionLimits(joint.lower, joint.upper) for name, joint in self.config.joints.items()}
        self.gaze = Gaze(self.body, self.config.camera, self.limits)
        self.tracker = HeadTracker(self.limits)
        self.positions: dict[str, float] = {}
        self.objects: Mapping[str, Vector3] | None = None  # middles in the frame of their links; None while unknown
        self.links: Mapping[str, str] = {}
        self.goal: HeadGoal | None = None
        self.aimer = self.gaze  # of the goal
        self.sent: sdk.SentGoal | None = None
        self.began, self.said = 0.0, ""
        self.watched: int | None = None  # when the frame that it follows was seen last [ns]

    @property
    def occupation(self) -> str:
        """Return that it moves."""
        return f"head {self.config.name} moves" if self.sent is not None else ""

    def on_joint_states(self, message: JointState) -> None:
        """Note where joints are."""
        self.positions.update(zip(message.name, message.position.tolist(), strict=False))

    def on_scene(self, message: SceneObjects) -> None:
        """Note where objects are."""
        placed = [placed_object(object_) for object_ in message.objects]
        self.objects = {object_.name: object_.pose.compose(object_.shape_pose).translation for object_ in placed}
        self.links = {object_.name: object_.link for object_ in placed}

    def on_target(self, message: PointStamped) -> None:
        """Follow a point; goals come first."""
        self.see((message.point.x, message.point.y, message.point.z), message.header.frame_id)

    def on_pose(self, message: PoseStamped) -> None:
        """Follow where a pose is."""
        at = message.pose.position
        self.see((at.x, at.y, at.z), message.header.frame_id)

    def see(self, point: Vector3, frame: str, time: float | None = None) -> None:
        """Follow a point of a frame, which was there at a time [s], or is now."""
        found = self.aimed(point, frame)
        self.said, before = found.text if isinstance(found, NoAim) else "", self.said
        if self.said and self.said != before:
            self.warn(f"a target is not followed: {self.said}")
        if isinstance(found, Aiming):
            self.tracker.see(found.positions, self.now if time is None else time)

    def watch_frame(self) -> None:
        """Follow a frame, from where the body was when it was seen: what sees it may move with the head."""
        look = self.bound[_look(self.config.tracks.frame)]
        try:
            stamp = look.newest()
            at = look.transform(at=stamp).translation
        except LookupError:
            return  # it was never seen
        if stamp is None or stamp != self.watched:
            self.watched = stamp
            self.see(at, "", None if stamp is None else self.time_of(to_time(stamp)))

    def track(self, dt: float) -> None:
        """Send the joints after what is followed, if there is no goal."""
        tracks = self.config.tracks
        if tracks.frame and not self.body.links.keys() & {tracks.frame}:
            self.watch_frame()
        elif tracks.frame:
            self.see((0.0, 0.0, 0.0), tracks.frame)
        if not self.limits.keys() <= self.positions.keys():
            return
        told = self.tracker.update(tracks, self.now, dt, self.positions)
        if told is not None:
            self.bound[STREAM](trajectory(told, 0.0))

    def accept_look(self, goal: LookAtPoint.Goal) -> str:
        """Refuse what is no goal."""
        if not all(map(math.isfinite, (goal.x, goal.y, goal.z, goal.tolerance, goal.duration))):
            return "the goal is not finite"
        return "its tolerance and its duration must not be below 0" if min(goal.tolerance, goal.duration) < 0.0 else ""

    def accept_point(self, goal: PointHead.Goal) -> str:
        """Refuse what is no goal, and a frame that the head does not turn."""
        at, axis = goal.target.point, goal.pointing_axis
        if not all(map(math.isfinite, (at.x, at.y, at.z, axis.x, axis.y, axis.z, goal.max_velocity))):
            return "the goal is not finite"
        frame = goal.pointing_frame or self.config.camera
        if frame not in self.body.links:
            return f"there is no link '{plain(frame)}' that could point"
        turned = {joint.name for joint in self.body.joints_above(frame)}
        if not turned & self.limits.keys():
            return f"the head does not turn '{plain(frame)}'"
        return "its velocity must not be below 0" if goal.max_velocity < 0.0 else ""

    def step(self, dt: float) -> None:
        """Begin with a new goal; end one that was cancelled; follow what moves if there is none."""
        goal = self.newest()
        if goal is not self.goal:
            self.let_go()
            self.goal, self.began = goal, self.now
            self.aimer = self.aimer_of(goal.request) if goal is not None else self.gaze
        if goal is None:
            if STREAM in self.bound:
                self.track(dt)
            return
        if goal.cancel_requested:
            self.let_go()
            if isinstance(goal.request, LookAtPoint.Goal):
                goal.canceled(LookAtPoint.Result(outcome=MotionReason.INTERRUPTED, message="it was cancelled"))
            else:
                goal.canceled()
            self.goal = None
        elif self.sent is None:
            self.begin(goal)
        else:
            angle = self.past(goal.request)
            look = isinstance(goal.request, LookAtPoint.Goal)
            goal.feedback(LookAtPoint.Feedback(angle=angle) if look else PointHead.Feedback(pointing_angle_error=angle))

    def newest(self) -> HeadGoal | None:
        """Return the goal to work at: of two, the newer one, which ends the other."""
        ends: tuple[HeadGoal | None, ...] = (self.bound[LOOK].current, self.bound[POINT].current)
        current = [one for one in ends if one is not None]
        if len(current) == 2:
            old = self.goal if self.goal in current else current[1]
            if old is not None:
                old.aborted("replaced by a newer goal")
                current.remove(old)
        return current[0] if current else None

    def aimer_of(self, request: LookAtPoint.Goal | PointHead.Goal) -> Gaze:
        """Return what aims for a goal: the camera along x, or another link along an axis."""
        if isinstance(request, LookAtPoint.Goal):
            return self.gaze
        axis = (request.pointing_axis.x, request.pointing_axis.y, request.pointing_axis.z)
        length = math.hypot(*axis)
        unit = (axis[0] / length, axis[1] / length, axis[2] / length) if length else (1.0, 0.0, 0.0)
        frame = request.pointing_frame or self.config.camera
        above = {joint.name for joint in self.body.joints_above(frame)}
        limits = {name: one for name, one in self.limits.items() if name in above}
        return Gaze(self.body, frame, limits, unit)

    def begin(self, goal: HeadGoal) -> None:
        """Send the head to where it looks at the point, or report why it cannot."""
        request = goal.request
        found = self.aim(request)
        most = (request.tolerance if isinstance(request, LookAtPoint.Goal) else 0.0) or CLOSE
        if isinstance(found, Aiming) and found.angle > most:
            words = ", ".join(f"'{name}'" for name in found.blocked) or "its joints"
            text = f"it would look {math.degrees(found.angle):.1f} deg past it, more than {math.degrees(most):.1f} deg"
            found = NoAim(MotionReason.GOAL_OUT_OF_REACH, f"{text}: {words} can go no farther")
        if isinstance(found, Aiming):
            wanted = FollowJointTrajectory.Goal(trajectory=trajectory(found.positions, self.duration(request, found)))
            self.sent = self.bound[FOLLOW](wanted, lambda end: self.arrived(goal, end))
        elif found.reason not in LATER or self.now - self.began >= SETTLING:
            self.fail(goal, found)

    def duration(self, request: LookAtPoint.Goal | PointHead.Goal, aim: Aiming) -> float:
        """Return how long a motion shall take [s]; 0 is as short as possible."""
        if isinstance(request, LookAtPoint.Goal):
            return request.duration
        farthest = max(abs(to - self.positions[name]) for name, to in aim.positions.items())
        at_least = STATIONARY * farthest / request.max_velocity if request.max_velocity else 0.0
        return max(to_seconds(request.min_duration), at_least)

    def arrived(self, goal: HeadGoal, end: sdk.Ended[FollowJointTrajectory.Result]) -> None:
        """End the goal with the motion, if it is still wanted."""
        if goal is not self.goal:
            return
        self.sent = None
        if end.outcome is sdk.Outcome.SUCCEEDED:
            self.goal = None
            look = isinstance(goal.request, LookAtPoint.Goal)
            goal.succeeded(LookAtPoint.Result(angle=self.past(goal.request)) if look else PointHead.Result())
        else:
            said = end.result.error_string if end.result is not None else ""
            text = said or end.message or f"its trajectory was {end.outcome}"
            self.fail(goal, NoAim(MotionReason.NOT_FOLLOWED, text))

    def fail(self, goal: HeadGoal, failure: NoAim) -> None:
        """End the goal."""
        self.goal = None
        text = f"{failure.reason}: {failure.text}"
        if isinstance(goal.request, LookAtPoint.Goal):
            goal.aborted(text, LookAtPoint.Result(outcome=failure.reason, message=failure.text))
        else:
            goal.aborted(text)

    def let_go(self) -> None:
        """Let the head come to rest."""
        sent, self.sent, self.goal = self.sent, None, None
        if sent is not None:
            sent.cancel()

    # Where points are

    def aim(self, request: LookAtPoint.Goal | PointHead.Goal) -> Aiming | NoAim:
        """Return how to look at what a goal names."""
        point = self.point_of(request)
        return point if isinstance(point, NoAim) else self.aimed(*point, self.aimer)

    def past(self, request: LookAtPoint.Goal | PointHead.Goal) -> float:
        """Return by how much the camera looks past what a goal names now [rad]; nan if that is unknown."""
        found = self.point_of(request)
        point = found if isinstance(found, NoAim) else self.in_root(*found)
        return math.nan if isinstance(point, NoAim) else self.aimer.angle(point, self.positions)

    def point_of(self, request: LookAtPoint.Goal | PointHead.Goal) -> tuple[Vector3, str] | NoAim:
        """Return a point, and its frame."""
        if isinstance(request, PointHead.Goal):
            at: Point = request.target.point
            return (at.x, at.y, at.z), request.target.header.frame_id
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

    def aimed(self, point: Vector3, frame: str, aimer: Gaze | None = None) -> Aiming | NoAim:
        """Return how to look at a point of a frame with the camera, or with something else."""
        aimer = aimer or self.gaze
        there = self.in_root(point, frame)
        if isinstance(there, NoAim):
            return there
        if missing := [name for name in self.config.joints if name not in self.positions]:
            return NoAim(MotionReason.UNKNOWN_START, f"nothing has reported where '{missing[0]}' is")
        if aimer.distance(there, self.positions) < NEAREST:
            return NoAim(MotionReason.GOAL_OUT_OF_REACH, "the point is within the camera")
        return aimer.aimed(there, self.positions)

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


def trajectory(positions: Mapping[str, float], duration: float) -> JointTrajectory:
    """Return the way to positions; a duration of 0 s is as fast as the joints can."""
    point = JointTrajectoryPoint(positions=np.array([*positions.values()]), time_from_start=to_duration(duration))
    return JointTrajectory(joint_names=tuple(positions), points=(point,))


def _look(frame: str) -> str:
    return f"in_{frame}"
