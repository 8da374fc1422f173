"""Parameters: one of a running robot, set by a client that stays connected, in turns with dynamic_reconfigure's.

The robot has been brought up as a user does it, so its supervisor and the judge of its rules are in the way.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.bench_bus import End, ros_ends, started_ends
from benchmarks.measuring import COMMAND, Row, Samples, program
from benchmarks.peers import free_port

MEASURES = ("rbxcompose/bus", "rbxcompose/compiler", "rbxcompose/runtime")

ROUNDS = 20
SETS = 25  # per round
WARM = 10  # before the first round: the first change that rules could notice starts their judge
PEER = "dynamic_reconfigure"
MANIFEST = """rbx: 1
kind: Robot
name: benchmark_of_parameters
bus: {{port: {port}}}
components:
  battery: {{type: battery_sim, runtime: 45 s}}
  base: {{type: diff_drive_sim}}
  go_to: {{type: go_to}}
  low: {{type: threshold, topic: battery_level, warn_below: 20}}
"""
FREE = ("low", "hysteresis")
RULED = ("battery", "runtime")
_NAMES = {"free": "that no rule of the robot could notice", "ruled": "within the rules of the whole robot"}


@contextmanager
def _robot() -> Iterator[End]:
    """Give a client of a robot that is up."""
    with TemporaryDirectory() as folder:
        port, base = free_port(), Path(folder)
        (base / "robot.yaml").write_text(MANIFEST.format(port=port), encoding="utf-8")
        environment = {"XDG_RUNTIME_DIR": folder}
        program([*COMMAND, "up", "-d", folder], environment)()
        try:
            setter = [sys.executable, "-m", "benchmarks.bus_ends", "our_setter", str(port)]
            with started_ends([setter], {}) as (end,):
                yield end
        finally:
            program([*COMMAND, "down"], environment)()


def rows() -> list[Row]:
    """Return the figures of changing settings."""
    ours: dict[str, list[float]] = {"free": [], "ruled": []}
    theirs: list[float] = []
    with _robot() as robot, ros_ends() as of_ros:
        for pair in (FREE, RULED):
            robot.ask("set", *pair, WARM)
        for _ in range(ROUNDS):
            ours["free"] += robot.ask("set", *FREE, SETS)
            ours["ruled"] += robot.ask("set", *RULED, SETS)
            theirs += of_ros[1].ask("set", SETS) if of_ros else []
    return [row for name, times in ours.items() for row in _rows(_NAMES[name], times, theirs)]


def _rows(how: str, ours: list[float], theirs: list[float]) -> Iterator[Row]:
    mine, peer = Samples(tuple(ours)), Samples(tuple(theirs)) if theirs else None
    against, most = (PEER, 0.5) if peer else ("", None)
    name = "parameter of a running robot set by a tool of ROS 2"
    median, slow = (peer.median * 1e3, peer.p99 * 1e3) if peer else (None, None)
    yield Row(name, "ms", how, mine.median * 1e3, mine.p99 * 1e3, median, against, most_ratio=most)
    yield Row(f"{name}: p99", "ms", how, mine.p99 * 1e3, None, slow, against, most_ratio=most)
