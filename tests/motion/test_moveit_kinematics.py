"""Questions of MoveIt's programs about an arm, and the answers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion.collisions import MeshChecker, adjacent_pairs
from rbxcompose.domains.arms.motion.moveit import KinematicsQuery
from rbxcompose.msgs.geometry_msgs import PoseStamped
from rbxcompose.msgs.moveit_msgs import (
    Constraints,
    GetPositionFK,
    GetPositionIK,
    JointConstraint,
    MoveItErrorCodes,
    PositionConstraint,
    PositionIKRequest,
    RobotState,
)
from rbxcompose.msgs.poses import pose_message, pose_of
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.std_msgs import Header
from tests.loops import for_all
from tests.motion.toy_arm import kinematics, planner

ARM, SPACE = kinematics(), planner().space
AT = {"turn": 0.8, "lift": 0.3, "bend": 0.4}
QUERY = KinematicsQuery("arm", ARM, SPACE, MeshChecker(ARM, {}, adjacent_pairs(ARM.body)), dict.fromkeys(AT, 0.1))


def state(**positions: float) -> RobotState:
    return RobotState(joint_state=JointState(name=tuple(positions), position=np.array([*positions.values()])))


def at(x: float) -> PoseStamped:
    return PoseStamped(pose=pose_message(Transform3((x, 0.0, 0.0))))


def joint(name: str, position: float, tolerance: float = 0.1) -> Constraints:
    one = JointConstraint(
        joint_name=name, position=position, tolerance_above=tolerance, tolerance_below=tolerance, weight=1.0
    )
    return Constraints(joint_constraints=(one,))


def tip(frame: str = "") -> GetPositionFK.Response:
    return QUERY.forward(GetPositionFK.Request(header=Header(frame_id=frame), robot_state=state(**AT)))


def asked(**fields: Any) -> GetPositionIK.Response:
    fields = {"pose_stamped": tip().pose_stamped[0], **fields}
    return next(response for response in QUERY.inverse(PositionIKRequest(**fields), 1) if response is not None)


@pytest.mark.parametrize("frame", ["", "ground", "turret"])
def test_the_inverse_of_the_forward_kinematics_brings_the_tip_to_the_same_place(frame: str) -> None:
    there = tip(frame).pose_stamped[0]
    seen_from = {"turn": 0.8, "lift": 0.1, "bend": 0.1}  # the turret has turned
    answer = asked(pose_stamped=there, group_name="arm", robot_state=state(**seen_from), avoid_collisions=True)
    assert answer.error_code.val == MoveItErrorCodes.SUCCESS, answer.error_code.message
    found = answer.solution.joint_state
    again = QUERY.forward(GetPositionFK.Request(robot_state=RobotState(joint_state=found)))
    before, after = (pose_of(response.pose_stamped[0].pose).translation for response in (tip(), again))
    assert after == pytest.approx(before, abs=2e-3)


def test_links_are_told_in_the_order_in_which_they_were_asked_for() -> None:
    answer = QUERY.forward(GetPositionFK.Request(fk_link_names=("fore", "ground"), robot_state=state(**AT)))
    assert answer.fk_link_names == ("fore", "ground")
    assert pose_of(answer.pose_stamped[1].pose).translation == pytest.approx((0.0, 0.0, 0.0))


@for_all(
    "fields, code",
    [
        ({"group_name": "leg"}, MoveItErrorCodes.INVALID_GROUP_NAME),
        ({"ik_link_name": "fore"}, MoveItErrorCodes.INVALID_LINK_NAME),
        ({"pose_stamped": PoseStamped(header=Header(frame_id="moon"))}, MoveItErrorCodes.FRAME_TRANSFORM_FAILURE),
        ({"pose_stamped": at(9.0)}, MoveItErrorCodes.NO_IK_SOLUTION),
        ({"pose_stamped": at(math.nan)}, MoveItErrorCodes.NO_IK_SOLUTION),
        ({"robot_state": state(knee=0.0)}, MoveItErrorCodes.INVALID_ROBOT_STATE),
        ({"robot_state": state(turn=math.nan)}, MoveItErrorCodes.INVALID_ROBOT_STATE),
        (
            {"constraints": Constraints(position_constraints=(PositionConstraint(),))},
            MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS,
        ),
        ({"constraints": joint("knee", 0.0)}, MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS),
        ({"constraints": joint("bend", 0.0, -0.1)}, MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS),
        ({"constraints": joint("bend", math.nan)}, MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS),
        ({"constraints": joint("bend", 3.0)}, MoveItErrorCodes.INVALID_GOAL_CONSTRAINTS),
        ({"constraints": joint("bend", -0.4)}, MoveItErrorCodes.NO_IK_SOLUTION),
    ],
)
def test_what_cannot_be_answered_has_a_code_and_a_text(fields: dict[str, Any], code: int) -> None:
    answer = asked(**fields)
    assert answer.error_code.val == code
    assert answer.error_code.message


def test_a_place_in_the_wall_is_in_collision_only_if_that_counts() -> None:
    inside = QUERY.forward(GetPositionFK.Request(robot_state=state(turn=0.0, lift=0.0, bend=0.0))).pose_stamped[0]
    assert asked(pose_stamped=inside, avoid_collisions=True).error_code.val == MoveItErrorCodes.GOAL_IN_COLLISION
    assert asked(pose_stamped=inside).error_code.val == MoveItErrorCodes.SUCCESS


def test_a_constraint_of_a_joint_is_kept_and_its_middle_preferred() -> None:
    answer = asked(constraints=joint("bend", 0.35), robot_state=state(turn=0.8, lift=0.0, bend=0.0))
    assert answer.error_code.val == MoveItErrorCodes.SUCCESS, answer.error_code.message
    found = dict(zip(answer.solution.joint_state.name, answer.solution.joint_state.position.tolist(), strict=True))
    assert 0.25 <= found["bend"] <= 0.45
    assert found == pytest.approx(AT, abs=5e-3)
