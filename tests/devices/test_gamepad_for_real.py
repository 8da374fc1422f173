"""The patrol robot in real processes, driven by a gamepad through its mux; when that is unplugged, the base stands."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rbxcompose.bus.names import data_key
from rbxcompose.commands.guest import Guest
from rbxcompose.commands.lookup import place_of
from rbxcompose.msgs.cdr import decode
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.sdk.ports import Qos
from tests.commands import command
from tests.devices.made_gamepad import LB, STICKS, MadeGamepad
from tests.runtime.real_robot import ROOT, eventually

pytestmark = pytest.mark.timeout(120)
GARDEN = """
rbx: 1
kind: Overlay
name: by_hand
include:
  hand: rbx:parts/gamepad.yaml
diagnostics:
  analyzers:
    hand: {match: [hand_gamepad]}
"""


@contextmanager
def driven(folder: Path) -> Iterator[tuple[MadeGamepad, list[float], dict[str, str]]]:
    """Have it up; what is yielded are the gamepad, the speeds of its odometry [m/s], and the environment."""
    inputs = folder / "input"
    inputs.mkdir()
    pad = MadeGamepad(inputs)
    (folder / "by_hand.yaml").write_text(GARDEN, encoding="utf-8")
    environment = {"XDG_RUNTIME_DIR": str(folder), "PYTHONPATH": str(ROOT), "NO_COLOR": "1", "PATH": "/usr/bin:/bin"}
    words = ["up", "-d", "robots/turtlebot", "--no-mission", "-f", str(folder / "by_hand.yaml")]
    made = [sys.executable, "-m", "tests.devices.made_gamepad", str(inputs), *words]
    done = subprocess.run(made, env=environment, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    speeds: list[float] = []
    try:
        assert done.returncode == 0, done.stdout + done.stderr
        with Guest(place_of(RobotFolder(folder / "rbxcompose" / "turtlebot")), stays=True) as guest:
            key = data_key(guest.domain, "/odom", Odometry.TYPE, Odometry.HASH)
            guest.transport.subscribe(
                key, Qos.STATE, lambda arrival: speeds.append(decode(Odometry, arrival.payload).twist.twist.linear.x)
            )
            yield pad, speeds, environment
    finally:
        command("down", environment=environment, folder=ROOT)


def test_it_drives_by_hand_and_stands_when_the_gamepad_is_unplugged(tmp_path: Path) -> None:
    with driven(tmp_path) as (pad, speeds, environment):
        pad.press(LB)
        pad.move(STICKS[1], -32768)
        eventually(lambda: 0.29 < speeds[-1] <= 0.3 if speeds else False)
        pad.unplug()
        eventually(lambda: speeds[-1] == 0.0)
        shown = command("diag", environment=environment, folder=ROOT).stdout
        assert "waits for a gamepad" in shown
        pad.down.clear()
        pad.plug()
        eventually(lambda: "is ready" in command("diag", environment=environment, folder=ROOT).stdout)
        assert speeds[-1] == 0.0
