"""A gamepad: from the bytes of its event to the velocity at the base, and from its unplugging to the stop there."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.measuring import COMMAND, Row, Samples, program
from rbxcompose.bus.names import data_key
from rbxcompose.commands.guest import Guest
from rbxcompose.commands.lookup import place_of
from rbxcompose.msgs.cdr import decode
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.sdk.ports import Qos
from tests.devices.made_gamepad import LB, STICKS, MadeGamepad

MEASURES = ("rbxcompose/bus", "rbxcompose/domains/devices", "rbxcompose/domains/muxes", "rbxcompose/runtime")
NAME = "driven_by_hand"
MANY, PULLED = 200, 5
PAUSE = 0.0513  # [s] between two motions, so that they come at any moment of a cycle
PATIENCE = 5.0  # [s]
ROBOT = f"""
rbx: 1
kind: Robot
name: {NAME}
components:
  gamepad: {{type: gamepad}}
  base: {{type: diff_drive_sim}}
muxes:
  cmd_vel:
    inputs:
      gamepad: {{from: gamepad, priority: 100, timeout: 0.3 s}}
"""


@contextmanager
def _driven(folder: Path) -> Iterator[tuple[MadeGamepad, Guest]]:
    """Have a robot up whose gamepad is made, and listen to what arrives at its base."""
    inputs = folder / "input"
    inputs.mkdir()
    (folder / "robot.yaml").write_text(ROBOT, encoding="utf-8")
    pad = MadeGamepad(inputs)
    environment = {"XDG_RUNTIME_DIR": str(folder)}
    made = [sys.executable, "-m", "tests.devices.made_gamepad", str(inputs)]
    program([*made, "up", "-d", str(folder / "robot.yaml")], environment)()
    try:
        with Guest(place_of(RobotFolder(folder / "rbxcompose" / NAME)), stays=True) as guest:
            yield pad, guest
    finally:
        program([*COMMAND, "down"], environment)()


def rows() -> list[Row]:
    """Return how long commands and stops take."""
    arrived: list[tuple[float, float]] = []
    with TemporaryDirectory() as folder, _driven(Path(folder)) as (pad, guest):
        key = data_key(guest.domain, "/cmd_vel", Twist.TYPE, Twist.HASH)
        guest.transport.subscribe(
            key,
            Qos.COMMAND,
            lambda arrival: arrived.append((time.perf_counter(), decode(Twist, arrival.payload).linear.x)),
        )

        def until(x: float, since: float) -> float:
            """Return how long after a moment the base has a speed, to a hundredth of what the stick can [s]."""
            while time.perf_counter() < since + PATIENCE:
                for at, speed in arrived:
                    if at > since and abs(speed - x) < 0.003:
                        return at - since
                time.sleep(0.0002)
            raise TimeoutError(f"no command of {x:.3f} m/s has arrived")

        pad.press(LB)
        until(0.0, time.perf_counter())
        took = []
        for number in range(MANY):
            wanted = 0.1 + 0.001 * (number * 37 % 190)  # each other than the last one by more than is looked at
            time.sleep(PAUSE)
            began = time.perf_counter()
            pad.move(STICKS[1], -round(32768 * (0.1 + 0.9 * wanted / 0.3)))
            took.append(until(wanted, began))
        stops = []
        for _ in range(PULLED):
            pad.press(LB)
            pad.move(STICKS[1], -32768)
            until(0.3, time.perf_counter())
            began = time.perf_counter()
            pad.unplug()
            stops.append(until(0.0, began))
            pad.plug()
            time.sleep(2.0)  # until it was found again
            pad.let_go(LB)
            time.sleep(0.1)
    moved, stopped = Samples(tuple(took)), Samples(tuple(stops))
    return [
        Row(
            name="gamepad: from its stick to the base",
            unit="ms",
            how="bytes of an event, evdev, the component, the mux, and the bus to another process",
            ours=moved.median * 1e3,
            p99=moved.p99 * 1e3,
            most=20,
        ),
        Row(
            name="gamepad: unplugged while it drives, until the stop at the base",
            unit="ms",
            how="the same way",
            ours=stopped.median * 1e3,
            p99=stopped.p99 * 1e3,
            most=20,
        ),
    ]
