"""`mission explore` with inputs that the robot leaves open."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.commands import main as command

ROBOT = """
rbx: 1
kind: Robot
name: one
include: {base: "rbx:parts/base.yaml", nav: "rbx:parts/navigation.yaml"}
places: {dock: {x: 0 m, y: 0 m}, far: {x: 2 m, y: 0 m}}
missions: {go: go.yaml}
"""
GO = """
rbx: 1
kind: Mission
name: go
inputs: {where: {type: place}}
do: {go_to: $where}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "robot.yaml").write_text(ROBOT.lstrip(), encoding="utf-8")
    (tmp_path / "go.yaml").write_text(GO.lstrip(), encoding="utf-8")
    return tmp_path


def test_an_input_is_given_by_set(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["mission", "explore", "go", str(folder), "--set", "where=far"]) == 0
    assert "can end with failure: go_to far fails" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ([], "the input 'where' of the mission 'go' needs a value\n  = help: give inputs by '--set NAME=VALUE'"),
        (["--set", "where=fr"], "there is no place 'fr'\n  = help: did you mean 'far'?"),
        (["--set", "were=far"], "the mission 'go' has no input 'were'\n  ::: "),
    ],
    ids=["missing", "misspelt", "unknown"],
)
def test_what_is_wrong_with_inputs_is_told(
    words: list[str], told: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command.main(["mission", "explore", "go", str(folder), *words]) == 1
    assert told in capsys.readouterr().err


def test_a_setting_without_a_value_is_wrong_usage(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["mission", "explore", "go", str(folder), "--set", "where"]) == 2
    assert "'where' is not NAME=VALUE" in capsys.readouterr().err
