"""Skills that are topics, as commands have them: listed, mocked, run in virtual time, explored."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from rbxcompose.commands import main as command
from rbxcompose.testing.golden import Golden
from tests.executive.toy_gripper import Gripper

ROBOT = """
rbx: 1
kind: Robot
name: hand
components:
  gripper: {type: toy_gripper}
missions: {pick: pick.yaml}
"""
PICK = """
rbx: 1
kind: Mission
name: pick
do:
  fallback:
    - grip: 0.02
      timeout: 3 s
    - beep: lost
"""
AS_IT_IS = """
rbx: 1
kind: Test
name: picks
robot: robot.yaml
mission: pick
expect:
  outcome: success
  never: [beep]
  steps:
    - grip: 0.02
      ended: success
"""
EMPTY = """
rbx: 1
kind: Test
name: misses
robot: robot.yaml
mission: pick
mocks:
  grip: {takes: 2 s, result: empty}
expect:
  steps:
    - grip: 0.02
      ended: empty
    - beep: lost
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    texts = {"robot": ROBOT, "pick": PICK, "picks": AS_IT_IS, "misses": EMPTY}
    for name, text in texts.items():
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    return tmp_path


def told(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    code = command.main([*words])
    found = capsys.readouterr()
    assert code == 0, found.out + found.err
    return found.out


def test_they_are_listed_with_their_topic_arguments_and_an_example(
    folder: Path, capsys: pytest.CaptureFixture[str], golden: Golden, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert Gripper.type_name == "toy_gripper"
    monkeypatch.setattr("rbxcompose.compiler.model.skills.skill_names", lambda: ["say"])  # other tests have toys
    golden.check("mission_skills.txt", told(capsys, "mission", "skills", str(folder)))
    listed = json.loads(told(capsys, "mission", "skills", str(folder), "--json"))
    assert {item["name"]: item["way"] for item in listed if item["topic"]} == {
        "beep": "topic",
        "grip": "topic",
        "press": "topic",
    }


@pytest.mark.parametrize("name", ["picks", "misses"], ids=["as it is", "mocked"])
def test_a_test_runs_them_as_they_are_or_answers_for_them(
    name: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "passed" in told(capsys, "test", str(folder / f"{name}.yaml"))


def test_what_may_come_of_them_is_explored(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = told(capsys, "mission", "explore", "pick", str(folder))
    assert "can end with failure: grip 0.02 fails, then beep lost fails" in out
    assert "can end with success: grip 0.02 succeeds" in out
