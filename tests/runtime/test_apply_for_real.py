"""The patrol robot in real processes while its files change: `apply`, `up --watch`, and what has failed for good."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.runtime.processes import titled
from tests.commands import command
from tests.conftest import ROOT
from tests.forked import RBXCOMPOSE, Forked, run_command

PATIENCE = 60.0  # [s]
NAME = "turtlebot_that_changes"
TEXT = (ROOT / "robots/turtlebot/robot.yaml").read_text(encoding="utf-8").replace("name: turtlebot", f"name: {NAME}")


class Changing:
    """A robot of its own folder that is up."""

    def __init__(self, folder: Path, runtime: Path) -> None:
        self.folder, self.file = folder, folder / "robots/turtlebot/robot.yaml"
        self.file.parent.mkdir(parents=True)
        (folder / "missions").mkdir()
        (folder / "missions/patrol.yaml").write_bytes((ROOT / "missions/patrol.yaml").read_bytes())
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": str(runtime), "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}
        self.edit()

    def edit(self, *changes: tuple[str, str]) -> None:
        """Write the robot's file as an editor does, with other words."""
        text = TEXT
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        new_file = self.file.with_suffix(".new")
        new_file.write_text(text, encoding="utf-8")
        os.replace(new_file, self.file)

    def plain(self, *words: str) -> subprocess.CompletedProcess[str]:
        return command(*words, environment=self.environment, folder=self.folder)

    def up(self) -> None:
        run_command(("up", "-d", "robots/turtlebot"), self.environment, PATIENCE, self.folder).check_returncode()

    def do(self, *words: str, code: int = 0) -> str:
        done = self.plain(*words)
        assert done.returncode == code, done.stdout + done.stderr
        return done.stdout + done.stderr

    def ps(self) -> dict[str, dict[str, Any]]:
        return {component["name"]: component for component in json.loads(self.do("ps", "--json"))["components"]}

    def why_not(self) -> str:
        """Return why the robot cannot take what its file says just now."""
        return str(json.loads(self.plain("apply", "robots/turtlebot", "--dry-run", "--json").stdout)["why_not"])

    def eventually(self, holds: Callable[[], bool]) -> None:
        deadline = time.monotonic() + PATIENCE
        while not holds():
            assert time.monotonic() < deadline, self.do("logs")
            time.sleep(0.05)


@pytest.fixture
def robot(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Changing]:
    made = Changing(tmp_path, tmp_path_factory.mktemp("runtime"))
    yield made
    made.plain("down", NAME)
    assert [process for process in titled(f"rbxcompose {NAME}: ") if process.is_running] == []


LAMP = ("  charger:\n", "  lamp:\n    type: transforms\n    process: lights\n  charger:\n")
LINK = '<link name="base_footprint"/>'
AT_REST = ("start: patrol\n", "")
BODY = ("  urdf: rbx:robots/turtlebot/turtlebot.urdf\n", "  urdf: large.urdf\n")


def test_only_what_has_changed_restarts(robot: Changing) -> None:
    robot.edit(AT_REST)
    robot.up()
    before = robot.ps()
    robot.edit(AT_REST, ("default: 0.3 m/s", "default: 0.4 m/s"), ("priority: 100", "priority: 90"), LAMP)
    assert "  added         lamp" in robot.do("apply", "robots/turtlebot", "--dry-run")
    assert "give --yes" in robot.do("apply", "robots/turtlebot", code=2)
    assert robot.ps() == before
    shown = robot.do("apply", "robots/turtlebot", "--yes")
    assert "speed: 0.3 m/s -> 0.4 m/s at robots/turtlebot/robot.yaml:40:12" in shown
    after = robot.ps()
    assert {name: entry["pid"] for name, entry in after.items() if name in before} == {
        name: entry["pid"] for name, entry in before.items()
    }
    assert (after["lamp"]["state"], after["lamp"]["process"]) == ("active", "lights")
    assert "0.4" in robot.do("param", "get", "go_to", "speed")
    assert robot.do("apply", "robots/turtlebot").startswith(f"{NAME}: 10 kept\n")  # so nothing is asked
    robot.edit(AT_REST)
    robot.do("apply", "robots/turtlebot", "--yes")
    assert robot.ps().keys() == before.keys()
    assert "lamp added" in robot.do("apply", NAME, "--undo", "--yes")
    assert "no such change" in robot.do("apply", NAME, "--undo", "7", "--yes", code=1)
    assert robot.ps().keys() == after.keys()
    robot.do("apply", NAME, "--undo", "--yes")
    assert robot.ps().keys() == before.keys()
    assert len([process for process in titled(f"rbxcompose {NAME}: ") if process.is_running]) == 6


@pytest.mark.soak  # shorter changes reach it above
def test_what_is_longer_than_a_socket_holds_reaches_a_process_that_runs(robot: Changing) -> None:
    urdf = robot.file.parent / "large.urdf"
    urdf.write_text(f"<robot>{LINK}{'<!---->' * 75_000}</robot>", encoding="utf-8")
    robot.edit(AT_REST, BODY)
    robot.up()
    urdf.write_text(f"<robot>{LINK}{'<thing/>' * 60_000}</robot>", encoding="utf-8")
    shown = robot.do("apply", "robots/turtlebot", "--yes")
    assert "urdf: 525,044 characters, " in shown
    assert shown.endswith(f"{NAME} is changed: robot_description transforms restarted\n")
    assert robot.ps()["robot_description"]["state"] == "active"


def test_mistakes_simulated_truth_and_what_is_unsafe_change_nothing(robot: Changing) -> None:
    robot.up()
    before = robot.ps()
    robot.edit(("reach: 20 cm", "raech: 20 cm"))
    assert "RBX1001" in robot.do("apply", "robots/turtlebot", "--yes", code=1)
    robot.edit(("type: diff_drive_sim\n", "type: diff_drive_sim\n    process: robot\n"))
    assert "it needs 'down' and 'up'" in robot.do("apply", "robots/turtlebot", "--yes", code=1)
    robot.edit(("priority: 100", "priority: 90"))
    robot.eventually(lambda: "go_to corner_1" in robot.do("logs"))
    refused = robot.do("apply", "robots/turtlebot", "--yes", code=1)
    assert "error[RBX9004]" in refused
    assert "'cmd_vel' is on the path of its commands: 'rbxcompose stop' first" in refused
    assert robot.ps() == before
    robot.do("stop")
    robot.eventually(lambda: robot.why_not() == "")
    assert "is changed: cmd_vel restarted" in robot.do("apply", "robots/turtlebot", "--yes")
    robot.do("release")
    robot.do("mission", "resume")
    robot.edit(("priority: 100", "priority: 80"))
    robot.eventually(lambda: "'base' moves" in robot.why_not())  # through the new mux


def test_who_needs_what_has_failed_for_good_is_blocked_until_the_next_apply(robot: Changing) -> None:
    robot.edit(AT_REST, ("    type: go_to\n", "    type: go_to\n    process: legs\n    restart: never\n"))
    robot.up()
    os.kill(robot.ps()["go_to"]["pid"], signal.SIGKILL)
    robot.eventually(lambda: robot.ps()["mission"]["state"] == "blocked")
    shown = robot.ps()
    assert (shown["go_to"]["state"], shown["mission"]["waits_for"]) == ("failed", "go_to")
    assert "mission waits for go_to, which failed" in robot.do("ps")
    robot.eventually(lambda: "all motion is held" in robot.do("logs"))
    robot.do("apply", "robots/turtlebot", "--yes")
    after = robot.ps()
    assert {entry["state"] for entry in after.values()} == {"active"}
    [supervisor] = titled(f"rbxcompose {NAME}: supervisor")
    supervisor.send_signal(signal.SIGSTOP)
    robot.eventually(lambda: supervisor.is_stopped)
    assert robot.ps() == after  # from the state file, which is as new as the last change


def test_up_watch_takes_what_the_files_say(robot: Changing) -> None:
    words = [*RBXCOMPOSE, "up", "--watch", "robots/turtlebot"]
    with Forked(
        words, env=robot.environment, cwd=robot.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        assert process.stdout is not None
        lines: list[str] = []

        def read_until(text: str) -> None:
            for line in process.stdout or ():
                lines.append(line)
                if text in line:
                    return
            raise AssertionError("".join(lines))

        read_until("is up")
        robot.edit(("reach: 20 cm", "reach: 25 cm"))
        read_until("the robot is changed: charger restarted")
        robot.edit(("reach: 20 cm", "raech: 25 cm"))
        read_until("the robot stays as it is")
        robot.edit(("reach: 20 cm", "reach: 25 cm"), ("priority: 100", "priority: 90"))
        read_until("waits: ")
        robot.do("mission", "pause")
        read_until("the robot is changed: cmd_vel restarted")
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert sum("waits: " in line for line in lines) == 1
