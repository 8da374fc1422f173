"""Missions that are watched from another process, and begun again after theirs was killed."""

from __future__ import annotations

import json
import os
import shutil
import signal
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.commands.guest import Guest
from rbxcompose.commands.lookup import BusPlace
from rbxcompose.tools.top import MissionsSeen
from tests.forked import run_command

ROOT = Path(__file__).parents[2]
PATIENCE = 20.0  # [s]
MANIFEST = """
rbx: 1
kind: Robot
name: watched
bus: {port: 7970}
components: {battery: {type: battery_sim, runtime: 1 h}}
missions: {count: count.yaml}
"""
MISSION = """
rbx: 1
kind: Mission
name: count
data:
  round: 0
do:
  repeat: forever
  do:
    - set:
        round: $round + 1
    - wait: 0.2 s
"""


class Robot:
    """A robot with a mission that counts, in real processes."""

    def __init__(self, base: Path) -> None:
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": str(base), "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}
        self.file = base / "robot.yaml"
        self.file.write_text(MANIFEST, encoding="utf-8")
        (base / "count.yaml").write_text(MISSION, encoding="utf-8")

    def do(self, *words: str) -> str:
        done = run_command(words, self.environment, PATIENCE)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout


@pytest.fixture
def robot() -> Iterator[Robot]:
    base = Path(tempfile.mkdtemp(prefix="rbx"))
    made = Robot(base)
    made.do("up", "-d", str(made.file))
    yield made
    made.do("down")
    shutil.rmtree(base)


class Watching:
    """A visitor on the robot's bus, which came in the middle."""

    def __init__(self, guest: Guest) -> None:
        self._guest = guest
        self.missions = MissionsSeen(guest, "watched")

    @property
    def round(self) -> int:
        return int(self._seen.get("data", {}).get("round", 0))

    @property
    def state(self) -> str:
        return str(self._seen.get("state", ""))

    @property
    def _seen(self) -> Mapping[str, Any]:
        return self.missions.by_name.get("count", {})

    def until(self, holds: Callable[[], bool]) -> None:
        deadline = time.monotonic() + PATIENCE
        while not self._guest.run(holds, 1.0):
            self.missions.look()  # the mission's process may not have been there yet
            assert time.monotonic() < deadline, "it never came true"


def test_a_viewer_follows_a_mission_also_over_the_death_of_its_process(robot: Robot) -> None:
    robot.do("mission", "run", "count")
    found = json.loads(robot.do("ps", "--json"))
    with Guest(BusPlace(found["router"]["endpoint"])) as guest:
        watching = Watching(guest)
        watching.until(lambda: watching.round >= 2)
        before = watching.round
        watching.until(lambda: watching.round >= before + 3)
        assert watching.missions.is_complete
        (tree,) = json.loads(robot.do("top", "--json"))["missions"]
        assert (tree["mission"], tree["state"], tree["running"][0]) == ("count", "running", "▶ repeat")
        assert "▶ 1 Repeat for ever:" in robot.do("mission", "show", "count")
        guest.run(lambda: False, 0.0)
        counted = watching.round
        os.kill(
            next(component["pid"] for component in found["components"] if component["name"] == "mission"),
            signal.SIGKILL,
        )
        watching.until(lambda: 0 < watching.round < counted)  # it was begun by a person, and starts again
        before = watching.round
        watching.until(lambda: watching.round >= before + 2)
        robot.do("mission", "pause")
        watching.until(lambda: watching.state == "paused")
