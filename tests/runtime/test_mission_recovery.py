"""A patrol in real processes: its process is killed, and it goes on where it was; breakpoints outlast that, too."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.runtime.log import NAME
from rbxcompose.runtime.processes import titled
from tests.cli.live_robot import Robot
from tests.runtime.real_robot import eventually, read_log

ROBOT = """
rbx: 1
kind: Robot
name: goes_on
about: Drives to and fro.
places:
  dock: {x: 0.0 m, y: 0.0 m, heading: 0 deg}
  corner: {x: 0.6 m, y: 0.0 m, heading: 0 deg}
components:
  base: {type: diff_drive_sim, max_speed: 0.5 m/s, max_turn_rate: 90 deg/s, command_timeout: 0.5 s}
  go_to: {type: go_to, speed: 0.3 m/s}
missions:
  patrol: {file: patrol.yaml, after_crash: continue}
start: patrol
"""
PATROL = """
rbx: 1
kind: Mission
name: patrol
about: Drives to and fro.
data:
  legs: 0
do:
  repeat: forever
  do:
    - {name: first_leg, go_to: corner}
    - set: {legs: $legs + 1}
    - wait: 4 s
    - {name: second_leg, go_to: dock}
    - set: {legs: $legs + 1}
"""


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Robot]:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    tmp_path.chmod(0o700)
    (tmp_path / "patrol.yaml").write_text(PATROL.lstrip(), encoding="utf-8")
    made = Robot(tmp_path, ROBOT.strip())
    yield made
    made.do("down")


def log(robot: Robot) -> list[str]:
    folder = RobotFolder(Path(robot.environment["XDG_RUNTIME_DIR"]) / "rbxcompose/goes_on")
    return [record.text for record in read_log(folder.path / NAME)]


def test_a_killed_mission_goes_on_at_its_leaf_and_stops_at_its_breakpoint(robot: Robot) -> None:
    done = robot.do("up", "-d", str(robot.file))
    assert done.returncode == 0, done.stderr
    eventually(lambda: any("first_leg: success" in line for line in log(robot)))
    assert robot.do("mission", "break", "second_leg").returncode == 0
    eventually(
        lambda: (Path(robot.environment["XDG_STATE_HOME"]) / "rbxcompose/snapshots/goes_on/patrol.json").exists()
    )
    eventually(lambda: any("stopped at" in line for line in log(robot)))
    robot.do("mission", "resume")
    eventually(lambda: any("second_leg: Go to dock" in line and "stopped" not in line for line in log(robot)))
    eventually(lambda: '"legs": 1.0' in snapshot(robot) and '"is_paused": false' in snapshot(robot))
    next(iter(titled("rbxcompose goes_on: mission"))).send_signal(signal.SIGKILL)
    eventually(lambda: any("restored from its snapshot" in line for line in log(robot)))
    eventually(lambda: sum("second_leg: success" in line for line in log(robot)) == 1)
    assert sum("first_leg: success" in line for line in log(robot)) == 1
    breakpoints = json.loads(robot.do("mission", "break", "--json").stdout)
    assert [entry["where"] for entry in breakpoints] == ["second_leg"]


def snapshot(robot: Robot) -> str:
    return (Path(robot.environment["XDG_STATE_HOME"]) / "rbxcompose/snapshots/goes_on/patrol.json").read_text()
