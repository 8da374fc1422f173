"""Which robot a verb means that is not told: the only one of the folder, else the only one that is up."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from rbxcompose.commands import main as command
from rbxcompose.commands.console import NotDoneError
from rbxcompose.commands.targets import robot_path
from rbxcompose.runtime.folder import RobotFolder, RobotState
from rbxcompose.runtime.processes import Process, boot_id
from tests.forked import run_command
from tests.loops import for_all

ROBOT = "rbx: 1\nkind: Robot\nname: one\ncomponents:\n  base: {type: diff_drive_sim}\n"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "run"))
    (tmp_path / "run").mkdir(mode=0o700)
    project = tmp_path / "project"
    project.mkdir()
    monkeypatch.chdir(project)
    return project


def add_robot(path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(ROBOT, encoding="utf-8")


def start(name: str, file: Path) -> None:
    """Write down a robot that is up."""
    robot = RobotFolder.of(name)
    robot.make()
    gone = Process(os.getpid(), 1)
    robot.write_state(RobotState(name, str(file), gone, {}, (), boot=boot_id()))


@pytest.mark.parametrize("file", ["robot.yaml", "robots/one/robot.yaml", "one/robot.yaml", "one.yaml"])
def test_the_only_robot_of_the_folder_is_meant(file: str, folder: Path) -> None:
    add_robot(folder / file)
    start("other", folder / "elsewhere.yaml")
    assert robot_path(None, may_run=True) == file


def test_the_robot_of_the_folder_itself_comes_before_those_below_it(folder: Path) -> None:
    add_robot(folder / "robot.yaml")
    add_robot(folder / "old/robot.yaml")
    assert robot_path(None, may_run=False) == "robot.yaml"


def test_of_a_folder_without_robots_the_only_one_that_is_up_is_meant_but_not_to_start_it(folder: Path) -> None:
    start("one", folder / "far/robot.yaml")
    assert robot_path(None, may_run=True) == str(folder / "far/robot.yaml")
    with pytest.raises(NotDoneError, match="no robot is named, and this folder has no robot"):
        robot_path(None, may_run=False)
    start("two", folder / "two/robot.yaml")
    with pytest.raises(NotDoneError):
        robot_path(None, may_run=True)


def test_several_robots_are_named(folder: Path) -> None:
    for name in ("a", "b"):
        add_robot(folder / f"robots/{name}/robot.yaml")
    with pytest.raises(NotDoneError, match=r"several robots: robots/a/robot\.yaml, robots/b/robot\.yaml"):
        robot_path(None, may_run=False)


@for_all("words", ["up", "plan", "expand", "graph", "apply", "why base.max_speed", "mission skills", "body show"])
def test_a_verb_without_a_robot_is_refused_with_what_it_needs(words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(words.split()) == 1
    assert "error[RBX9031]: no robot is named" in capsys.readouterr().err


@pytest.mark.parametrize("words", ["plan --json", "expand --json", "why base.max_speed --json", "mission skills"])
def test_verbs_take_the_only_robot(words: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    add_robot(folder / "robot.yaml")
    assert command.main(words.split()) == 0
    assert "--json" not in words or json.loads(capsys.readouterr().out)


@pytest.mark.soak  # as other verbs do
def test_up_takes_the_only_robot_of_the_folder(folder: Path) -> None:
    add_robot(folder / "robot.yaml")
    done = run_command(("up", "--rate", "max", "--for", "1s"), os.environ, 30.0, folder)
    assert (done.returncode, "one is up" in done.stdout) == (0, True), done.stderr


@pytest.mark.parametrize("verb", ["record --for 1s", "console"])
def test_verbs_for_one_robot_take_one_of_a_system_and_say_so(
    verb: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "s.yaml").write_text("rbx: 1\nkind: System\n", encoding="utf-8")
    start("one", folder / "robot.yaml")
    words = verb.split()
    for robot, message in (
        ("s.yaml", "error[RBX9003]: 's.yaml' is a system, and this command is for one robot"),
        ("s.yaml:two", "error[RBX9002]: no robot 'two' is up on this machine"),
        ("s.yaml:one", "'one' does not answer"),
        ("nope.yaml", "error[RBX9002]: no robot 'nope.yaml' is up, and there is no such file"),
    ):
        assert command.main([*words, "--robot", robot]) == 1
        assert message in capsys.readouterr().err
