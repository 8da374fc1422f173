"""What goes wrong with the folder of a robot, or around it, while real processes run."""

from __future__ import annotations

import shutil
import signal
import subprocess

import pytest

from rbxcompose.base.files import TEMPORARY
from rbxcompose.runtime.folder import STATE, RobotFolder, is_starting
from rbxcompose.runtime.processes import titled
from tests.forked import RBXCOMPOSE, Forked
from tests.runtime.conftest import robot
from tests.runtime.real_robot import PATIENCE, ROOT, Robot, eventually
from tests.soak import rare

__all__ = ["robot"]

CALLERS = 3


def test_of_many_that_start_it_at_once_one_does(robot: Robot) -> None:
    started = [robot.up("-d") for _ in range(CALLERS)]
    ends = [(process.communicate(timeout=PATIENCE)[0], process.returncode) for process in started]
    refused = [output for output, code in ends if code == 1]
    assert sorted(code for _, code in ends) == [0] + [1] * (CALLERS - 1)
    assert all("error[RBX9001]" in output and "is already up" in output for output in refused)
    assert len(robot.processes()) == 5
    assert robot.do("down").returncode == 0


@pytest.mark.parametrize("is_stopped", [False, *rare(True)])
def test_stop_and_down_wait_for_a_robot_whose_up_is_on_its_way(
    robot: Robot, is_stopped: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = [*RBXCOMPOSE, "up", "-d", "robots/turtlebot"]
    pipe = subprocess.PIPE
    up = Forked(words, env=robot.environment, cwd=ROOT, stdout=pipe, stderr=subprocess.STDOUT, text=True)
    monkeypatch.setenv("XDG_RUNTIME_DIR", robot.environment["XDG_RUNTIME_DIR"])
    eventually(is_starting)
    stopped = robot.do("stop", "turtlebot") if is_stopped else None
    done = robot.do("down", "turtlebot")
    assert (done.returncode, done.stdout) == (0, "turtlebot is down\n"), done.stderr
    assert stopped is None or stopped.returncode == 0
    up.communicate(timeout=PATIENCE)
    assert not is_starting()
    assert not RobotFolder.of("turtlebot").is_known


@pytest.mark.parametrize("removed", ["*", *rare("state.json", "control.sock", "lock")])
def test_a_robot_whose_files_were_removed_is_found_and_restores_them(robot: Robot, removed: str) -> None:
    robot.up_detached()
    if removed == "*":
        gone = robot.folder.path.rename(robot.folder.path.parents[1] / "gone")  # at once: the robot writes meanwhile
        shutil.rmtree(gone)
    else:
        (robot.folder.path / removed).unlink()
    eventually(lambda: robot.has_logged("files of the running robot were removed; they are restored"))
    assert len(robot.ps()["components"]) == 2
    assert robot.do("stop").returncode == 0
    again = robot.up("-d")
    assert "is already up" in again.communicate(timeout=PATIENCE)[0]
    assert robot.do("down").returncode == 0
    assert robot.processes() == []


@pytest.mark.parametrize("is_suspended", [True, *rare(False)])
def test_stop_and_down_find_a_robot_at_once_whose_state_was_removed(robot: Robot, is_suspended: bool) -> None:
    robot.up_detached()
    supervisor = next(iter(titled(f"rbxcompose {robot.name}: supervisor")))
    if is_suspended:
        supervisor.send_signal(signal.SIGSTOP)
    (robot.folder.path / STATE).unlink()
    if not is_suspended:
        assert robot.do("stop").returncode == 0
    assert robot.do("down").returncode == 0
    assert robot.processes() == []


def test_a_state_that_cannot_be_written_is_told_and_the_robot_goes_on(robot: Robot) -> None:
    robot.up_detached()
    state = robot.folder.path / STATE
    first = robot.process_of("first")
    state.unlink()
    state.mkdir()  # no file can take the place of a folder
    first.send_signal(signal.SIGKILL)
    eventually(lambda: robot.texts("first").count("started") == 2)
    assert robot.has_logged("the state file cannot be written")
    eventually(lambda: not list(robot.folder.path.glob(f"*{TEMPORARY}")))
    state.rmdir()
    again = next(process for process in titled(f"rbxcompose {robot.name}: robot") if process.is_running)
    again.send_signal(signal.SIGKILL)
    eventually(lambda: robot.texts("first").count("started") == 3)
    assert [component["restarts"] for component in robot.ps()["components"]] == [2, 0]
    assert robot.do("down").returncode == 0
