"""Actions as skills and arguments as goals."""

from __future__ import annotations

import math

import pytest

from rbxcompose.base.config import Place
from rbxcompose.base.expressions.types import POSE, TEXT, TYPES
from rbxcompose.base.geometry import Pose2
from rbxcompose.missions.program.goals import goal_of, message_of, skill_of, values_of
from rbxcompose.msgs.nav2_msgs import NavigateToPose, Wait
from rbxcompose.msgs.rbxcompose_msgs import Recharge
from rbxcompose.msgs.stamps import to_duration


def test_the_fields_of_a_goal_are_the_arguments_and_the_first_is_the_main_one() -> None:
    skill = skill_of(NavigateToPose, "go_to", claims="base")
    assert skill.arguments == {"pose": POSE, "behavior_tree": TEXT}
    assert (skill.main, skill.required, skill.claims, skill.restartable) == ("pose", frozenset({"pose"}), "base", True)


def test_a_main_argument_that_may_lack_is_not_required() -> None:
    skill = skill_of(NavigateToPose, "go_to", may_lack=True)
    assert (skill.main, skill.required) == ("pose", frozenset())


def test_an_empty_goal_makes_a_skill_without_arguments() -> None:
    skill = skill_of(Recharge, "recharge")
    assert (skill.main, skill.arguments, skill.required) == ("", {}, frozenset())
    assert goal_of(Recharge, {}) == Recharge.Goal()


@pytest.mark.parametrize("place", [Place("dock", 1.0, 2.0, math.pi / 2), Pose2(1.0, 2.0, math.pi / 2)])
def test_a_place_or_a_pose_becomes_a_stamped_pose_in_the_map(place: object) -> None:
    goal = goal_of(NavigateToPose, {"pose": place, "behavior_tree": "x"})
    assert isinstance(goal, NavigateToPose.Goal)
    pose = goal.pose
    assert (pose.header.frame_id, pose.pose.position.x, pose.pose.position.y) == ("map", 1.0, 2.0)
    assert (pose.pose.orientation.z, pose.pose.orientation.w) == pytest.approx((math.sqrt(0.5), math.sqrt(0.5)))
    assert goal.behavior_tree == "x"


def test_a_length_of_time_goes_into_a_goal_and_comes_out_of_a_result_in_seconds() -> None:
    vacuum = skill_of(Wait, "vacuum")
    assert vacuum.arguments == {"time": TYPES["time"]}
    assert vacuum.required == {"time"}
    assert goal_of(Wait, {"time": 2.5}) == Wait.Goal(time=to_duration(2.5))
    assert message_of(Wait.Goal, {"time": 2.5}) == Wait.Goal(time=to_duration(2.5))
    found = values_of(Wait.Result(total_elapsed_time=to_duration(2.5)))
    assert found["total_elapsed_time"] == 2.5
    assert vacuum.results["total_elapsed_time"] == TYPES["time"]
