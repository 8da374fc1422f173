"""Goals of arms: in missions, as far as the text shows them, and from messages to what tasks take."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

from rbxcompose.base.geometry import Quaternion, Transform3, quaternion_from_rpy
from rbxcompose.base.units import ANGLE, LENGTH, RATIO, SPEED
from rbxcompose.domains.arms.motion.arm_task import ArmGoal, ArmTask
from rbxcompose.domains.arms.motion.inverse_kinematics import SOLVER, PoseTarget, SolverSettings
from rbxcompose.domains.arms.motion.parametrisation import Trajectory
from rbxcompose.domains.arms.motion.path_constraints import ANGLE as SIGHT_ANGLE
from rbxcompose.domains.arms.motion.path_constraints import RADIUS, Keep, KeptSight
from rbxcompose.domains.arms.motion.scene_messages import joint_trajectory
from rbxcompose.domains.arms.motion.trace_planner import ANY_SPEED, TraceWish, WayPoint
from rbxcompose.msgs import rbxcompose_msgs
from rbxcompose.msgs.control_msgs import FollowJointTrajectory
from rbxcompose.msgs.fields import Measures, NumberRange
from rbxcompose.msgs.moveit_msgs import ExecuteTrajectory, MoveGroup

POSE_MEASURES = {**dict.fromkeys(("x", "y", "z"), LENGTH), **dict.fromkeys(("roll", "pitch", "yaw"), ANGLE)}
SIGHT_MEASURES: Measures = {**dict.fromkeys(("x", "y", "z", "radius"), LENGTH), "angle": ANGLE}
KEEP_MEASURES: Measures = {**POSE_MEASURES, "joints": {"lower": None, "upper": None}, "sight": SIGHT_MEASURES}
SHARES = {"speed": RATIO, "acceleration": RATIO}
SHARE = NumberRange(0.0, 1.0, is_open=True)
RANGES = {"speed": SHARE, "acceleration": SHARE, "tolerance": NumberRange(), "angle_tolerance": NumberRange()}
TRACE_RANGES = {"speed": NumberRange(is_open=True), "acceleration": SHARE, "blend": NumberRange(), "least": SHARE}
MOVE_MEASURES: Measures = {**SHARES, "tolerance": ANGLE, "keep": KEEP_MEASURES}
REACH_MEASURES: Measures = {**POSE_MEASURES, **MOVE_MEASURES, "tolerance": LENGTH, "angle_tolerance": ANGLE}
TRACE_MEASURES: Measures = {**SHARES, "points": POSE_MEASURES, "speed": SPEED, "blend": LENGTH, "least": RATIO}
ACTIONS = (
    rbxcompose_msgs.MoveArm,
    rbxcompose_msgs.ReachPose,
    rbxcompose_msgs.TraceArm,
    rbxcompose_msgs.PickObject,
    rbxcompose_msgs.PlaceObject,
    MoveGroup,
    ExecuteTrajectory,
)
STATES = {"planning": "PLANNING", "moving": "MONITOR"}  # as clients of MoveIt know stages
ArmMessage = rbxcompose_msgs.MoveArm.Goal | rbxcompose_msgs.ReachPose.Goal | rbxcompose_msgs.TraceArm.Goal


def action_of(message: Any) -> Any:
    """Return the action that a goal belongs to."""
    return next(action for action in ACTIONS if isinstance(message, action.Goal))


def feedback_of(message: Any, stage: str) -> Any:
    """Return what the client of a goal receives about its stage."""
    action = action_of(message)
    if action in (MoveGroup, ExecuteTrajectory):
        return action.Feedback(state=STATES.get(stage, stage))
    return action.Feedback(stage=stage)


def follow_goal(names: tuple[str, ...], trajectory: Trajectory) -> FollowJointTrajectory.Goal:
    """Return a trajectory as its controller takes it: with its start, a little beside which it may command joints."""
    return FollowJointTrajectory.Goal(trajectory=joint_trajectory(names, trajectory, begin=0))


def goal_of(message: ArmMessage, solver: SolverSettings = SOLVER) -> ArmGoal:
    """Return a goal as the task takes it: 0 in place of a share, a speed or a tolerance stands for the usual one."""
    acceleration = message.acceleration or 1.0
    if isinstance(message, rbxcompose_msgs.TraceArm.Goal):
        wish = TraceWish(
            tuple(map(_point, message.points)),
            message.relative,
            message.keep_orientation,
            message.any_orientation,
            message.speed or ANY_SPEED,
            message.blend,
            message.least or 1.0,
            acceleration,
        )
        return ArmGoal(trace=wish, frame=message.frame, acceleration=acceleration)
    ask = partial(
        ArmGoal, speed=message.speed or 1.0, acceleration=acceleration, keep=_keep(message.keep), replans=message.replan
    )
    if isinstance(message, rbxcompose_msgs.MoveArm.Goal):
        positions = dict(zip(message.joints, message.positions.tolist(), strict=False))
        return ask(message.remembered or message.pose, positions, tolerance=message.tolerance)
    target = PoseTarget(
        Transform3((message.x, message.y, message.z), _turn(message)),
        message.any_orientation,
        message.tolerance or solver.tolerance,
        message.angle_tolerance or solver.angle_tolerance,
        message.any_position,
        message.approximate,
    )
    return ask(target=target, frame=message.frame, prefer=message.prefer)


def ended_as(message: Any, task: ArmTask) -> Any:
    """Return the result of a goal, whose action is one of those that such a task carries out."""
    failed, missed = task.failure, task.missed
    words: dict[str, Any] = {"outcome": failed.reason, "message": failed.text} if failed is not None else {}
    if isinstance(message, rbxcompose_msgs.TraceArm.Goal):
        words["fraction"] = task.share
    if isinstance(message, rbxcompose_msgs.ReachPose.Goal) and failed is None and missed is not None:
        text = f"approximate: the tip is {missed[0] * 100:.1f} cm and {math.degrees(missed[1]):.1f} deg from the pose"
        words = {"message": text, "approximate": True, "away": missed[0], "angle": missed[1]}
    return action_of(message).Result(**words)


def _keep(message: rbxcompose_msgs.PathConstraints) -> Keep:
    x, y, z = (_range(one.tolist()) for one in (message.x, message.y, message.z))
    joints = {joint.name: (joint.lower, joint.upper) for joint in message.joints}
    sight = _sight(message.sight)
    return Keep((message.roll, message.pitch, message.yaw), (x, y, z), joints, message.frame, sight)


def _sight(message: rbxcompose_msgs.Sight) -> KeptSight | None:
    """Return what is to be seen; None if nothing is asked for."""
    if message == rbxcompose_msgs.Sight():
        return None
    return KeptSight(
        message.sensor,
        message.target,
        (message.x, message.y, message.z),
        message.radius or RADIUS,
        message.angle or SIGHT_ANGLE,
        message.along,
        tuple(message.through),
    )


def _range(numbers: list[float]) -> tuple[float, float] | None:
    """Return a range; one that does not consist of two numbers goes nowhere."""
    return None if not numbers else (numbers[0], numbers[1]) if len(numbers) == 2 else (math.nan, math.nan)


def _point(message: rbxcompose_msgs.TipPoint) -> WayPoint:
    return WayPoint(Transform3((message.x, message.y, message.z), _turn(message)), message.via)


def _turn(message: rbxcompose_msgs.ReachPose.Goal | rbxcompose_msgs.TipPoint) -> Quaternion:
    angles = (message.roll, message.pitch, message.yaw)
    return quaternion_from_rpy(*angles) if all(map(math.isfinite, angles)) else (math.nan,) * 4
