"""Why there is no motion: a closed list, and a text that names the pair, the limit or what was tried."""

from __future__ import annotations

from enum import StrEnum

from rbxcompose.base.dataclass import dataclass


class MotionReason(StrEnum):
    """Why a motion was not planned or not carried out."""

    UNKNOWN_GOAL = "unknown_goal"  # no such pose or joint, or numbers that are none
    UNKNOWN_START = "unknown_start"  # not all joints have reported where they are
    UNKNOWN_SCENE = "unknown_scene"  # no planning scene has been received
    START_OUTSIDE_LIMITS = "start_outside_limits"
    START_IN_COLLISION = "start_in_collision"
    GOAL_OUTSIDE_LIMITS = "goal_outside_limits"
    GOAL_IN_COLLISION = "goal_in_collision"
    GOAL_OUT_OF_REACH = "goal_out_of_reach"  # no positions of joints bring the tip there
    NO_PATH_IN_TIME = "no_path_in_time"
    PATH_IN_COLLISION = "path_in_collision"  # found, but not when examined finely
    NOT_KEPT = "not_kept"  # start, goal or way break what is to be kept
    PATH_INCOMPLETE = "path_incomplete"  # the tip gets along a part of its way only
    NO_TIMING = "no_timing"  # no velocities were found within the limits
    START_MOVED = "start_moved"  # the arm was moved while its motion was planned
    NOT_FOLLOWED = "not_followed"  # its controller failed
    INTERRUPTED = "interrupted"


REASONS = tuple(map(str, MotionReason))


@dataclass(frozen=True, slots=True)
class MotionFailure:
    """Why there is no motion, with the details for people."""

    reason: MotionReason
    text: str
    share: float = 0.0
    """How much of the way that was asked for would be possible."""


class GraspReason(StrEnum):
    """Why an object was not picked or placed, beside the reasons of motions."""

    UNKNOWN_OBJECT = "unknown_object"  # it is not in the scene
    ALREADY_HOLDS = "already_holds"  # the arm holds an object, so that it cannot pick
    NOTHING_HELD = "nothing_held"  # the arm holds none, so that it cannot place
    NO_GRASPS = "no_grasps"  # its shape does not show how to hold it, and nothing else does
    TOO_WIDE = "too_wide"  # the gripper does not open that far
    LINE_OUT_OF_REACH = "line_out_of_reach"  # joints cannot follow a straight line of the tip
    GRIPPER_FAILED = "gripper_failed"  # its controller failed
    NOTHING_GRASPED = "nothing_grasped"  # the gripper closed farther than the object is wide
    NOT_ATTACHED = "not_attached"  # the scene did not attach or detach the object


GRASP_REASONS = (*REASONS, *map(str, GraspReason))


@dataclass(frozen=True, slots=True)
class StageFailure:
    """Why an object was not picked or placed: in which stage, and why."""

    stage: str
    reason: MotionReason | GraspReason
    text: str
