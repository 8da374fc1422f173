"""Programs for MoveIt have the arm of `pi_robot` plan and move, by the names and messages that they know."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rbxcompose.base.geometry import Transform3
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.domains.arms.motion.inverse_kinematics import PoseTarget
from rbxcompose.msgs.geometry_msgs import Quaternion
from rbxcompose.msgs.moveit_msgs import (
    AttachedCollisionObject,
    BoundingVolume,
    CollisionObject,
    Constraints,
    ExecuteTrajectory,
    GetMotionPlan,
    GetPositionFK,
    JointConstraint,
    MotionPlanRequest,
    MoveGroup,
    MoveItErrorCodes,
    OrientationConstraint,
    PlanningOptions,
    PlanningScene,
    PlanningSceneWorld,
    PositionConstraint,
    RobotState,
    RobotTrajectory,
    TrajectoryConstraints,
    VisibilityConstraint,
)
from rbxcompose.msgs.poses import pose_message
from rbxcompose.msgs.rbxcompose_msgs import MoveArm, ReachPose, SceneObjects
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.shape_msgs import SolidPrimitive
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.sdk.bound import Outcome
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench
from tests.components.slow_servos import with_slow_servos
from tests.loops import for_all
from tests.shipped import robot_and_plan

pytestmark = pytest.mark.timeout(180)  # the libraries of arms are slow to import
TYPES = ("arm", "servo_bus", "scene", "move_group")
ARM, TIP = "right_arm", "right_arm_tip"
LIFT, ELBOW = "right_arm_shoulder_lift_joint", "right_arm_elbow_flex_joint"
NOTHING = PlanningScene(is_diff=True, robot_state=RobotState(is_diff=True))  # as its clients always send it


@pytest.fixture(scope="module")
def plan() -> Plan:
    return robot_and_plan("pi_robot")[1]


class Client:
    """A program for MoveIt, and the robot in stepped time."""

    def __init__(self, plan: Plan) -> None:
        self.bench = Bench(*(instance for instance in with_slow_servos(plan.instances) if instance.type in TYPES))
        self.states = self.bench.collect("/joint_states", JointState, Qos.STATE)
        self.scenes = self.bench.collect("/scene", SceneObjects, Qos.LATCHED)
        self.feedback: list[str] = []
        self.bench.advance(1.0)

    def at(self, joint: str) -> float:
        newest = self.states[-1]
        return float(newest.position[newest.name.index(joint)])

    def begin(self, action: Any, topic: str, goal: Any) -> tuple[list[Any], Any]:
        ends: list[Any] = []
        client = self.bench.bus.action_client("me", topic, action)
        return ends, client(goal, ends.append, lambda message: self.feedback.append(getattr(message, "state", "")))

    def sent(self, action: Any, topic: str, goal: Any) -> Any:
        ends, _ = self.begin(action, topic, goal)
        assert self.bench.run_until(lambda: bool(ends), 60.0)
        return ends[0]

    def move(self, goal: Constraints, *, options: PlanningOptions | None = None, **fields: Any) -> Any:
        return self.sent(MoveGroup, "/move_action", motion(goal, options, **fields))

    def ask(self, service: Any, topic: str, request: Any) -> Any:
        replies: list[Any] = []
        self.bench.bus.client("me", topic, service)(request, replies.append, timeout=60.0)
        assert self.bench.run_until(lambda: bool(replies), 60.0)
        return replies[0].response


@pytest.fixture
def client(plan: Plan) -> Client:
    return Client(plan)


@pytest.fixture(scope="module")
def client_at_rest(plan: Plan) -> Client:
    """Return one whose goals are all refused, so that the arm stays where it is."""
    return Client(plan)


def motion(goal: Constraints, options: PlanningOptions | None = None, **fields: Any) -> MoveGroup.Goal:
    """Return a goal as `MoveGroupInterface` fills it in."""
    usual: dict[str, Any] = {
        "goal_constraints": (goal,),
        "group_name": ARM,
        "num_planning_attempts": 1,
        "allowed_planning_time": 5.0,
        "start_state": RobotState(is_diff=True),
    }
    request = MotionPlanRequest(**{**usual, **fields})
    return MoveGroup.Goal(request=request, planning_options=options or PlanningOptions(planning_scene_diff=NOTHING))


def joints(**positions: float) -> Constraints:
    return Constraints(
        joint_constraints=tuple(
            JointConstraint(joint_name=name, position=at, tolerance_above=1e-4, tolerance_below=1e-4, weight=1.0)
            for name, at in positions.items()
        )
    )


def place(x: float, y: float, z: float, frame: str = "", within: float = 0.01) -> PositionConstraint:
    region = BoundingVolume(
        primitives=(SolidPrimitive(type=SolidPrimitive.SPHERE, dimensions=np.array((within,))),),
        primitive_poses=(pose_message(Transform3((x, y, z))),),
    )
    return PositionConstraint(header=Header(frame_id=frame), link_name=TIP, constraint_region=region)


def only_plan(**fields: Any) -> PlanningOptions:
    return PlanningOptions(**{"plan_only": True, "planning_scene_diff": NOTHING, **fields})


def state(**positions: float) -> RobotState:
    return RobotState(joint_state=JointState(name=tuple(positions), position=np.array([*positions.values()])))


def test_joints_move_to_a_goal_and_the_result_has_the_plan_and_what_was_done(client: Client) -> None:
    end = client.move(joints(**{LIFT: -1.0, ELBOW: 0.5}), max_velocity_scaling_factor=0.5)
    assert end.outcome is Outcome.SUCCEEDED
    result = end.result
    assert result.error_code.val == MoveItErrorCodes.SUCCESS
    assert client.feedback == ["PLANNING", "MONITOR"]
    assert (client.at(LIFT), client.at(ELBOW)) == pytest.approx((-1.0, 0.5), abs=0.02)
    planned, done = (one.joint_trajectory for one in (result.planned_trajectory, result.executed_trajectory))
    column = planned.joint_names.index(LIFT)
    assert planned.points[0].positions[column] == pytest.approx(0.0, abs=0.02)
    assert planned.points[-1].positions[column] == pytest.approx(-1.0)
    assert done.joint_names == planned.joint_names
    assert [round(one.positions[column], 1) for one in (done.points[0], done.points[-1])] == [0.0, -1.0]
    assert LIFT in result.trajectory_start.joint_state.name


def tip_of(client: Client) -> Transform3:
    """Return where the tip is."""
    answer = client.ask(GetPositionFK, f"/{ARM}/compute_fk", GetPositionFK.Request())
    at = answer.pose_stamped[0].pose
    turn = at.orientation
    return Transform3((at.position.x, at.position.y, at.position.z), (turn.x, turn.y, turn.z, turn.w))


def turned(pose: Transform3, *tolerances: float, frame: str = "") -> OrientationConstraint:
    x, y, z, w = pose.rotation
    a, b, c = tolerances
    return OrientationConstraint(
        header=Header(frame_id=frame),
        link_name=TIP,
        orientation=Quaternion(x=x, y=y, z=z, w=w),
        absolute_x_axis_tolerance=a,
        absolute_y_axis_tolerance=b,
        absolute_z_axis_tolerance=c,
        weight=1.0,
    )


def test_the_tip_goes_to_a_pose_and_to_a_point(client: Client) -> None:
    assert client.move(joints(**{LIFT: -1.2, ELBOW: 0.6})).outcome is Outcome.SUCCEEDED
    there = tip_of(client)
    assert client.move(joints(**{LIFT: -0.5, ELBOW: 0.0})).outcome is Outcome.SUCCEEDED
    x, y, z = there.translation
    pose = Constraints(
        position_constraints=(place(x, y, z, within=1e-3),), orientation_constraints=(turned(there, 0.01, 0.01, 0.01),)
    )
    end = client.move(pose)
    assert end.outcome is Outcome.SUCCEEDED, end.result.error_code
    assert tip_of(client).translation == pytest.approx(there.translation, abs=0.01)
    point = Constraints(position_constraints=(place(x - 0.02, y, z + 0.02),))
    assert client.move(point).outcome is Outcome.SUCCEEDED
    assert math.dist(tip_of(client).translation, (x - 0.02, y, z + 0.02)) < 0.02
    turn = Constraints(orientation_constraints=(turned(there, 0.01, 0.01, 0.01),))
    assert client.move(turn).outcome is Outcome.SUCCEEDED
    assert PoseTarget(there, any_position=True).error(tip_of(client))[1] < 0.02


def test_a_goal_beyond_its_reach_is_approximate_if_that_is_asked_for_and_says_so(client: Client) -> None:
    far = ReachPose.Goal(x=2.0, z=0.55, any_orientation=True)
    for goal, outcome in ((far, Outcome.ABORTED), (replace(far, approximate=True), Outcome.SUCCEEDED)):
        end = client.sent(ReachPose, f"/{ARM}/reach", goal)
        assert (end.outcome, end.result.approximate) == (outcome, goal.approximate)
    away = math.dist(tip_of(client).translation, (2.0, 0.0, 0.55))
    assert (end.result.away, end.result.angle) == (pytest.approx(away, abs=0.01), 0.0)
    assert f"approximate: the tip is {100 * end.result.away:.1f} cm" in end.result.message
    nothing = client.sent(ReachPose, f"/{ARM}/reach", replace(far, any_position=True))
    assert (nothing.outcome, nothing.result.outcome) == (Outcome.ABORTED, "unknown_goal")


def test_a_plan_is_executed_later_unless_the_arm_has_moved_since_or_it_would_collide(client: Client) -> None:
    options = only_plan()
    planned = client.move(joints(**{LIFT: -1.0}), options=options).result
    assert planned.error_code.val == MoveItErrorCodes.SUCCESS
    assert planned.executed_trajectory == RobotTrajectory()
    assert client.at(LIFT) == pytest.approx(0.0, abs=0.02)  # it did not move
    given = ExecuteTrajectory.Goal(trajectory=planned.planned_trajectory)
    end = client.sent(ExecuteTrajectory, "/execute_trajectory", given)
    assert end.outcome is Outcome.SUCCEEDED, end.result
    assert client.at(LIFT) == pytest.approx(-1.0, abs=0.02)
    again = client.sent(ExecuteTrajectory, "/execute_trajectory", given)
    assert again.outcome is Outcome.ABORTED
    assert again.result.error_code.val == MoveItErrorCodes.START_STATE_INVALID
    fast = client.move(joints(**{LIFT: 0.0}), options=options).result.planned_trajectory
    hurried = [replace(point, velocities=point.velocities * 3) for point in fast.joint_trajectory.points]
    wrong = replace(fast, joint_trajectory=replace(fast.joint_trajectory, points=tuple(hurried)))
    refused = client.sent(ExecuteTrajectory, "/execute_trajectory", ExecuteTrajectory.Goal(trajectory=wrong))
    assert refused.result.error_code.val == MoveItErrorCodes.INVALID_MOTION_PLAN
    assert "limit of speed" in refused.result.error_code.message
    assert client.at(LIFT) == pytest.approx(-1.0, abs=0.02)


def test_a_plan_may_begin_elsewhere_and_the_service_tells_it(client: Client) -> None:
    request = motion(joints(**{ELBOW: 0.5}), start_state=state(**{LIFT: -1.0})).request
    answer = client.ask(GetMotionPlan, "/plan_kinematic_path", GetMotionPlan.Request(motion_plan_request=request))
    found = answer.motion_plan_response
    assert found.error_code.val == MoveItErrorCodes.SUCCESS
    first = found.trajectory.joint_trajectory
    assert first.points[0].positions[first.joint_names.index(LIFT)] == pytest.approx(-1.0)
    assert client.at(LIFT) == pytest.approx(0.0, abs=0.02)
    refused = client.move(joints(**{ELBOW: 0.5}), start_state=state(**{LIFT: -1.0})).result.error_code
    assert refused.val == MoveItErrorCodes.START_STATE_INVALID


def test_the_tip_keeps_its_orientation_on_the_way(client: Client) -> None:
    assert client.move(joints(**{LIFT: -1.2, ELBOW: 0.6})).outcome is Outcome.SUCCEEDED
    upright = tip_of(client)
    goal = joints(**{LIFT: -1.4, ELBOW: 0.8})
    keep = Constraints(orientation_constraints=(turned(upright, 0.3, 0.3, 6.3),))
    kept = client.move(goal, options=only_plan(), path_constraints=keep)
    assert kept.outcome is Outcome.SUCCEEDED, kept.result.error_code
    far = client.move(joints(**{LIFT: 0.0, ELBOW: 0.0}), options=only_plan(), path_constraints=keep)
    assert far.result.error_code.val == MoveItErrorCodes.PLANNING_FAILED
    assert far.result.error_code.message.startswith("not_kept")
    other = Constraints(orientation_constraints=(turned(Transform3(), 0.3, 0.3, 6.3),))
    words = client.move(goal, options=only_plan(), path_constraints=other).result.error_code
    assert words.val == MoveItErrorCodes.START_STATE_VIOLATES_PATH_CONSTRAINTS


def test_a_difference_of_the_scene_counts_for_one_motion(client: Client) -> None:
    wall = CollisionObject(
        id="wall",
        primitives=(SolidPrimitive(type=SolidPrimitive.BOX, dimensions=np.array((2.0, 2.0, 2.0))),),
        operation=CollisionObject.ADD,
    )
    there = PlanningScene(is_diff=True, world=PlanningSceneWorld(collision_objects=(wall,)))
    goal = joints(**{LIFT: -1.0})
    blocked = client.move(goal, options=PlanningOptions(planning_scene_diff=there)).result.error_code
    assert blocked.val == MoveItErrorCodes.START_STATE_IN_COLLISION
    assert "'wall'" in blocked.message
    assert client.scenes[-1].objects == ()
    assert client.move(goal).outcome is Outcome.SUCCEEDED  # it is gone
    lost = AttachedCollisionObject(link_name="nose", object=wall)
    odd = PlanningScene(is_diff=True, robot_state=RobotState(attached_collision_objects=(lost,)))
    refused = client.move(goal, options=PlanningOptions(planning_scene_diff=odd)).result.error_code
    assert refused.val == MoveItErrorCodes.INVALID_OBJECT_NAME
    assert "'nose'" in refused.message


def test_a_goal_is_cancelled_and_a_plan_does_not_end_the_goal_of_somebody_else(client: Client) -> None:
    ends, sent = client.begin(MoveGroup, "/move_action", motion(joints(**{LIFT: -1.5})))
    assert client.bench.run_until(lambda: "MONITOR" in client.feedback, 10.0)
    request = GetMotionPlan.Request(motion_plan_request=motion(joints(**{ELBOW: 0.5})).request)
    busy = client.ask(GetMotionPlan, "/plan_kinematic_path", request).motion_plan_response.error_code
    assert busy.val == MoveItErrorCodes.FAILURE
    assert not ends
    sent.cancel()
    assert client.bench.run_until(lambda: bool(ends), 10.0)
    assert ends[0].outcome is Outcome.CANCELED
    assert ends[0].result.error_code.val == MoveItErrorCodes.PREEMPTED
    others: list[Any] = []
    own = MoveArm.Goal(joints=(LIFT,), positions=np.array((-1.0,)))
    client.bench.bus.action_client("me", f"/{ARM}/move", MoveArm)(own, others.append)
    client.bench.advance(0.5)
    ended = client.move(joints(**{ELBOW: 0.5}), options=only_plan())
    assert (ended.outcome, ended.result.error_code.message) == (Outcome.ABORTED, "the arm moves")
    assert client.bench.run_until(lambda: bool(others), 20.0)
    assert others[0].outcome is Outcome.SUCCEEDED


GOAL = joints(**{LIFT: -1.0})
POINT = Constraints(position_constraints=(place(0.2, -0.1, 0.6),))


@for_all(
    "goal, fields, code, told",
    [
        (GOAL, {"group_name": "leg"}, MoveItErrorCodes.INVALID_GROUP_NAME, "there is no group 'leg': right_arm"),
        (GOAL, {"planner_id": "SBLkConfigDefault"}, MoveItErrorCodes.FAILURE, "there is no planner 'SBL'"),
        (GOAL, {"pipeline_id": "chomp"}, MoveItErrorCodes.FAILURE, "no pipeline 'chomp'"),
        (GOAL, {"allowed_planning_time": math.nan}, MoveItErrorCodes.FAILURE, "allowed_planning_time"),
        (GOAL, {"max_cartesian_speed": 0.1}, MoveItErrorCodes.FAILURE, "'max_cartesian_speed'"),
        (GOAL, {"trajectory_constraints": TrajectoryConstraints((GOAL,))}, MoveItErrorCodes.FAILURE, "'trajectory_con"),
        (GOAL, {"goal_constraints": (GOAL, GOAL)}, MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, "2 alternatives"),
        (GOAL, {"max_velocity_scaling_factor": 1.5}, MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, "not 150%"),
        (GOAL, {"start_state": state(knee=1.0)}, MoveItErrorCodes.INVALID_ROBOT_STATE, "there is no joint 'knee'"),
        (joints(knee=1.0), {}, MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, "'knee' is no joint of the arm"),
        (joints(**{LIFT: 9.0}), {}, MoveItErrorCodes.GOAL_STATE_INVALID, "goal_outside_limits"),
        (joints(), {}, MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS, "a goal is made of"),
        (
            replace(POINT, visibility_constraints=(VisibilityConstraint(),)),
            {},
            MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS,
            "what is visible",
        ),
        (
            Constraints(position_constraints=(place(9.0, 0.0, 0.0),)),
            {},
            MoveItErrorCodes.NO_IK_SOLUTION,
            "goal_out_of_reach",
        ),
        (
            Constraints(position_constraints=(place(0.2, 0.0, 0.5, "moon"),)),
            {},
            MoveItErrorCodes.FRAME_TRANSFORM_FAILURE,
            "there is no link 'moon'",
        ),
    ],
)
def test_what_cannot_be_has_a_code_and_a_text(
    client_at_rest: Client, goal: Constraints, fields: dict[str, Any], code: int, told: str
) -> None:
    end = client_at_rest.move(goal, **fields)
    assert end.outcome is Outcome.ABORTED
    assert (end.result.error_code.val, told in end.result.error_code.message) == (code, True), end.result.error_code
