"""The verbs of `arm` that need no running robot."""

from __future__ import annotations

import json
from collections.abc import Sequence

import pytest

from rbxcompose.cli import main as command
from tests.conftest import ROOT

PI_ROBOT = str(ROOT / "robots/pi_robot")
REACH = "{x: 22 cm, y: -12 cm, z: 55 cm}"


def in_order(words: Sequence[str]) -> list[str]:
    """Return the words with the robot behind the verb and its goal, before the options."""
    return [*words[:2], PI_ROBOT, *words[2:]]


def answered(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, object]:
    assert command.main(["arm", *in_order(words), "--json"]) == 0
    found: dict[str, object] = json.loads(capsys.readouterr().out)
    return found


def test_a_plan_begins_and_ends_where_it_was_asked_to(capsys: pytest.CaptureFixture[str]) -> None:
    plan = answered(capsys, "plan", "wave", "--from", "straight_forward")
    waypoints = plan["waypoints"]
    assert isinstance(waypoints, list)
    lifts = [waypoints[index]["right_arm_shoulder_lift_joint"] for index in (0, -1)]
    assert lifts == pytest.approx([-1.5708, -2.5307], abs=1e-3)


def test_what_inverse_kinematics_finds_is_where_forward_kinematics_ends(capsys: pytest.CaptureFixture[str]) -> None:
    solutions = answered(capsys, "ik", REACH, "--frame", "torso_link", "--any-orientation")["solutions"]
    assert isinstance(solutions, list)
    goal = ", ".join(f"{name}: {value} rad" for name, value in solutions[0].items())
    found, root = (answered(capsys, "fk", one) for one in (f"{{{goal}}}", "resting"))
    assert found["frame"] == root["frame"] == "base_footprint"
    position = found["position"]
    assert isinstance(position, list)
    assert position[0] == pytest.approx(0.12, abs=2e-3)  # the torso stands 10 cm behind the middle


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["plan", "wav"], "did you mean 'wave'?"),
        (["plan", "{right_arm_elbow: 1 deg}"], "no joint of this arm"),
        (["plan", "{right_arm_elbow_flex_joint: 1}"], "must be an angle or a length"),
        (["plan", "{right_arm_shoulder_pan_joint: -115 deg, right_arm_shoulder_lift_joint: 69 deg}"], "goal_in_coll"),
        (["ik", "{x: 2 m}"], "goal_out_of_reach: the tip got within"),
        (["ik", REACH, "--frame", "torso"], "there is no link 'torso'"),
        (["fk", "wave", "--arm", "left_arm"], "there is no arm 'left_arm'"),
    ],
)
def test_what_cannot_be_says_why(words: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["arm", *in_order(words)]) == 1
    assert told in capsys.readouterr().err
