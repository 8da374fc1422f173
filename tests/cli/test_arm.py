"""The verbs of `arm` that need no running robot."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from rbxcompose.commands import main as command
from tests.conftest import ROOT
from tests.loops import for_all

PI_ROBOT = str(ROOT / "robots/pi_robot")
REACH = "{x: 22 cm, y: -12 cm, z: 55 cm}"


def in_order(words: Sequence[str]) -> list[str]:
    """Return the words with the robot behind the verb and its goal, before the options."""
    first = next((index for index, word in enumerate(words) if word.startswith("--")), len(words))
    return [*words[:first], PI_ROBOT, *words[first:]]


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
    each = np.array([[*solution.values()] for solution in solutions])
    assert (np.abs(each[:, None] - each).max(-1) > 1e-3).sum() == len(each) * (len(each) - 1), "none twice"
    goal = ", ".join(f"{name}: {value} rad" for name, value in solutions[0].items())
    found, root = (answered(capsys, "fk", text) for text in (f"{{{goal}}}", "resting"))
    assert found["frame"] == root["frame"] == "base_footprint"
    position = found["position"]
    assert isinstance(position, list)
    assert position[0] == pytest.approx(0.12, abs=2e-3)  # the torso stands 10 cm behind the middle


def test_an_orientation_alone_is_taken_in_the_posture_that_is_preferred(capsys: pytest.CaptureFixture[str]) -> None:
    joints = ("right_arm_shoulder_lift_joint", "right_arm_elbow_flex_joint")
    for lift, elbow in ((-1.0, 0.2), (-0.6, 0.9)):
        liked = f"{{{joints[0]}: {lift} rad, {joints[1]}: {elbow} rad}}"
        found = answered(capsys, "ik", "{pitch: 40 deg}", "--any-position", "--prefer", liked)
        solutions, errors = found["solutions"], found["errors"]
        assert isinstance(solutions, list)
        assert isinstance(errors, list)
        assert [solutions[0][joint] for joint in joints] == pytest.approx([lift, elbow], abs=0.02)
        assert (errors[0]["away"], found["approximate"]) == (0.0, False)
        assert errors[0]["angle"] < math.radians(0.5)


def test_the_nearest_pose_is_told_with_what_remains(capsys: pytest.CaptureFixture[str]) -> None:
    far = ("ik", "{x: 2 m, z: 55 cm}", "--any-orientation", "--approximate")
    found = answered(capsys, *far)
    solutions, errors = found["solutions"], found["errors"]
    assert isinstance(solutions, list)
    assert isinstance(errors, list)
    assert found["approximate"] is True
    goal = ", ".join(f"{name}: {value} rad" for name, value in solutions[0].items())
    position = answered(capsys, "fk", f"{{{goal}}}")["position"]
    assert isinstance(position, list)
    assert math.dist(position, (2.0, 0.0, 0.55)) == pytest.approx(errors[0]["away"])
    assert command.main(["arm", *in_order(far)]) == 0
    assert f"approximate, {100 * errors[0]['away']:.1f} cm" in capsys.readouterr().out


def test_a_way_tells_how_much_of_it_there_is(capsys: pytest.CaptureFixture[str]) -> None:
    start = ("--from", "{right_arm_shoulder_lift_joint: -70 deg, right_arm_elbow_flex_joint: 40 deg}")
    whole = answered(capsys, "trace", "{points: [{z: 3 cm}], relative: true, any_orientation: true}", *start)
    assert whole["fraction"] == 1.0
    words = "{points: [{x: 30 cm}], relative: true, any_orientation: true, least: 5 %}"
    part = answered(capsys, "trace", words, *start)["fraction"]
    assert isinstance(part, float)
    assert 0.05 < part < 0.9


def test_a_picture_tells_the_cells_that_the_tip_gets_to(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    out = str(tmp_path / "reach.png")
    words = ("--layer", "z: 60 cm", "--cell", "5 cm", "--samples", "1000", "--out", out)
    found = answered(capsys, "picture", "reach", *words)
    assert (found["samples"], found["seed"], found["of"]) == (1000, 1, 50)
    cells = found["cells"]
    assert isinstance(cells, list)
    assert {cell["cell"][2] for cell in cells} == {12}
    assert (tmp_path / "reach.png").read_bytes().startswith(b"\x89PNG")


@for_all(
    "words, told",
    [
        (["picture", "reach", "--out", "x.png", "--layer", "x: 1 cm, y: 2 cm"], "a layer has one of x, y and z"),
        (["picture", "reach", "--out", "x.png", "--cell", "1 mm"], "a cell is at least 2 mm"),
        (["plan", "wav"], "did you mean 'wave'?"),
        (["plan", "{right_arm_elbow: 1 deg}"], "no joint of this arm"),
        (["plan", "{x: 0.4, z: 0.5}"], "'x' is no joint of this arm"),
        (["plan", "{right_arm_elbow_flex_joint: 1}"], "must be an angle or a length"),
        (["plan", "{right_arm_shoulder_pan_joint: -115 deg, right_arm_shoulder_lift_joint: 69 deg}"], "goal_in_coll"),
        (["ik", "{x: 2 m}"], "goal_out_of_reach: the tip got within"),
        (["ik", REACH, "--frame", "torso"], "there is no link 'torso'"),
        (["ik", REACH, "--prefer", "wav"], "did you mean 'wave'?"),
        (["plan", "{right_arm_elbow_flex_joint: 5 cm}"], "'right_arm_elbow_flex_joint' turns, and this is a length"),
        (["fk", "wave", "--arm", "left_arm"], "there is no arm 'left_arm'"),
        (["plan", "wave", "--keep", "{roll: 10 deg}"], "not_kept: at the goal, the tip's"),
        (["plan", "wave", "--keep", "{z: [1 m]}"], "unknown_goal: a range of 'keep'"),
        (["plan", "wave", "--keep", "{rol: 1 deg}"], "unknown key 'rol'"),
        (["trace", "{points: [{x: 2 m}]}"], "path_incomplete: only"),
        (["trace", "{points: [{x: 2 cm}], frame: torso}"], "unknown_goal: there is no link 'torso'"),
        (["trace", "{points: []}"], "unknown_goal: there are no points"),
        (["trace", "{points: [{x: 2 cm}], speed: 0 m/s}"], "'speed' must be greater than 0 m/s"),
    ],
)
def test_what_cannot_be_says_why(words: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["arm", *in_order(words)]) == 1
    assert told in capsys.readouterr().err


def test_a_mesh_that_cannot_be_read_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("tip.dae").write_text("<COLLADA")
    shape = '<visual><geometry><mesh filename="tip.dae"/></geometry></visual>'
    Path("tip.urdf").write_text(f'<robot name="tip"><link name="rod">{shape}</link></robot>')
    Path("robot.yaml").write_text(
        "rbx: 1\nkind: Robot\nname: reader\nbody: {cover: visual, pieces: {tip: {urdf: tip.urdf, "
        "attach: {to: arm_tip}}}}\n"
        "buses: {servos: {type: dynamixel}}\ninclude: {arm: {part: rbx:parts/servo_arm.yaml, with: {bus: servos}}}\n"
    )
    for words in (["plan", "wave"], ["setup", "--check"]):
        assert command.main(["arm", *words, "robot.yaml"]) == 1
        assert "the mesh 'tip.dae' cannot be read" in capsys.readouterr().err
