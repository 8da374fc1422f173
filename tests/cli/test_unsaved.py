"""Texts in place of those of files, and missions that are tried on the simulated robot."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path

import pytest

from rbxcompose.commands import main as command
from tests.patrol_project import MISSION, ROBOT, TEST, changed, write_project


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A project as the current folder."""
    write_project(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def unsaved(project: Path, name: str, right: str, wrong: str) -> tuple[str, str]:
    """Return the option for a file in which a word is another one."""
    (project / "texts.json").write_text(json.dumps(changed(project, name, right, wrong)), encoding="utf-8")
    return "--unsaved", "texts.json"


def test_a_text_counts_in_place_of_that_of_its_file(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    option = unsaved(project, MISSION, "go_to", "goto")
    assert command.main(["check", ROBOT]) == 0
    assert command.main(["check", ROBOT, *option]) == 1
    assert "missions/patrol.yaml:" in capsys.readouterr().out
    option = unsaved(project, ROBOT, "reach: 20 cm", "reach: 30 cm")
    assert command.main(["why", "charger.reach", ROBOT, *option]) == 0
    assert "30 cm" in capsys.readouterr().out
    assert command.main(["plan", ROBOT, *option, "--json"]) == 0
    assert '"reach": 0.3' in capsys.readouterr().out


def test_so_it_does_in_tests_and_systems(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    option = unsaved(project, TEST, "kind: Test", "kind: Tset")
    assert command.main(["check", TEST]) == 0
    assert command.main(["check", TEST, *option]) == 1
    assert command.main(["test", TEST]) == 0
    option = unsaved(project, MISSION, "go_to", "goto")
    assert command.main(["test", TEST, *option]) == 1
    system = "rbx: 1\nkind: System\nname: two\nhosts: {here: {}}\nrobots: {one: {robot: ROBOT, on: here}}\n"
    (project / "two.yaml").write_text(system.replace("ROBOT", ROBOT), encoding="utf-8")
    capsys.readouterr()
    command.main(["check", "two.yaml", *option])
    assert "missions/patrol.yaml:" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("no", "cannot be read"),
        ("[]", "has no texts by paths"),
        ('{"robots/turtlebot/robot.yaml": 3}', "has no texts by paths"),
        ('{"new.yaml": ""}', "'new.yaml' is no file"),
    ],
)
def test_what_are_no_texts_is_wrong_usage(
    text: str, told: str, project: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
    with pytest.raises(SystemExit) as end:
        command.main(["check", ROBOT, "--unsaved", "-"])
    assert end.value.code == 2
    assert told in capsys.readouterr().err


def test_fix_changes_no_file_whose_text_is_another(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["check", ROBOT, "--fix", *unsaved(project, MISSION, "go_to", "goto")]) == 2
    assert "use one of them" in capsys.readouterr().err


def test_a_mission_is_tried(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["mission", "try", "patrol", ROBOT]) == 0
    *_, last = capsys.readouterr().out.splitlines()
    assert last.startswith("success after ")
    option = unsaved(project, MISSION, "default: 2", "default: 1")
    assert command.main(["mission", "try", "patrol", ROBOT, "--json", *option]) == 0
    tried = json.loads(capsys.readouterr().out)
    assert tried["outcome"] == "success"
    assert tried["time"] < 0.7 * float(last.split()[2])


def test_a_mission_that_cannot_run_is_not_tried(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["mission", "try", "patrl", ROBOT]) == 1
    assert "did you mean 'patrol'?" in capsys.readouterr().err
    assert command.main(["mission", "try", "patrol", ROBOT, *unsaved(project, MISSION, "go_to", "goto")]) == 1
    assert "missions/patrol.yaml:" in capsys.readouterr().err
