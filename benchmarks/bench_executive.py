"""Missions: from a skill's result to the next goal on a running robot, and what a mission that waits takes."""

from __future__ import annotations

import time
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.bench_robot import process_of, up
from benchmarks.measuring import ROOT, Row, Samples, processor_time
from benchmarks.peers import wait_for
from rbxcompose.base.plugins import GROUP

MEASURES = ("rbxcompose/bus", "rbxcompose/missions", "rbxcompose/runtime")

WATCHED = 20.0  # [s] of real time
SETTLED = 3.0  # [s] before that
ROBOT = """rbx: 1
kind: Robot
name: errands
about: Does the same again and again.
components:
  errand:
    type: errand
    file: {file}
missions:
  again: missions/again.yaml
start: again
"""
MISSION = "rbx: 1\nkind: Mission\nname: again\ndo:\n  repeat: forever\n  do: errand\n"


def rows() -> list[Row]:
    """Return the time between two skills, and the load of the patrol's mission."""
    with TemporaryDirectory() as folder:
        waits = _waits(Path(folder))
    with TemporaryDirectory() as folder:
        load = _load({"XDG_RUNTIME_DIR": folder})
    return [
        Row(
            name="from a skill's result to the goal of the next one",
            unit="ms",
            how="the server of the skill and the mission are two processes",
            ours=waits.median * 1e3,
            p99=waits.p99 * 1e3,
            most=5,
        ),
        Row(
            name="load of the patrol mission while it waits for its skills",
            unit="% of a core",
            how=f"processor time of its process over {WATCHED:.0f} s of a patrol, heartbeats included",
            ours=100 * load,
            most=0.5,
        ),
    ]


def _waits(folder: Path) -> Samples:
    site, robot, file = folder / "site/errands-0.dist-info", folder / "robot.yaml", folder / "waits"
    for path, text in (
        (site / "METADATA", "Metadata-Version: 2.1\nName: errands\nVersion: 0\n"),
        (site / "entry_points.txt", f"[{GROUP}]\ncomponent.errand = benchmarks.relay_nodes.errand\n"),
        (folder / "missions/again.yaml", MISSION),
        (robot, ROBOT.format(file=file)),
    ):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    with up(str(robot), {"XDG_RUNTIME_DIR": str(folder), "PYTHONPATH": f"{site.parent}:{ROOT}"}):
        wait_for(file.exists, "errands")
        time.sleep(0.1)  # until all of it is written
        return Samples(tuple(map(float, file.read_text(encoding="ascii").split())))


def _load(environment: dict[str, str]) -> float:
    with up(str(ROOT / "robots/turtlebot"), environment):
        time.sleep(SETTLED)
        pid = process_of("mission", environment)
        before = processor_time(pid)
        time.sleep(WATCHED)
        return (processor_time(pid) - before) / WATCHED
