"""Moves an arm to poses: plans the way, verifies it, and has its controller follow it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from rbxcompose import sdk
from rbxcompose.base.arrays import np
from rbxcompose.base.geometry import Vector3, rpy_from_quaternion
from rbxcompose.base.printable import plain
from rbxcompose.domains.arms import goals as arm_goals
from rbxcompose.domains.arms import scene_view
from rbxcompose.domains.arms.arm_config import ArmConfig, ArmWorks, dimensions_of, mesh_bytes
from rbxcompose.domains.arms.hand import PICK, PLACE, PicksAndPlaces, hand_ports, hand_task, result_of
from rbxcompose.domains.arms.motion import moveit
from rbxcompose.domains.arms.motion.arm_task import ArmTask
from rbxcompose.domains.arms.motion.collisions import pairs_shown, readers_of
from rbxcompose.domains.arms.motion.hand_task import HandTask
from rbxcompose.domains.arms.motion.parametrisation import Trajectory
from rbxcompose.domains.arms.motion.scene import SCENE_LIMITS, PlacedObject, mistake_among
from rbxcompose.domains.arms.motion.scene_messages import path_of, placed_object
from rbxcompose.domains.arms.planning_processes import compile_elsewhere, planning_processes
from rbxcompose.domains.arms.reasons import REASONS
from rbxcompose.domains.arms.section_models import FAST
from rbxcompose.domains.arms.teleoperation import PERIOD, ArmServo, servo_ports
from rbxcompose.msgs import moveit_msgs
from rbxcompose.msgs.control_msgs import FollowJointTrajectory
from rbxcompose.msgs.fields import ArrayEntries
from rbxcompose.msgs.geometry_msgs import PoseStamped, TwistStamped
from rbxcompose.msgs.nav_msgs import Path
from rbxcompose.msgs.rbxcompose_msgs import (
    LocateArm,
    MoveArm,
    PickObject,
    PlaceObject,
    ReachPose,
    SceneObjects,
    TraceArm,
)
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.stamps import to_seconds
from rbxcompose.sdk.bound import KeyFeed, whole

MOVE, REACH, TRACE, FOLLOW, LOCATE = "move", "reach", "trace", "follow", "locate"  # its ports
FORWARD, INVERSE, MOTION, GIVEN = "forward", "inverse", "motion", "given"  # those of programs for MoveIt
WAY, DISPLAY = "way", "display"
LARGE = 4_000_000  # [bytes] of meshes, whose reading takes seconds
MOST_PAIRS = 200  # in a view
MOST_REMEMBERED, LONGEST_NAME = 100, 100
IK_TIME = 1.0  # [s] that a search may take; what else it should do waits meanwhile
AnyGoal = sdk.ServedGoal[Any, Any, Any]
AnyTask = ArmTask | HandTask | moveit.MoveItTask


@sdk.component("arm")
class Arm(PicksAndPlaces, sdk.Component[ArmConfig]):
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
        shared: Any = {"claims": config.controller, "outcomes": dict.fromkeys(REASONS, "failure")}
        found: dict[str, sdk.Port[Any]] = {
            MOVE: sdk.ServesAction(
                MoveArm,
                f"{config.name}/move",
                skill=f"move_{config.name}",
                entries=ArrayEntries("joints", "positions", dimensions_of(config), instead="remembered"),
                measures=arm_goals.MOVE_MEASURES,
                ranges=arm_goals.RANGES,
                choices={"pose": tuple(config.poses)} if config.poses else {},
                **shared,
            ),
            REACH: sdk.ServesAction(
                ReachPose,
                f"{config.name}/reach",
                skill=f"reach_{config.name}",
                measures=arm_goals.REACH_MEASURES,
                ranges=arm_goals.RANGES,
                choices={"prefer": tuple(config.poses)} if config.poses else {},
                may_lack=True,
                **shared,
            ),
            WAY: sdk.Out(Path, f"{config.name}/plan", qos="latched"),
            DISPLAY: sdk.Out(moveit_msgs.DisplayTrajectory, f"{config.name}/display_planned_path", qos="latched"),
            TRACE: sdk.ServesAction(
                TraceArm,
                f"{config.name}/trace",
                skill=f"trace_{config.name}",
                measures=arm_goals.TRACE_MEASURES,
                ranges=arm_goals.TRACE_RANGES,
                **shared,
            ),
            **servo_ports(config),
            **moveit_ports(config),
            LOCATE: sdk.Serves(LocateArm, f"{config.name}/locate", skill=f"locate_{config.name}"),
            FOLLOW: sdk.CallsAction(FollowJointTrajectory, config.follow),
            **hand_ports(config),
        }
        return super().ports(config) | {name: port.named(name) for name, port in found.items()}

    @classmethod
    def capabilities(cls, config: ArmConfig) -> tuple[sdk.Capability, ...]:
        """Declare what it imports, and where its joints can go."""
        needed = [(module, "arm") for module in ("pinocchio", "ompl", "toppra")]
        needed += [("numba", FAST)] if config.planner.type == FAST else []
        needed += [(module, "arm") for module in readers_of(config.meshes.values())]
        led = sdk.Setting({name: name for name in config.joints})
        extras = (sdk.NeedsExtra(sdk.Setting(module), sdk.Setting(extra)) for module, extra in needed)
        return (sdk.BoundsGoals(MOVE, joints=led, unless=sdk.Setting("tolerance")), *extras)

    def configure(self) -> None:
        """Build the model of the body, its shapes and the planner."""
        if (size := mesh_bytes(self.config)) > LARGE:
            self.info(f"reads {size / 1e6:.0f} MB of meshes; the first time on a machine takes longer")
        compile_elsewhere(self.config, self.context.clock, self.info)
        self.works = ArmWorks(self.config, lambda: self.now)
        self.works.helpers = self.helpers = planning_processes(self.config, self.context.clock, self.warn)
        for helper in self.helpers:
            self.at_end.callback(helper.close)
        if self.works.always:
            words = pairs_shown(self.works.always, len(self.works.always))
            self.info(f"links that always collide are not watched: {words}")
        self.problem = "no planning scene has been received"  # with the scene, or nothing
        self.add_diagnostic("scene", self.scene_status)
        self.way: tuple[Vector3, ...] = ()  # of the tip, as last planned [m]
        self.measured: dict[str, tuple[float, float]] = {}  # position and velocity of all joints of the body
        self.picked = {}
        self.remembered: dict[str, dict[str, float]] = {}  # positions of joints [rad or m] by the names given to them
        self.task: AnyTask | None = None
        self.goal: AnyGoal | None = None  # that of the task
        self.servo = ArmServo(self.works, self.bound) if self.config.stream else None
        self.is_stopped = False
        self.stage, self.ended, self.duration = "", dict[str, str](), 0.0  # for viewers
        self.due = -math.inf  # [s], when it goes on with what is commanded by hand

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
                self.works.place_objects(*self.around(self.task, found, paddings))
            except ValueError as error:
                self.problem = str(error)
        if self.problem:
            self.warn(f"nothing is planned: {self.problem}")
        if self.task is not None:
            self.task.look_again()
        self.wake()

    def scene_status(self, now: float) -> sdk.TaskStatus:
        """Return whether it can plan in the scene."""
        if problem := self.problem:
            return sdk.TaskStatus(sdk.Level.WARN, f"nothing is planned: {problem}")
        return sdk.TaskStatus(sdk.Level.OK, "the scene is known")

    def received(self, port: str, message: TwistStamped | PoseStamped) -> None:
        """Lead the tip as somebody commands it now."""
        if self.servo is not None:
            refusal = self.why_not_led() or self.servo.take(message, self.now, self.stamp)
            self.servo.refuse(refusal) if refusal else self.wake()

    def why_not_led(self) -> str:
        """Return why nobody can lead the tip by hand now, nothing if one can."""
        if self.is_stopped or self.task is not None:
            return "the robot is stopped" if self.is_stopped else "a goal moves the arm"
        return self.unreported or ("" if self.is_ready else "no planning scene has been received")

    def wake(self) -> None:
        """Go on with what is commanded now."""
        if self.servo is None or not self.servo.is_wanted or self.task is not None:
            return
        if self.servo.go_on(self.now, self.stamp, self.positions) and self.due <= self.now:
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
        if isinstance(message, moveit_msgs.MoveGroup.Goal | moveit_msgs.ExecuteTrajectory.Goal):
            return self.moveit_task(message)
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
        if isinstance(task, moveit.MoveItTask):
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
            words = failure.text if isinstance(task, moveit.MoveItTask) else result.message
            goal.aborted(f"{failure.reason}: {words}", result)

    def result_of(self, task: AnyTask, message: Any) -> Any:
        """Return how a goal has ended."""
        if isinstance(task, moveit.MoveItTask):
            return task.result(arm_goals.action_of(message))
        return result_of(message, task) if isinstance(task, HandTask) else arm_goals.ended_as(message, task)

    @sdk.answers(scene_view.ViewOfArm)
    def view(self, request: scene_view.ViewOfArm) -> scene_view.ArmView:
        """Return what it knows now."""
        if problem := self.problem or self.unreported:
            raise sdk.Refused(problem)
        positions = self.positions
        if self.task is None:  # it plans with the rest of the body where that was
            self.place_rest()
        pairs = self.works.pairs(positions, request.between)[:MOST_PAIRS]
        config, watched = self.config, tuple(sorted(self.works.watched))
        return scene_view.ArmView(
            config.name, config.urdf, config.meshes, positions, self.works.objects, pairs, watched, self.way
        )

    # Where it is

    @property
    def positions(self) -> dict[str, float]:
        """Return where joints are [rad or m]."""
        return {name: position for name, (position, _) in self.measured.items()}

    @property
    def unreported(self) -> str:
        """Return that a joint of the arm has not been reported yet, nothing if all have."""
        unknown = [name for name in self.works.space.names if name not in self.measured]
        return f"nothing has reported where '{unknown[0]}' is" if unknown else ""

    def place_rest(self) -> None:
        """Plan with the rest of the body where it is."""
        names = self.works.space.names
        self.works.kinematics.place({name: at for name, at in self.positions.items() if name not in names})

    @property
    def poses(self) -> Mapping[str, Mapping[str, float]]:
        """Return the poses by name, those of the manifest and those that it remembers."""
        return {**self.remembered, **self.config.poses}

    def on_locate(self, request: LocateArm.Request) -> LocateArm.Response:
        """Report where the tip and the joints are."""
        if problem := self.unreported or self.unfit(request):
            return LocateArm.Response(message=problem)
        space, kinematics, at = self.works.space, self.works.kinematics, self.positions
        links, frame = kinematics.body.poses(at), request.frame or kinematics.body.root
        tip = links[frame].inverse().compose(links[kinematics.group.tip])
        roll, pitch, yaw = rpy_from_quaternion(tip.rotation)
        if request.remember:
            self.remembered[request.remember] = {name: at[name] for name in space.names}
        (x, y, z), angles = tip.translation, zip(("roll", "pitch", "yaw"), (roll, pitch, yaw), strict=True)
        place = ", ".join(f"{axis} {shown(value * 100)} cm" for axis, value in zip("xyz", (x, y, z), strict=True))
        turn = ", ".join(f"{axis} {shown(math.degrees(value))} deg" for axis, value in angles)
        joints = ", ".join(joint.shown(at[joint.name]) for joint in space.joints)
        words = f"'{kinematics.group.tip}' in '{frame}': {place}, {turn}; joints from the base: {joints}"
        return LocateArm.Response(success=True, message=words, x=x, y=y, z=z, roll=roll, pitch=pitch, yaw=yaw)

    def unfit(self, request: LocateArm.Request) -> str:
        """Return why that cannot be reported or remembered, nothing if it can."""
        name, frame = request.remember, request.frame
        if frame and frame not in self.works.kinematics.body.links:
            return f"there is no link '{plain(frame)}'"
        if name in self.config.poses:
            return f"'{name}' is a pose of this arm: remember where it is by another name"
        if len(name) > LONGEST_NAME:
            return f"the name to remember has more than {LONGEST_NAME} characters"
        if name and name not in self.remembered and len(self.remembered) >= MOST_REMEMBERED:
            return f"it remembers {MOST_REMEMBERED} names already: use one of them again"
        return ""

    # What programs for MoveIt ask for

    @property
    def query(self) -> moveit.KinematicsQuery:
        """Return what answers questions about where the arm is or could be."""
        works = self.works
        self.place_rest()
        return moveit.KinematicsQuery(
            self.config.name, works.kinematics, works.space, works.planner.checker, self.positions
        )

    def on_forward(self, request: moveit_msgs.GetPositionFK.Request) -> moveit_msgs.GetPositionFK.Response:
        """Return where links are."""
        busy = self.task is not None
        return moveit_msgs.GetPositionFK.Response(error_code=moveit.busy()) if busy else self.query.forward(request)

    def on_inverse(self, request: moveit_msgs.GetPositionIK.Request) -> moveit_msgs.GetPositionIK.Response:
        """Return positions of joints that bring the tip to a pose."""
        if self.task is not None:
            return moveit_msgs.GetPositionIK.Response(error_code=moveit.busy())
        wanted, begin = request.ik_request, self.now
        most = min(to_seconds(wanted.timeout) or IK_TIME, IK_TIME)
        for answer in self.query.inverse(wanted, self.config.planner.seed):
            if answer is not None:
                return answer
            if self.now - begin > most:
                break
        return moveit_msgs.GetPositionIK.Response(error_code=moveit.late(most))

    def moveit_task(
        self, message: moveit_msgs.MoveGroup.Goal | moveit_msgs.ExecuteTrajectory.Goal
    ) -> moveit.MoveItTask:
        """Return the task of a goal; one that is refused is over."""
        works, config, task = self.works, self.config, moveit.MoveItTask(self, self.works.planner)
        try:
            led_by = message.controller_names if isinstance(message, moveit_msgs.ExecuteTrajectory.Goal) else ()
            if other := [name for name in led_by if name != config.controller]:
                words = f"'{config.controller}' leads this arm, not '{other[0]}'"
                raise moveit.RequestError(moveit_msgs.MoveItErrorCodes.CONTROL_FAILED, words)
            if self.unreported:
                raise moveit.RequestError(moveit_msgs.MoveItErrorCodes.ROBOT_STATE_STALE, self.unreported)
            at, names = self.positions, works.space.names
            if isinstance(message, moveit_msgs.ExecuteTrajectory.Goal):
                given = moveit.trajectory_of(message.trajectory, names, np.array([at[name] for name in names]))
                task.follow_given(works.kinematics, given)
            else:
                self.place_rest()
                options = message.planning_options
                reader = moveit.RequestReader(config.name, works.kinematics, works.planner.settings, at)
                wish = reader.wish(message.request, options)
                if moveit.differs(options.planning_scene_diff):  # it plans in another scene until the task is over
                    task.difference = options.planning_scene_diff
                    works.place_objects(*self.around(task, works.objects, works.paddings))
                task.plan(works.kinematics, wish, config.kinematics.settings, is_plan=options.plan_only)
        except moveit.RequestError as error:
            task.refuse(error)
        return task

    def around(
        self, task: AnyTask | None, objects: tuple[PlacedObject, ...], paddings: Mapping[str, float]
    ) -> moveit.SceneAround:
        """Return what is around the robot while it carries out a task; raises `RequestError` if that cannot be."""
        if not isinstance(task, moveit.MoveItTask) or task.difference is None:
            return objects, paddings
        body = self.works.kinematics.body
        return moveit.with_difference(body, objects, paddings, task.difference, self.positions)

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
        motion = moveit_msgs.RobotTrajectory(joint_trajectory=arm_goals.follow_goal(names, trajectory).trajectory)
        self.bound[DISPLAY](
            moveit_msgs.DisplayTrajectory(
                model_id=self.works.kinematics.body.name,
                trajectory=(motion,),
                trajectory_start=moveit_msgs.RobotState(joint_state=state),
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


def moveit_ports(config: ArmConfig) -> dict[str, sdk.Port[Any]]:
    """Return the ports that `move_group` passes on to what comes under the names of ROS 2."""
    claims = config.controller
    return {
        FORWARD: sdk.Serves(moveit_msgs.GetPositionFK, f"{config.name}/compute_fk", skill=None),
        INVERSE: sdk.Serves(moveit_msgs.GetPositionIK, f"{config.name}/compute_ik", skill=None),
        MOTION: sdk.ServesAction(
            moveit_msgs.MoveGroup, f"{config.name}/move_action", claims=claims, skill=None, limits=SCENE_LIMITS
        ),
        GIVEN: sdk.ServesAction(
            moveit_msgs.ExecuteTrajectory,
            f"{config.name}/execute_trajectory",
            claims=claims,
            skill=None,
            limits=SCENE_LIMITS,
        ),
    }


def is_turned_away(goal: AnyGoal) -> bool:
    """Return whether a goal that comes while another one is carried out only wants a plan; then it has ended."""
    if not isinstance(goal.request, moveit_msgs.MoveGroup.Goal) or not goal.request.planning_options.plan_only:
        return False
    goal.aborted("the arm moves", moveit_msgs.MoveGroup.Result(error_code=moveit.busy()))
    return True


def shown(value: float) -> str:
    """Return a number for people, without a sign of 0."""
    return f"{round(value, 1) + 0.0:.1f}"


def problem_of(end: sdk.Ended[FollowJointTrajectory.Result]) -> str:
    """Return why a controller failed, nothing if it did not."""
    if end.outcome is sdk.Outcome.SUCCEEDED:
        return ""
    reason = end.result.error_string if end.result is not None else ""
    return reason or end.message or f"its trajectory was {end.outcome}"
