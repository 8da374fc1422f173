"""An arm tells where it is, and goes back to what it was told to remember."""

from __future__ import annotations

from typing import Any

import pytest

from rbxcompose.base.levels import Level
from rbxcompose.msgs.rbxcompose_msgs import LocateArm, MoveArm
from rbxcompose.sdk.bound import Outcome
from rbxcompose.testing import Bench
from tests.components.slow_servos import with_slow_servos
from tests.shipped import robot_and_plan

TYPES = ("arm", "scene", "servo_bus")


@pytest.fixture
def bench() -> Bench:
    _, plan = robot_and_plan("pi_robot")
    found = Bench(*(instance for instance in with_slow_servos(plan.instances) if instance.type in TYPES))
    found.advance(0.5)
    return found


def located(bench: Bench, **asked: str) -> LocateArm.Response:
    replies: list[Any] = []
    bench.bus.client("me", "/right_arm/locate", LocateArm)(LocateArm.Request(**asked), replies.append)
    bench.advance(0.2)
    response: LocateArm.Response = replies[0].response
    return response


def moved(bench: Bench, **goal: Any) -> Any:
    ends: list[Any] = []
    bench.bus.action_client("me", "/right_arm/move", MoveArm)(MoveArm.Goal(**goal), ends.append)
    assert bench.run_until(lambda: bool(ends), 30.0)
    return ends[0]


def test_it_tells_where_its_tip_is_in_the_frame_of_a_link_and_how_it_is_turned(bench: Bench) -> None:
    hanging = located(bench, frame="right_arm_base_link")
    assert hanging.success
    assert (hanging.x, hanging.y, hanging.z) == pytest.approx((0.0, -0.064, -0.3625), abs=2e-3)
    assert hanging.pitch == pytest.approx(1.5708, abs=5e-3)
    assert hanging.message.startswith("'right_arm_tip' in 'right_arm_base_link': x ")
    assert located(bench).z == pytest.approx(hanging.z + 0.81, abs=1e-6)


def test_it_goes_back_to_the_last_place_of_a_name_and_joints_that_are_given_take_precedence(bench: Bench) -> None:
    arm: Any = bench.component("right_arm")
    for pose in ("ready", "straight_forward"):
        assert moved(bench, pose=pose).outcome is Outcome.SUCCEEDED
        assert located(bench, remember="there").success
    assert moved(bench, pose="wave").outcome is Outcome.SUCCEEDED
    elbow = "right_arm_elbow_flex_joint"
    assert moved(bench, remembered="there", joints=(elbow,), positions=(0.3,)).outcome is Outcome.SUCCEEDED
    wanted = arm.config.poses["straight_forward"] | {elbow: 0.3}
    assert max(abs(arm.measured[name][0] - at) for name, at in wanted.items()) < 0.01


def test_what_cannot_be_told_remembered_or_returned_to_is_refused_with_the_reason(bench: Bench) -> None:
    assert located(bench, frame="nose").message == "there is no link 'nose'"
    assert "'wave' is a pose of this arm" in located(bench, remember="wave").message
    assert "more than 100 characters" in located(bench, remember="a" * 101).message
    end = moved(bench, remembered="nowhere")
    assert (end.outcome, end.result.outcome) == (Outcome.ABORTED, "unknown_goal")
    assert "there is no pose 'nowhere'" in end.result.message
    arm: Any = bench.component("right_arm")
    arm.remembered = {str(number): {} for number in range(100)}
    assert "100 names already" in located(bench, remember="one more").message
    assert located(bench, remember="7").success
    arm.measured.pop("right_arm_elbow_flex_joint")
    assert arm.on_locate(LocateArm.Request()).message == "nothing has reported where 'right_arm_elbow_flex_joint' is"


def test_an_arm_that_knows_no_scene_says_so_in_diagnostics_until_one_has_come(bench: Bench) -> None:
    told = bench.statuses("right_arm: scene")
    bench.advance(1.0)
    assert told[-1].level == Level.OK
    (arm,) = (one for one in bench.plan.instances if one.type == "arm")
    alone = Bench(arm)
    told = alone.statuses("right_arm: scene")
    alone.advance(1.0)
    assert (told[-1].level, told[-1].message) == (Level.WARN, "nothing is planned: no planning scene has been received")
