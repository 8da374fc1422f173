"""Findings as one types: in the context of the robots that a file belongs to."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pygls.workspace import PositionCodec

from rbxcompose.base.findings import Span
from rbxcompose.tools.lsp.convert import Converter
from rbxcompose.tools.lsp.project import Project
from rbxcompose.tools.lsp.rename import actions, change_of
from tests.conftest import ROOT

OVERLAY = "rbx: 1\nkind: Overlay\nname: slow\ncomponents:\n  base:\n    max_speed: 0.1 m/s\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("robots/turtlebot", "robots/rooms", "robots/twins", "missions", "parts"):
        shutil.copytree(ROOT / name, tmp_path / name)
    return tmp_path


def codes(project: Project, path: Path, text: str | None) -> dict[str, list[str]]:
    """Change a text and return the codes of all files that have findings."""
    found = project.change(path, text)
    return {file.name: [finding.code for finding in findings] for file, findings in found.items() if findings}


def test_a_robot_is_compiled_with_the_text_of_the_editor_until_that_is_closed(folder: Path) -> None:
    project, path = Project({}), folder / "robots/turtlebot/robot.yaml"
    text = path.read_text(encoding="utf-8")
    assert codes(project, path, text) == {}
    assert codes(project, path, text.replace("dock: dock", "dock: dok")) == {"robot.yaml": ["RBX1004"]}
    assert codes(project, path, None) == {}


def test_a_mistake_in_one_file_is_told_in_the_other_and_taken_back(folder: Path) -> None:
    project = Project({})
    robot, mission = folder / "robots/turtlebot/robot.yaml", folder / "missions/patrol.yaml"
    text = robot.read_text(encoding="utf-8")
    assert codes(project, robot, text) == {}
    assert "patrol.yaml" in codes(project, robot, text.replace("  corner_2: {", "  corner_9: {"))
    assert project.findings(mission)
    assert mission in project.change(robot, text)
    assert project.findings(mission) == []


def test_a_mission_is_checked_with_the_robots_of_the_project_that_have_it(folder: Path) -> None:
    project, path = Project({}), folder / "missions/patrol.yaml"
    text = path.read_text(encoding="utf-8")
    assert codes(project, path, text.replace("go_to: dock", "go_to: dok")) == {"patrol.yaml": ["RBX4103"]}
    robot = project.robot_of(path)
    assert robot is not None
    assert "patrol" in robot.missions


def test_a_mission_that_no_robot_has_is_still_read(folder: Path) -> None:
    project, path = Project({}), folder / "missions/new.yaml"
    text = "rbx: 1\nkind: Mission\nname: new\ndo:\n  wait: $somewhere\n  timeut: 3 s\n"
    path.write_text(text, encoding="utf-8")
    assert codes(project, path, text) == {"new.yaml": ["RBX4101"]}


def test_a_part_is_checked_with_the_robots_that_include_it(folder: Path) -> None:
    robot = folder / "robots/twins/robot.yaml"
    local = robot.read_text(encoding="utf-8").replace("rbx:parts/", "../../parts/")
    robot.write_text(local, encoding="utf-8")
    project, path = Project({}), folder / "parts/battery.yaml"
    text = path.read_text(encoding="utf-8")
    assert "battery.yaml" in codes(project, path, text.replace("    runtime: $", "    runtme: $"))
    assert codes(project, path, text) == {}


def test_an_overlay_is_checked_with_the_robot_beside_it(folder: Path) -> None:
    project, path = Project({}), folder / "robots/turtlebot/slow.yaml"
    path.write_text(OVERLAY, encoding="utf-8")
    assert codes(project, path, OVERLAY.replace("  base:", "  bas:")) == {"slow.yaml": ["RBX1302"]}
    assert project.robot_of(path) is not None


@pytest.mark.parametrize(
    ("written", "wrong", "code"),
    [
        ("mission: patrol", "mission: patrl", "RBX4201"),
        ("outcome: success", "outcome: sucess", "RBX4201"),
        ("takes: 3 s", "takes: 3 sec", "RBX1003"),
        ("go_to: corner_4", "go_to: corner_5", "RBX4201"),
        ("expect:", "expct:", "RBX1001"),
        ("kind: Test", "kind: Tst", "RBX1304"),
    ],
)
def test_a_test_is_checked_with_its_robot(folder: Path, written: str, wrong: str, code: str) -> None:
    project, path = Project({}), folder / "missions/tests/patrol.test.yaml"
    text = path.read_text(encoding="utf-8")
    assert codes(project, path, text) == {}
    assert code in codes(project, path, text.replace(written, wrong))[path.name]
    assert codes(project, path, text) == {}


def test_an_open_test_is_checked_again_when_its_robot_changes_until_it_is_closed(folder: Path) -> None:
    project, path = Project({}), folder / "missions/tests/patrol.test.yaml"
    robot = folder / "robots/turtlebot/robot.yaml"
    project.change(path, path.read_text(encoding="utf-8"))
    broken = robot.read_text(encoding="utf-8").replace("patrol.yaml", "patrl.yaml")
    assert codes(project, robot, broken)[path.name] == ["RBX4203"]
    assert project.change(path, None)[path] == []
    assert path.name not in codes(project, robot, broken)
    assert codes(project, robot, None) == {}


def test_a_system_is_checked_with_its_robots_in_each_profile(folder: Path) -> None:
    shutil.copytree(ROOT / "systems", folder / "systems")
    project, path = Project({}), folder / "systems/patrol_two_hosts.yaml"
    text = path.read_text(encoding="utf-8")
    assert codes(project, path, text) == {}
    assert codes(project, path, text.replace("hosts:", "hosst:"))[path.name] == ["RBX1001"]
    assert codes(project, path, text.replace("turtlebot/robot", "turtlbot/robot")) == {path.name: ["RBX1301"]}
    profile = "profiles:\n  near:\n    robots:\n      turtlebot:\n        on: dsk\n"
    assert codes(project, path, text + profile) == {path.name: ["RBX6100"]}
    robot = folder / "robots/turtlebot/robot.yaml"
    project.change(path, text)
    broken = robot.read_text(encoding="utf-8").replace("linked:", "lonked:")
    assert path.name in codes(project, robot, broken)


def test_a_file_that_no_robot_uses_is_marked_while_it_is_open(folder: Path) -> None:
    shutil.copytree(ROOT / "worlds", folder / "worlds")
    project, part, world = Project({}), folder / "parts/lift.yaml", folder / "worlds/blank.yaml"
    for path in (part, world):
        assert codes(project, path, path.read_text(encoding="utf-8")) == {path.name: ["RBX9007"]}
        assert codes(project, path, None) == {}


def test_an_open_mission_is_marked_while_no_robot_has_it(folder: Path) -> None:
    project, path = Project({}), folder / "missions/patrol.yaml"
    robot = folder / "robots/turtlebot/robot.yaml"
    text = robot.read_text(encoding="utf-8")
    without = "\n".join(line for line in text.split("\n") if "missions/patrol.yaml" not in line)
    assert codes(project, path, path.read_text(encoding="utf-8")) == {}
    assert codes(project, robot, without)[path.name] == ["RBX9007"]
    assert codes(project, robot, text) == {}


def test_a_text_is_checked_also_if_its_file_is_not_there(folder: Path) -> None:
    project, path = Project({}), folder / "missions/patrol.yaml"
    text = path.read_text(encoding="utf-8")
    assert codes(project, path, text) == {}
    path.unlink()
    assert codes(project, path, text.replace("go_to: dock", "go_to: dok")) == {"patrol.yaml": ["RBX4103"]}
    robot = folder / "robots/turtlebot/robot.yaml"
    text = robot.read_text(encoding="utf-8").replace("max_speed", "max_sped")
    assert "RBX1001" in codes(project, folder / "robots/new/robot.yaml", text)["robot.yaml"]


def test_while_a_robot_cannot_be_read_its_names_are_still_known(folder: Path) -> None:
    project, path = Project({}), folder / "robots/turtlebot/robot.yaml"
    project.change(path, path.read_text(encoding="utf-8"))
    assert codes(project, path, "components: [")
    robot = project.robot_of(path)
    assert robot is not None
    assert "corner_1" in robot.manifest.places


def test_the_fix_of_a_finding_is_the_smallest_change(folder: Path) -> None:
    project, path = Project({}), folder / "robots/turtlebot/robot.yaml"
    text = path.read_text(encoding="utf-8").replace("max_speed", "max_sped")
    project.change(path, text)
    finding = next(candidate for candidate in project.findings(path) if candidate.fix is not None)
    assert finding.span is not None
    (action,) = actions(project, [finding], finding.span.line - 1, finding.span.line - 1)
    change = action.changes[path]
    assert change.text == "e"
    assert list(actions(project, [finding], 0, 1)) == []  # another line


def test_files_are_named_as_the_editor_sees_them_if_it_opened_a_link(folder: Path) -> None:
    (opened := folder.with_name(f"{folder.name}_opened")).symlink_to(folder)
    convert = Converter(lambda path: "", PositionCodec())
    mission = convert.path((opened / "missions/patrol.yaml").as_uri())
    assert mission == folder / "missions/patrol.yaml"
    assert convert.uri(mission) == (opened / "missions/patrol.yaml").as_uri()
    span = Span(str(folder / "robots/turtlebot/robot.yaml"), 1, 1, 1, 2)
    assert convert.location(span).uri == (opened / "robots/turtlebot/robot.yaml").as_uri()
    assert convert.uri(folder.parent / "other.yaml") == (folder.parent / "other.yaml").as_uri()


@given(st.text("ab\n", max_size=8), st.text("ab\n", max_size=8))
def test_a_change_makes_the_one_text_of_the_other(before: str, after: str) -> None:
    change = change_of(before, after)
    lines = before.split("\n")

    def offset(place: tuple[int, int]) -> int:
        return sum(len(line) + 1 for line in lines[: place[0]]) + place[1]

    assert before[: offset(change.start)] + change.text + before[offset(change.end) :] == after
