"""New missions from templates: each can run as it is, and a refused one leaves nothing behind."""

from __future__ import annotations

import os
from pathlib import Path
from types import MappingProxyType

import pytest

from rbxcompose.base.requests import Refused
from rbxcompose.compiler.compile import look_at_mission
from rbxcompose.tools.mission_editor.editor import MissionEditor
from rbxcompose.tools.mission_editor.new_mission import filled, templates
from tests.conftest import ROOT
from tests.mission_editor.test_editor import FETCH, ROBOT, editor, project
from tests.shipped import compiled

__all__ = ["editor", "project"]

NAMES = [one["name"] for one in templates()]
PATROLLER = ROOT / "robots/patroller/robot.yaml"
PI_ROBOT = ROOT / "robots/pi_robot/robot.yaml"


@pytest.mark.parametrize("template", NAMES)
def test_each_template_is_a_mission_without_findings(template: str) -> None:
    is_arm = template == "pick_and_place"
    file, profiles, name = (PI_ROBOT, ("table",), template) if is_arm else (PATROLLER, (), "patrol")
    robot = compiled(str(file), environment=os.environ, profiles=profiles).robot
    assert robot is not None
    path = robot.manifest.missions[name].path
    text = filled(template, name, robot)
    report, _ = look_at_mission(robot, name, os.environ, MappingProxyType({path: text}))
    assert [str(finding) for finding in report] == []


def test_each_template_says_what_it_does() -> None:
    assert NAMES == ["clean_house", "deliver", "dock_when_low", "patrol", "pick_and_place"]
    assert all(one["about"].endswith(".") for one in templates())


def test_a_new_mission_gets_its_file_and_its_entry(editor: MissionEditor, project: Path) -> None:
    made = editor.answer({"do": "new", "mission": "rounds", "template": "patrol"})
    assert made == {"file": "missions/rounds.yaml"}
    read = editor.answer({"do": "read", "mission": "rounds"})
    assert "in: [dock, table]" in read["text"]
    assert read["findings"] == []
    robot = (project / "robots/fetcher/robot.yaml").read_text(encoding="utf-8")
    assert robot == ROBOT.replace("missions:\n", "missions:\n  rounds: ../../missions/rounds.yaml\n")


def test_a_room_that_cannot_be_reached_is_in_the_log_at_the_end(editor: MissionEditor) -> None:
    editor.answer({"do": "new", "mission": "rounds", "template": "clean_house"})
    text = editor.answer({"do": "read", "mission": "rounds"})["text"].replace("5 min", "0.5 s")
    ran = editor.answer({"do": "try", "mission": "rounds", "text": text})
    assert ran["outcome"] == "success"
    story = [line["text"] for line in ran["story"]]
    assert any("dock is clean" in line for line in story)
    assert any("Not done are table" in line for line in story)


@pytest.mark.parametrize(
    ("name", "template", "why"),
    [
        ("fetch", "patrol", "it is taken"),
        ("No Name", "patrol", r"cannot be the name of a mission: did you mean 'no_name'\?"),
        ("\u732b", "patrol", "a name has lower-case letters, digits and underscores"),
        ("../x", "patrol", "cannot be the name"),
        ("rounds", "../templates/patrol", "there is no template"),
        ("low", "dock_when_low", "this robot cannot do that"),
        ("grab", "pick_and_place", "this robot has no arm that picks"),
    ],
)
def test_a_refused_one_leaves_nothing_behind(
    editor: MissionEditor, project: Path, name: str, template: str, why: str
) -> None:
    with pytest.raises(Refused, match=why):
        editor.answer({"do": "new", "mission": name, "template": template})
    assert [path.name for path in (project / "missions").iterdir()] == ["fetch.yaml"]
    assert (project / "missions/fetch.yaml").read_text(encoding="utf-8") == FETCH
    assert (project / "robots/fetcher/robot.yaml").read_text(encoding="utf-8") == ROBOT


def test_a_mission_that_another_process_has_made_is_known_at_once(editor: MissionEditor, project: Path) -> None:
    other = MissionEditor(editor._compiled, project / "robots/fetcher/robot.yaml")
    other.answer({"do": "read", "mission": "fetch"})
    editor.answer({"do": "new", "mission": "rounds", "template": "patrol"})
    assert other.answer({"do": "read", "mission": "rounds"})["findings"] == []
