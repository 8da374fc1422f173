"""Endurance: what the patrol robot takes of a processor, and whether its memory grows."""

from __future__ import annotations

import gc
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.bench_robot import supervisor, up
from benchmarks.measuring import ROOT, Row, memory_now, processor_time, tree
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.testing.bench import Bench

MEASURES = ("rbxcompose/bus", "rbxcompose/missions", "rbxcompose/runtime", "rbxcompose/domains/bases")

WATCHED = 20.0  # [s] of real time
SETTLED = 5.0  # [s] before that
PATROLLED = 1800.0  # [s] of robot time
FILLED = 600.0  # [s] of robot time after which what is bounded by time should be full
PIECE = 60.0  # [s] of robot time, after which what the bench itself keeps is forgotten
WAITING = "rbx: 1\nkind: Mission\nname: patrol\nabout: Waits.\ndo:\n  - check: $battery <= 100 %\n  - wait: 100000 s\n"


def rows() -> list[Row]:
    """Return load and growth."""
    with TemporaryDirectory() as folder:
        patrol = (ROOT / "missions/patrol.yaml").read_text(encoding="utf-8")
        endless = patrol.replace("default: 2\n", "default: 100000\n")
        if endless == patrol:
            raise ValueError("the patrol does not tell how many rounds it has")
        robots = {name: _robot(Path(folder) / name, text) for name, text in (("waits", WAITING), ("patrols", endless))}
        return [*(_load(name, path, folder) for name, path in robots.items()), _growth(robots["patrols"])]


def _robot(folder: Path, mission: str) -> str:
    """Write the patrol robot with another mission; both lie as they do in the repository."""
    path = folder / "robots/turtlebot/robot.yaml"
    for file, text in (
        (path, (ROOT / "robots/turtlebot/robot.yaml").read_text(encoding="utf-8")),
        (folder / "missions/patrol.yaml", mission),
    ):
        file.parent.mkdir(parents=True)
        file.write_text(text, encoding="utf-8")
    return str(path)


def _load(name: str, path: str, folder: str) -> Row:
    environment = {"XDG_RUNTIME_DIR": folder}
    with up(path, environment):
        time.sleep(SETTLED)
        processes = tree(supervisor(environment))
        before = sum(map(processor_time, processes))
        time.sleep(WATCHED)
        taken = sum(map(processor_time, processes)) - before
    return Row(
        name=f"load of the patrol robot while it {name}",
        unit="% of a core",
        how=f"processor time of all its processes over {WATCHED:.0f} s; its simulated base publishes odometry at 50 Hz",
        ours=100 * taken / WATCHED,
        most=3 if name == "waits" else None,
    )


def _growth(path: str) -> Row:
    plan = compile_robot(path, environment={}).plan
    if plan is None:
        raise ValueError("the endless patrol has findings")
    bench = Bench(plan=plan)
    start = 0
    while bench.clock.now() < PATROLLED:
        bench.advance(PIECE)
        bench.records.clear()
        bench.events.clear()
        if not start and bench.clock.now() >= FILLED:
            gc.collect()
            start = memory_now()
    gc.collect()
    return Row(
        name="growth of memory while it patrols",
        unit="kB/min",
        how="all in one process on a stepped clock, minutes 10 to 30; the mission's history fills up to its limit",
        ours=(memory_now() - start) / 1e3 / ((PATROLLED - FILLED) / 60.0),
        most=200,
    )
