"""Moves an arm to poses: plans the way, verifies it, and has its controller follow it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from rbxcompose.arm_config import ArmConfig, ArmWorks, dimensions_of
from rbxcompose.body.model import Geometry
from rbxcompose.geometry import Transform3, quaternion_from_rpy
from rbxcompose.motion.arm_task import ArmGoal, ArmTask
from rbxcompose.motion.collisions import told
from rbxcompose.motion.inverse_kinematics import ANGLE_TOLERANCE, TOLERANCE, PoseTarget
from rbxcompose.motion.parametrisation import Trajectory
from rbxcompose.motion.reasons import REASONS
from rbxcompose.motion.scene import PlacedObject, mistake_in
from rbxcompose.msgs.control_msgs import FollowJointTrajectory
from rbxcompose.msgs.entries import ArrayEntries
from rbxcompose.msgs.rbxcompose_msgs import MoveArm, ReachPose, SceneObject, SceneObjects
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.stamps import to_duration
from rbxcompose.msgs.trajectory_msgs import JointTrajectory, JointTrajectoryPoint
from rbxcompose.sdk import (
    CallsAction,
    Capability,
    Component,
    Ended,
    In,
    NeedsExtra,
    Outcome,
    Port,
    SentGoal,
    ServedGoal,
    ServesAction,
    Setting,
    component,
)
from rbxcompose.units import ANGLE, LENGTH, RATIO

MOVE, REACH, FOLLOW = "move", "reach", "follow"  # its ports
AnyGoal = ServedGoal[Any, Any, Any]
REACH_MEASURES = {
    **dict.fromkeys(("x", "y", "z", "tolerance"), LENGTH),
    **dict.fromkeys(("roll", "pitch", "yaw", "angle_tolerance"), ANGLE),
    **dict.fromkeys(("speed", "acceleration"), RATIO),
}


@component("arm")
class Arm(Component[ArmConfig]):
    """Moves an arm to poses by name, to positions of its joints, or its tip to a pose, on ways without collisions.

    The actions are `NAME/move` and `NAME/reach`, the skills of missions `move_NAME` and `reach_NAME`. A way is searched
    on the shapes of the whole body, timed within the limits of the joints, examined finely as the controller will
    follow it, and only then carried out. A failure names one reason of a closed list. If the goal is cancelled or the
    robot stops, the arm comes to rest.

    Example:
        neck: {type: arm, name: neck, base: base, tip: head, controller: look, follow: look/follow_joint_trajectory,
          joints: {pan: {lower: -1, upper: 1}}, urdf: '<robot name="neck"><link name="base"/><link name="head"/>
          <joint name="pan" type="revolute"><parent link="base"/><child link="head"/>
          <limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'}
    """

    made_by = "Each entry of `arms` runs one."
    process = "arm"
    blocking = True
    rate = 20.0
    steps_for_goals = True
    joint_states = In(JointState, "joint_states", is_open=True)
    scene = In(SceneObjects, "scene", qos="latched")

    @classmethod
    def ports(cls, config: ArmConfig) -> dict[str, Port[Any]]:
        """Return the ports: its goals, and those of its controller."""
        outcomes = dict.fromkeys(REASONS, "failure")
        return super().ports(config) | {
            MOVE: ServesAction(
                MoveArm,
                f"{config.name}/move",
                claims=config.controller,
                skill=f"move_{config.name}",
                outcomes=outcomes,
                entries=ArrayEntries("joints", "positions", dimensions_of(config)),
                measures={"speed": RATIO, "acceleration": RATIO},
                choices={"pose": tuple(config.poses)} if config.poses else {},
            ).named(MOVE),
            REACH: ServesAction(
                ReachPose,
                f"{config.name}/reach",
                claims=config.controller,
                skill=f"reach_{config.name}",
                outcomes=outcomes,
                measures=REACH_MEASURES,
            ).named(REACH),
            FOLLOW: CallsAction(FollowJointTrajectory, config.follow).named(FOLLOW),
        }

    @classmethod
    def capabilities(cls, config: ArmConfig) -> tuple[Capability, ...]:
        """Declare what it imports."""
        return tuple(NeedsExtra(Setting(module), Setting("arm")) for module in ("pinocchio", "ompl", "toppra"))

    def configure(self) -> None:
        """Build the model of the body, its shapes and the planner."""
        self.works = ArmWorks(self.config, lambda: self.now)
        if self.works.always:
            words = told(self.works.always, len(self.works.always))
            self.info(f"links that always collide are not watched: {words}")
        self.objects: tuple[PlacedObject, ...] | None = None  # of the scene; None while it is unknown
        self.measured: dict[str, tuple[float, float]] = {}  # position and velocity of all joints of the body
        self.task: ArmTask | None = None
        self.goal: AnyGoal | None = None  # that of the task

    @property
    def occupation(self) -> str:
        """Return that it moves."""
        return f"arm {self.name} moves" if self.task is not None else ""

    def on_joint_states(self, message: JointState) -> None:
        """Note where joints are."""
        velocities = message.velocity.tolist() or [0.0] * len(message.name)
        for name, position, velocity in zip(message.name, message.position.tolist(), velocities, strict=False):
            self.measured[name] = position, velocity

    def on_scene(self, message: SceneObjects) -> None:
        """Plan among other objects from now on; an object that cannot be is left out and told."""
        found = []
        for one in map(placed, message.objects):
            if mistake := mistake_in(one, self.works.kinematics.body):
                self.warn(f"the object '{one.name}' is left out: {mistake}")
            else:
                found.append(one)
        self.objects = tuple(found)
        self.works.place_objects(found)
        if self.task is not None:
            self.task.look_again()

    @property
    def is_ready(self) -> bool:
        """Return whether the scene is known."""
        return self.objects is not None

    def step(self, dt: float) -> None:
        """Continue the goal; a newer one waits until the arm has come to rest from the last one."""
        there: list[AnyGoal] = [one for port in (MOVE, REACH) if (one := self.bound[port].current) is not None]
        newer = [one for one in there if one is not self.goal]
        is_wanted = self.goal in there and not newer
        if self.task is not None and (not is_wanted or (self.goal is not None and self.goal.cancel_requested)):
            self.task.cancel()
            self.end()
        if self.task is None and newer:
            self.goal = newer[0]
            self.task = ArmTask(self, self.works.kinematics, self.works.planner, goal_of(self.goal.request))
        if self.task is not None:
            self.task.advance()
            self.end()

    def end(self) -> None:
        """End the goal with its task."""
        task, goal = self.task, self.goal
        if task is None or goal is None or not task.is_over:
            return
        self.task = self.goal = None
        failure, result = task.failure, (MoveArm if isinstance(goal.request, MoveArm.Goal) else ReachPose).Result
        if failure is None:
            goal.succeeded()
        elif goal.cancel_requested:
            goal.canceled(result(outcome=failure.reason, message=failure.text))
        else:
            goal.aborted(f"{failure.reason}: {failure.text}", result(outcome=failure.reason, message=failure.text))

    # What a task needs

    @property
    def poses(self) -> Mapping[str, Mapping[str, float]]:
        """Return the poses by name."""
        return self.config.poses

    def follow(self, names: tuple[str, ...], trajectory: Trajectory, ended: Callable[[str, bool], None]) -> None:
        """Send a trajectory to the controller."""

        def told(end: Ended[FollowJointTrajectory.Result]) -> None:
            ended(problem_of(end), end.outcome is Outcome.CANCELED)
            self.end()

        self.sent: SentGoal = self.bound[FOLLOW](follow_goal(names, trajectory), told)

    def stop_following(self) -> None:
        """Ask the controller to end the trajectory."""
        self.sent.cancel()

    def told(self, stage: str) -> None:
        """Tell the client in which stage its goal is."""
        if self.goal is not None:
            kind = MoveArm if isinstance(self.goal.request, MoveArm.Goal) else ReachPose
            self.goal.feedback(kind.Feedback(stage=stage))


def goal_of(message: MoveArm.Goal | ReachPose.Goal) -> ArmGoal:
    """Return a goal as the task takes it: a share of 0 is all."""
    speed, acceleration = message.speed or 1.0, message.acceleration or 1.0
    if isinstance(message, MoveArm.Goal):
        positions = dict(zip(message.joints, message.positions.tolist(), strict=False))
        return ArmGoal(message.pose, positions, speed=speed, acceleration=acceleration)
    turn = quaternion_from_rpy(message.roll, message.pitch, message.yaw)
    target = PoseTarget(
        Transform3((message.x, message.y, message.z), turn),
        message.any_orientation,
        message.tolerance or TOLERANCE,
        message.angle_tolerance or ANGLE_TOLERANCE,
    )
    return ArmGoal(target=target, frame=message.frame, speed=speed, acceleration=acceleration)


def follow_goal(names: tuple[str, ...], trajectory: Trajectory) -> FollowJointTrajectory.Goal:
    """Return a trajectory as its controller takes it; where the arm is now is not among its points."""
    rows = zip(trajectory.times[1:].tolist(), trajectory.positions[1:], trajectory.velocities[1:], strict=True)
    points = tuple(
        JointTrajectoryPoint(positions=positions, velocities=velocities, time_from_start=to_duration(time))
        for time, positions, velocities in rows
    )
    return FollowJointTrajectory.Goal(trajectory=JointTrajectory(joint_names=names, points=points))


def problem_of(end: Ended[FollowJointTrajectory.Result]) -> str:
    """Return why a controller failed, nothing if it did not."""
    if end.outcome is Outcome.SUCCEEDED:
        return ""
    told = end.result.error_string if end.result is not None else ""
    return told or end.message or f"its trajectory was {end.outcome}"


def placed(message: SceneObject) -> PlacedObject:
    """Return an object of the scene."""
    at, turn = message.pose.position, message.pose.orientation
    pose = Transform3((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w))
    return PlacedObject(
        message.name, Geometry(message.shape, tuple(message.size.tolist())), message.link, pose, message.touches
    )
