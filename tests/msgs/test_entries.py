"""Two parallel arrays of a message as entries."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.expressions.types import TYPES
from rbxcompose.base.units import ANGLE, LENGTH
from rbxcompose.missions.program.goals import filled, goal_of, skill_of, topic_skill
from rbxcompose.msgs.builtin_interfaces import Duration
from rbxcompose.msgs.control_msgs import FollowJointTrajectory
from rbxcompose.msgs.fields import ArrayEntries
from rbxcompose.msgs.rbxcompose_msgs import MoveJoints
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.stamps import to_duration
from rbxcompose.sdk import ServesAction, ServesTopic

NAMES = st.text(st.characters(codec="utf-8", exclude_categories=["C"]), min_size=1, max_size=8)
NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
HEAD = ArrayEntries("joints", "positions", {"pan": ANGLE, "lift": LENGTH})


@given(st.dictionaries(NAMES, NUMBERS), st.floats(0.0, 1e6))
def test_names_and_values_arrive_in_step_and_in_the_order_in_which_they_are_given(
    values: dict[str, float], duration: float
) -> None:
    values.pop("duration", None)
    entries = ArrayEntries("joints", "positions", dict.fromkeys(sorted(values), ANGLE))
    goal = goal_of(MoveJoints, {**values, "duration": duration}, entries)
    assert isinstance(goal, MoveJoints.Goal)
    assert list(zip(goal.joints, goal.positions.tolist(), strict=True)) == list(values.items())
    assert goal.duration == to_duration(duration)


def test_each_entry_is_an_argument_of_its_own_dimension_and_none_is_the_main_one() -> None:
    skill = skill_of(MoveJoints, "head", "head", entries=HEAD)
    assert skill.arguments == {"pan": TYPES["angle"], "lift": TYPES["length"], "duration": TYPES["time"]}
    assert (skill.main, skill.required, skill.entries) == ("", frozenset(), HEAD)


def test_what_is_left_out_is_in_no_array() -> None:
    goal = goal_of(MoveJoints, {"lift": 1}, HEAD)
    assert goal == MoveJoints.Goal(joints=("lift",), positions=(1.0,))  # type: ignore[arg-type]


def test_a_field_takes_precedence_over_an_entry_of_its_name() -> None:
    entries = ArrayEntries("joints", "positions", {"duration": ANGLE, "pan": ANGLE})
    assert skill_of(MoveJoints, "head", entries=entries).arguments["duration"] == TYPES["time"]
    goal = goal_of(MoveJoints, {"duration": 2.0, "pan": 1.0}, entries)
    assert goal == MoveJoints.Goal(joints=("pan",), positions=(1.0,), duration=Duration(sec=2))  # type: ignore[arg-type]


def test_an_order_on_a_topic_has_them_too() -> None:
    entries = ArrayEntries("name", "position", {"pan": ANGLE})
    assert topic_skill(JointState, "pose", entries=entries).arguments == {"pan": TYPES["angle"]}
    order = filled(JointState, {"pan": 0.5}, entries)
    assert isinstance(order, JointState)
    assert (order.name, order.position.tolist()) == (("pan",), [0.5])
    assert ServesTopic(JointState, "pose", entries=entries).entries is entries


@pytest.mark.parametrize(("names", "values"), [("joint", "positions"), ("joints", "duration"), ("positions", "joints")])
def test_a_message_without_such_arrays_is_refused(names: str, values: str) -> None:
    entries = ArrayEntries(names, values, {"pan": ANGLE})
    with pytest.raises(ValueError, match="rbxcompose_msgs/action/MoveJoints_Goal has no field"):
        ServesAction(MoveJoints, "head/move", entries=entries)
    with pytest.raises(ValueError, match="has no field"):
        ServesAction(FollowJointTrajectory, "head/follow", entries=entries)
