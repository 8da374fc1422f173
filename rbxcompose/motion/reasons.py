"""Why there is no motion: a closed list, and a text that names the pair, the limit or what was tried."""

from __future__ import annotations

from enum import StrEnum

from rbxcompose.dataclass import dataclass


class MotionReason(StrEnum):
    """Why a motion was not planned or not carried out."""

    UNKNOWN_GOAL = "unknown_goal"  # no such pose or joint, or numbers that are none
    UNKNOWN_START = "unknown_start"  # not all joints have reported where they are
    UNKNOWN_SCENE = "unknown_scene"  # nothing has told what is around the robot
    START_OUTSIDE_LIMITS = "start_outside_limits"
    START_IN_COLLISION = "start_in_collision"
    GOAL_OUTSIDE_LIMITS = "goal_outside_limits"
    GOAL_IN_COLLISION = "goal_in_collision"
    GOAL_OUT_OF_REACH = "goal_out_of_reach"  # no positions of joints bring the tip there
    NO_PATH_IN_TIME = "no_path_in_time"
    PATH_IN_COLLISION = "path_in_collision"  # found, but not when examined finely
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
