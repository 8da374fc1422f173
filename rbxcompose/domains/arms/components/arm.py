"""Moves an arm to poses: plans the way, verifies it, and has its controller follow it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from rbxcompose import sdk
from rbxcompose.base.geometry import Vector3
from rbxcompose.domains.arms import goals as arm_goals
from rbxcompose.domains.arms import scene_view
from rbxcompose.domains.arms.arm_config import ArmConfig, ArmWorks, dimensions_of, mesh_bytes
from rbxcompose.domains.arms.hand import PICK, PLACE, PicksAndPlaces, hand_ports, hand_task, result_of
from rbxcompose.domains.arms.location import LocationService, location_ports
from rbxcompose.domains.arms.motion.arm_task import ArmTask
from rbxcompose.domains.arms.motion.collisions import pairs_shown, readers_of
from rbxcompose.domains.arms.motion.hand_task import HandTask
from rbxcompose.domains.arms.motion.moveit import MoveItTask
from rbxcompose.domains.arms.motion.parametrisation import Trajectory
from rbxcompose.domains.arms.motion.scene import SCENE_LIMITS, PlacedObject, mistake_among
from rbxcompose.domains.arms.motion.scene_messages import path_of, placed_object
from rbxcompose.domains.arms.moveit_ports import (
    GIVEN,
    MOTION,
    KinematicsServices,
    around,
    is_turned_away,
    moveit_ports,
    moveit_task,
)
from rbxcompose.domains.arms.planning_processes import compile_elsewhere, planning_processes
from rbxcompose.domains.arms.reasons import REASONS
from rbxcompose.domains.arms.section_models import FAST
from rbxcompose.domains.arms.teleoperation import PERIOD, ArmServo, servo_ports
from rbxcompose.msgs.control_msgs import FollowJointTrajectory
from rbxcompose.msgs.fields import ArrayEntries
from rbxcompose.msgs.geometry_msgs import PoseStamped, TwistStamped
from rbxcompose.msgs.moveit_msgs import DisplayTrajectory, ExecuteTrajectory, MoveGroup, RobotState, RobotTrajectory
from rbxcompose.msgs.nav_msgs import Path
from rbxcompose.msgs.rbxcompose_msgs import MoveArm, PickObject, PlaceObject, ReachPose, SceneObjects, TraceArm
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.sdk.key_feed import KeyFeed, whole

MOVE, REACH, TRACE, FOLLOW = "move", "reach", "trace", "follow"  # its ports
WAY, DISPLAY = "way", "display"
LARGE = 4_000_000  # [bytes] of meshes, whose reading takes seconds
MOST_PAIRS = 200  # in a view
AnyGoal = sdk.ServedGoal[Any, Any, Any]
AnyTask = ArmTask | HandTask | MoveItTask


@sdk.component("arm")
class Arm(PicksAndPlaces, LocationService, KinematicsServices, sdk.Component[ArmConfig]):
    """Moves an arm to poses by name, to positions of its joints, or its tip to a pose, on ways without collisions.

    The actions are `NAME/move`, `NAME/reach` and `NAME/trace`, with a gripper also `NAME/pick` and `NAME/place`; the
    skills of missions have such names as `move_NAME`. A way is searched on the shapes of the whole body, or leads the
    tip along straight lines and arcs. It is timed within the limits of the joints, examined finely as the controller
    will follow it, and only then carried out. A failure names one reason of a closed list. If the goal is cancelled or
    the robot stops, the arm comes to rest.

    Example:
        neck: {type: arm, name: neck, base: base, tip: head, controller: look, follow: look/follow_joint_trajectory,
          joints: {pan: {lower: -1, upper: 1}}, urdf: '<robot name="neck"><link name="base"/><link name="head"/>
          <joint name="pan" type="revolute"><parent link="base"/><child link="head"/>
          <limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'}
    """

    made_by = "Each entry of `arms` runs one."
    process = "arm"
    blocking = True
    configures_within = 600.0  # for the first time, code is compiled, which is slow on a small or busy machine
    rate = 20.0
    steps_for_goals = True
    joint_states = sdk.In(JointState, "joint_states", is_open=True)
    scene = sdk.In(SceneObjects, "scene", qos="latched", limits=SCENE_LIMITS)

    @classmethod
    def ports(cls, config: ArmConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports: its goals, and those of its controller."""
        outcomes = dict.fromkeys(REASONS, "failure")
        return super().ports(config) | {
            MOVE: sdk.ServesAction(
                MoveArm,
                f"{config.name}/move",
                claims=config.controller,
                skill=f"move_{config.name}",
                outcomes=outcomes,
                entries=ArrayEntries("joints", "positions", dimensions_of(config), instead="remembered"),
                measures=arm_goals.MOVE_MEASURES,
                choices={"pose": tuple(config.poses)} if config.poses else {},
            ).named(MOVE),
            REACH: sdk.ServesAction(
                ReachPose,
                f"{config.name}/reach",
                claims=config.controller,
                skill=f"reach_{config.name}",
                outcomes=outcomes,
                measures=arm_goals.REACH_MEASURES,
                choices={"prefer": tuple(config.poses)} if config.poses else {},
                may_lack=True,
            ).named(REACH),
            WAY: sdk.Out(Path, f"{config.name}/plan", qos="latched").named(WAY),
            DISPLAY: sdk.Out(DisplayTrajectory, f"{config.name}/display_planned_path", qos="latched").named(DISPLAY),
            TRACE: sdk.ServesAction(
                TraceArm,
                f"{config.name}/trace",
                claims=config.controller,
                skill=f"trace_{config.name}",
                outcomes=outcomes,
                measures=arm_goals.TRACE_MEASURES,
            ).named(TRACE),
            **servo_ports(config),
            **moveit_ports(config),
            **location_ports(config),
            FOLLOW: sdk.CallsAction(FollowJointTrajectory, config.follow).named(FOLLOW),
            **hand_ports(config),
        }

    @classmethod
    def capabilities(cls, config: ArmConfig) -> tuple[sdk.Capability, ...]:
        """Declare what it imports."""
        needed = [(module, "arm") for module in ("pinocchio", "ompl", "toppra")]
        needed += [("numba", FAST)] if config.planner.type == FAST else []
        needed += [(module, "arm") for module in readers_of(config.meshes.values())]
        return tuple(sdk.NeedsExtra(sdk.Setting(module), sdk.Setting(extra)) for module, extra in needed)

    def configure(self) -> None:
        """Build the model of the body, its shapes and the planner."""
        if (size := mesh_bytes(self.config)) > LARGE:
            self.info(f"reads {size / 1e6:.0f} MB of meshes; the first time on a machine takes longer")
        compile_elsewhere(self.config, self.context.clock)
        self.works = ArmWorks(self.config, lambda: self.now)
        self.works.helpers = self.helpers = planning_processes(self.config, self.context.clock, self.warn)
        if self.works.always:
            words = pairs_shown(self.works.always, len(self.works.always))
            self.info(f"links that always collide are not watched: {words}")
        self.problem = "no planning scene has been received"  # with the scene, or nothing
        self.way: tuple[Vector3, ...] = ()  # of the tip, as last planned [m]
        self.measured: dict[str, tuple[float, float]] = {}  # position and velocity of all joints of the body
        self.uprights, self.remembered = {}, {}
        self.task: AnyTask | None = None
        self.goal: AnyGoal | None = None  # that of the task
        self.servo = ArmServo(self.works, self.bound) if self.config.stream else None
        self.is_stopped = False
        self.stage, self.ended, self.duration = "", dict[str, str](), 0.0  # for viewers
        self.due = -math.inf  # [s], when it goes on with what is commanded by hand

    def cleanup(self) -> None:
        """End the processes that plan."""
        for helper in self.helpers:
            helper.close()

    def activate(self) -> None:
        """Let viewers see it."""
        self.feed = KeyFeed(self.context.window(f"{scene_view.ARM_WINDOW}/{self.config.name}", scene_view.LookAtArm()))

    @sdk.answers(scene_view.LookAtArm)
    def look(self, request: scene_view.LookAtArm) -> Mapping[str, Any]:
        """Return what viewers see."""
        return whole(self.parts())

    def parts(self) -> Mapping[str, Any]:
        """Return what viewers see, by name."""
        goal = scene_view.goal_words(self.goal.request) if self.goal is not None else ""
        return scene_view.arm_parts(
            self.config.name, self.stage, goal, self.ended, self.way, self.duration, self.problem
        )

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
        """Plan among other objects from now on; while one of them cannot be, nothing is planned."""
        found, body = tuple(map(placed_object, message.objects)), self.works.kinematics.body
        self.problem = message.problem or mistake_among(found, body)
        if not self.problem:
            paddings = dict(zip(message.padded_links, message.paddings.tolist(), strict=False))
            try:
                self.works.place_objects(*around(self, self.task, found, paddings))
            except ValueError as error:
                self.problem = str(error)
        if self.problem:
            self.warn(f"nothing is planned: {self.problem}")
        if self.task is not None:
            self.task.look_again()
        self.wake()

    def received(self, port: str, message: TwistStamped | PoseStamped) -> None:
        """Lead the tip as somebody commands it now."""
        if self.servo is not None:
            refusal = self.why_not_led() or self.servo.take(message, self.now, self.stamp)
            self.servo.refuse(refusal) if refusal else self.wake()

    def why_not_led(self) -> str:
        """Return why nobody can lead the tip by hand now, nothing if one can."""
        if self.is_stopped or self.task is not None:
            return "the robot is stopped" if self.is_stopped else "a goal moves the arm"
        unknown = [name for name in self.works.space.names if name not in self.measured]
        if unknown:
            return f"nothing has reported where '{unknown[0]}' is"
        return "" if self.is_ready else "no planning scene has been received"

    def wake(self) -> None:
        """Go on with what is commanded now."""
        if self.servo is None or not self.servo.is_wanted or self.task is not None:
            return
        at = {name: position for name, (position, _) in self.measured.items()}
        if self.servo.go_on(self.now, self.stamp, at) and self.due <= self.now:
            self.due = self.now + PERIOD
            self.context.wake_at(self.due)

    def start(self) -> None:
        """Publish that nobody leads the tip."""
        if self.servo is not None:
            self.servo.publish_state()

    def stop(self) -> None:
        """Command nothing any more: controllers bring their joints to rest by themselves."""
        self.is_stopped = True
        if self.servo is not None:
            self.servo.end("halted: the robot was stopped")

    def release(self) -> None:
        """Take commands again."""
        self.is_stopped = False

    @property
    def is_ready(self) -> bool:
        """Return whether the scene is known."""
        return not self.problem

    @property
    def objects(self) -> tuple[PlacedObject, ...] | None:
        """Return the objects of the scene; None while they are unknown."""
        return None if self.problem else self.works.objects

    def step(self, dt: float) -> None:
        """Continue the goal; a newer one waits until the arm has come to rest from the last one."""
        there: list[AnyGoal] = [one for port in self.goals if (one := self.bound[port].current) is not None]
        newer = [goal for goal in there if goal is not self.goal and not (self.goal in there and is_turned_away(goal))]
        is_wanted = self.goal in there and not newer
        if self.task is not None and (not is_wanted or (self.goal is not None and self.goal.cancel_requested)):
            self.task.cancel()
            self.end()
        if self.task is None and newer:
            if self.servo is not None:
                self.servo.end("idle")
            self.goal, self.ended, self.stage = newer[0], {}, "planning"
            self.task = self.task_of(self.goal.request)
        if self.task is not None:
            self.task.advance()
            self.end()

    @property
    def goals(self) -> tuple[str, ...]:
        """Return the ports for goals."""
        return (MOVE, REACH, TRACE, MOTION, GIVEN, *((PICK, PLACE) if self.config.hand is not None else ()))

    def task_of(self, message: Any) -> AnyTask:
        """Return the task of a goal."""
        if isinstance(message, MoveGroup.Goal | ExecuteTrajectory.Goal):
            return moveit_task(self, message)
        if self.config.hand is not None and isinstance(message, PickObject.Goal | PlaceObject.Goal):
            return hand_task(self, self.works, self.config.hand, message)
        solver = self.config.kinematics.settings
        return ArmTask(self, self.works.kinematics, self.works.planner, arm_goals.goal_of(message, solver), solver)

    def end(self) -> None:
        """End the goal with its task."""
        task, goal = self.task, self.goal
        if task is None or goal is None or not task.is_over:
            return
        self.task = self.goal = None
        failure = task.failure
        result = self.pictured(self.config.name, self.config.hand, failure, self.result_of(task, goal.request))
        if isinstance(task, MoveItTask):
            task.end()
            if task.difference is not None and self.scene.value is not None:
                self.on_scene(self.scene.value)
        self.stage, self.ended = "", scene_view.ended_words(failure)
        self.feed.update(self.parts())
        if failure is None:
            goal.succeeded(result)
        elif goal.cancel_requested:
            goal.canceled(result)
        else:
            words = failure.text if isinstance(task, MoveItTask) else result.message
            goal.aborted(f"{failure.reason}: {words}", result)

    def result_of(self, task: AnyTask, message: Any) -> Any:
        """Return how a goal has ended."""
        if isinstance(task, MoveItTask):
            return task.result(arm_goals.action_of(message))
        return result_of(message, task) if isinstance(task, HandTask) else arm_goals.ended_as(message, task)

    @sdk.answers(scene_view.ViewOfArm)
    def view(self, request: scene_view.ViewOfArm) -> scene_view.ArmView:
        """Return what it knows now."""
        names, measured = self.works.space.names, self.measured
        if self.problem:
            raise sdk.Refused(self.problem)
        if unknown := [name for name in names if name not in measured]:
            raise sdk.Refused(f"nothing has reported where '{unknown[0]}' is")
        positions = {name: position for name, (position, _) in measured.items()}
        if self.task is None:  # it plans with the rest of the body where that was
            self.works.kinematics.place({name: position for name, position in positions.items() if name not in names})
        pairs = self.works.pairs(positions, request.between)[:MOST_PAIRS]
        config, watched = self.config, tuple(sorted(self.works.watched))
        return scene_view.ArmView(
            config.name, config.urdf, config.meshes, positions, self.works.objects, pairs, watched, self.way
        )

    # What a task needs

    def follow(self, names: tuple[str, ...], trajectory: Trajectory, ended: Callable[[str, bool], None]) -> None:
        """Send a trajectory to the controller."""
        self.show(names, trajectory)

        def on_end(end: sdk.Ended[FollowJointTrajectory.Result]) -> None:
            ended(problem_of(end), end.outcome is sdk.Outcome.CANCELED)
            self.end()

        self.sent: sdk.SentGoal = self.bound[FOLLOW](arm_goals.follow_goal(names, trajectory), on_end)

    def show(self, names: tuple[str, ...], trajectory: Trajectory) -> None:
        """Publish the way for viewers."""
        self.way, self.duration = self.works.way(trajectory.positions), trajectory.duration
        self.bound[WAY](path_of(self.way, self.works.kinematics.body.root))
        state = JointState(name=tuple(self.measured), position=np.array([at for at, _ in self.measured.values()]))
        motion = RobotTrajectory(joint_trajectory=arm_goals.follow_goal(names, trajectory).trajectory)
        self.bound[DISPLAY](
            DisplayTrajectory(
                model_id=self.works.kinematics.body.name,
                trajectory=(motion,),
                trajectory_start=RobotState(joint_state=state),
            )
        )

    def stop_following(self) -> None:
        """Ask the controller to end the trajectory."""
        self.sent.cancel()

    def report_stage(self, stage: str) -> None:
        """Report the stage of the goal to its client."""
        if self.goal is not None:
            within = self.task.stage if isinstance(self.task, HandTask) else stage
            self.stage = words = stage if stage == within else f"{within}: {stage}"
            self.feed.update(self.parts())
            self.goal.feedback(arm_goals.feedback_of(self.goal.request, words))


def problem_of(end: sdk.Ended[FollowJointTrajectory.Result]) -> str:
    """Return why a controller failed, nothing if it did not."""
    if end.outcome is sdk.Outcome.SUCCEEDED:
        return ""
    reason = end.result.error_string if end.result is not None else ""
    return reason or end.message or f"its trajectory was {end.outcome}"
