"""A robot whose folder cannot be used is not started; what cannot be written into it later is reported."""

from __future__ import annotations

import os
import resource
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rbxcompose.commands.main import main
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.runtime.folder import RobotFolder, RunOptions
from rbxcompose.runtime.log import start_new, write_problem
from rbxcompose.runtime.supervision import launch
from rbxcompose.runtime.supervision.launch import Begun, LaunchReport, RunEnded, Up
from rbxcompose.tools.run_view import run_plan
from tests.runtime.real_robot import ROOT, TOY


def test_a_robot_without_a_place_for_its_state_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(tmp_path / "file"), "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}
    words = [*TOY, "--name", f"homeless_{os.getpid()}"]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=15.0, cwd=ROOT)
    assert (done.returncode, "RBX9006" in done.stderr, "Not a directory" in done.stderr) == (1, True, True), done


LOST = "the log of 'full' cannot be written: File too large\n"
ROBOT = "rbx: 1\nkind: Robot\nname: full\ncomponents: {battery: {type: battery_sim, runtime: 1 min}}\n"


@contextmanager
def no_room() -> Iterator[None]:
    """Let no file of this process grow, as on a full disk."""
    previous = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, previous[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, previous)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RobotFolder:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    (made := RobotFolder.of("full")).make()
    return made


def test_logs_says_that_the_log_cannot_be_written(folder: RobotFolder, capsys: pytest.CaptureFixture[str]) -> None:
    start_new(folder.path).close()
    with no_room():
        assert main(["logs", "--robot", "full"]) == 0
    assert tuple(capsys.readouterr()) == ("", LOST)
    assert main(["logs", "--robot", "full"]) == 0
    assert tuple(capsys.readouterr()) == ("", "")
    assert write_problem(folder.path / "gone") == "No such file or directory"
    assert sorted(path.name for path in folder.path.iterdir()) == ["bus", "log.jsonl"]


class FakeSupervisor:
    """Reports a whole run."""

    def __init__(self) -> None:
        self.reports: list[LaunchReport] = [Begun(), Up(1, 1, 0.1), RunEnded(0, "the time is up", 1.0)]

    def wait_for_report(self, seconds: float | None) -> LaunchReport:
        """Return the next report."""
        return self.reports.pop(0)

    def wait(self) -> int:
        """Return the exit code."""
        return 0


def test_up_says_that_the_log_cannot_be_written_and_goes_on(
    folder: RobotFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "robot.yaml").write_text(ROBOT, encoding="utf-8")
    plan = compile_robot(str(tmp_path / "robot.yaml"), environment={}).plan
    assert plan is not None
    monkeypatch.setattr(launch, "start_supervisor", lambda *_: FakeSupervisor())
    with no_room():
        assert run_plan(plan, RunOptions()) == 0
    out, error = capsys.readouterr()
    assert ("full is down: the time is up" in out, error) == (True, LOST)
