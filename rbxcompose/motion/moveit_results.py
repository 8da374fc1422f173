"""Motions as MoveIt's messages have them, and its codes for why there is none."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbxcompose.motion.moveit_requests import RequestError
from rbxcompose.motion.parametrisation import Trajectory
from rbxcompose.motion.reasons import MotionFailure, MotionReason
from rbxcompose.msgs.moveit_msgs import MoveItErrorCodes as Codes
from rbxcompose.msgs.moveit_msgs import RobotTrajectory
from rbxcompose.msgs.stamps import to_duration, to_seconds
from rbxcompose.msgs.trajectory_msgs import JointTrajectory, JointTrajectoryPoint

Array = NDArray[np.float64]
CODES = {
    MotionReason.UNKNOWN_GOAL: Codes.INVALID_GOAL_CONSTRAINTS,
    MotionReason.UNKNOWN_START: Codes.ROBOT_STATE_STALE,
    MotionReason.UNKNOWN_SCENE: Codes.COLLISION_CHECKING_UNAVAILABLE,
    MotionReason.START_OUTSIDE_LIMITS: Codes.START_STATE_INVALID,
    MotionReason.START_IN_COLLISION: Codes.START_STATE_IN_COLLISION,
    MotionReason.GOAL_OUTSIDE_LIMITS: Codes.GOAL_STATE_INVALID,
    MotionReason.GOAL_IN_COLLISION: Codes.GOAL_IN_COLLISION,
    MotionReason.GOAL_OUT_OF_REACH: Codes.NO_IK_SOLUTION,
    MotionReason.NO_PATH_IN_TIME: Codes.TIMED_OUT,
    MotionReason.PATH_IN_COLLISION: Codes.INVALID_MOTION_PLAN,
    MotionReason.NOT_KEPT: Codes.PLANNING_FAILED,
    MotionReason.PATH_INCOMPLETE: Codes.PLANNING_FAILED,
    MotionReason.NO_TIMING: Codes.INVALID_MOTION_PLAN,
    MotionReason.START_MOVED: Codes.START_STATE_INVALID,
    MotionReason.NOT_FOLLOWED: Codes.CONTROL_FAILED,
    MotionReason.INTERRUPTED: Codes.PREEMPTED,
}
"""MoveIt's code for each reason; a motion that something comes into the way of has one more."""


def not_done(code: int, text: str) -> Codes:
    """Return why a request was not carried out."""
    return Codes(val=code, message=text, source="rbxcompose")


def code_of(failure: MotionFailure | None, *, is_moving: bool) -> Codes:
    """Return how a motion has ended; with `is_moving` it had begun."""
    if failure is None:
        return Codes(val=Codes.SUCCESS, source="rbxcompose")
    value = CODES[failure.reason]
    if is_moving and failure.reason is MotionReason.PATH_IN_COLLISION:
        value = Codes.MOTION_PLAN_INVALIDATED_BY_ENVIRONMENT_CHANGE
    return not_done(value, f"{failure.reason}: {failure.text}")


def motion_message(names: tuple[str, ...], trajectory: Trajectory) -> RobotTrajectory:
    """Return a motion with where it begins as its first point."""
    rows = zip(trajectory.times.tolist(), trajectory.positions, trajectory.velocities, strict=True)
    points = tuple(
        JointTrajectoryPoint(positions=at, velocities=speed, time_from_start=to_duration(time))
        for time, at, speed in rows
    )
    return RobotTrajectory(joint_trajectory=JointTrajectory(joint_names=names, points=points))


def trace_message(names: tuple[str, ...], times: list[float], rows: list[list[float]]) -> RobotTrajectory:
    """Return where joints were at some times."""
    points = tuple(
        JointTrajectoryPoint(positions=np.array(row), time_from_start=to_duration(time))
        for time, row in zip(times, rows, strict=True)
    )
    return RobotTrajectory(joint_trajectory=JointTrajectory(joint_names=names if points else (), points=points))


def trajectory_of(message: RobotTrajectory, names: tuple[str, ...], here: Array) -> Trajectory:
    """Return the motion of a message for joints that are `here`; those that it does not name stay there.

    A controller follows cubic curves, so that only positions and velocities of the points count. A motion that does
    not begin at the time 0 begins at rest, where the arm is.

    Raises:
        RequestError: if it is no motion of these joints.
    """
    joints, points = message.joint_trajectory.joint_names, message.joint_trajectory.points
    if message.multi_dof_joint_trajectory.points or not joints or not points:
        raise RequestError(Codes.INVALID_MOTION_PLAN, "the trajectory has no points of joints alone")
    if (unknown := [name for name in joints if name not in names]) or len(set(joints)) != len(joints):
        words = f"'{unknown[0]}' is no joint of this arm" if unknown else "a joint is named twice"
        raise RequestError(Codes.INVALID_MOTION_PLAN, words)
    if any(len(one.positions) != len(joints) or len(one.velocities) != len(joints) for one in points):
        raise RequestError(Codes.INVALID_MOTION_PLAN, "a point does not have a position and a velocity of each joint")
    columns = [names.index(name) for name in joints]
    times = np.array([to_seconds(one.time_from_start) for one in points])
    positions, velocities = np.tile(here, (len(points), 1)), np.zeros((len(points), len(names)))
    positions[:, columns] = [one.positions for one in points]
    velocities[:, columns] = [one.velocities for one in points]
    if times[0] > 0.0:
        times, positions = np.concatenate(([0.0], times)), np.concatenate((here[None], positions))
        velocities = np.concatenate((np.zeros((1, len(names))), velocities))
    numbers = (times, positions, velocities)
    if times[0] < 0.0 or np.any(np.diff(times) <= 0.0) or not all(np.all(np.isfinite(one)) for one in numbers):
        raise RequestError(Codes.INVALID_MOTION_PLAN, "the times of points do not increase, or a number is none")
    if velocities[0].any() or velocities[-1].any():
        raise RequestError(Codes.INVALID_MOTION_PLAN, "the motion does not begin and end at rest")
    return Trajectory(times, positions, velocities)
