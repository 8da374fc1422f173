"""`arm bench`: figures of a robot's own arm, and of problems in files."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from rbxcompose.commands import main as command
from tests.conftest import ROOT

BENCH = ["arm", "bench", str(ROOT / "robots/pi_robot"), "--arm", "right_arm", "--count", "1"]
SCENE = """
world:
  collision_objects:
    - id: post
      primitives: [{type: box, dimensions: [0.1, 0.1, 0.4]}]
      primitive_poses: [{position: [3, 0, 0.2], orientation: [0, 0, 0, 1]}]
"""


def written(folder: Path, names: list[str]) -> None:
    (folder / "post").mkdir()
    (folder / "post/scene0001.yaml").write_text(SCENE, encoding="utf-8")
    goal = [{"joint_name": name, "position": 0.1} for name in names]
    state = {"joint_state": {"name": names, "position": [0.0] * len(names)}}
    request = {"start_state": state, "goal_constraints": [{"joint_constraints": goal}]}
    (folder / "post/request0001.yaml").write_text(json.dumps(request), encoding="utf-8")


@pytest.mark.timeout(120)
def test_it_measures_kinematics_motions_and_problems(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["arm", "ls", BENCH[2], "--json"]) == 0
    listed = {entry["name"]: entry["joints"] for entry in json.loads(capsys.readouterr().out)}
    written(tmp_path, listed["right_arm"])
    assert command.main([*BENCH, "--problems", str(tmp_path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["compiled"] is True
    assert found["calls"].keys() == {"forward kinematics", "Jacobian"}
    assert {name: (entry["count"], entry["colliding"]) for name, entry in found["tries"].items()} == {
        "inverse kinematics": (1, 0),
        "random motions": (1, 0),
        "post": (1, 0),
    }


@pytest.mark.timeout(120)
def test_folders_without_problems_and_problems_of_other_arms_are_wrong_usage(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command.main([*BENCH, "--problems", str(tmp_path)]) == 2
    assert "there are no scenes with requests" in capsys.readouterr().err
    written(tmp_path, ["panda_joint1"])
    assert command.main([*BENCH, "--problems", str(tmp_path)]) == 2
    assert "start post/0001 does not say where 'right_arm" in capsys.readouterr().err
