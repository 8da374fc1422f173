"""The patrol robot in real processes, and as fast as the clock can be stepped."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.measuring import BARE, COMMAND, ROOT, Row, Samples, in_turns, memory_of, program
from rbxcompose.compiler import compile_robot
from rbxcompose.testing import run_robot

ROBOT = str(ROOT / "robots/turtlebot/robot.yaml")
STARTS = 5


def rows() -> list[Row]:
    """Return the figures of the running robot."""
    times, memory = [], 0.0
    with TemporaryDirectory() as folder:
        environment = {"XDG_RUNTIME_DIR": folder}
        for _ in range(STARTS):
            started = time.perf_counter()
            with _up(environment):
                times.append(time.perf_counter() - started)
                ask = program([*COMMAND, "ps", "--json"], environment)
                answers, bare = in_turns(ask, program(BARE), rounds=5, clock=time.perf_counter)
                memory = max(memory, _memory(environment, Path(folder)))
    starts = Samples(tuple(times))
    return [
        Row(
            name="`up -d` of the patrol robot until all are active",
            unit="ms",
            how="whole command, from its start until it returns",
            ours=starts.median * 1e3,
            p99=starts.p99 * 1e3,
        ),
        Row(
            name="memory of that robot",
            unit="MB",
            how="proportional set size of all of its processes, supervisor and router included",
            ours=memory / 1e6,
            most=150,
        ),
        Row(
            name="`ps` of that robot",
            unit="ms",
            how="from start to exit",
            ours=answers.median * 1e3,
            p99=answers.p99 * 1e3,
            peer=bare.median * 1e3,
            against="python -c pass",
        ),
        _stepped(),
    ]


@contextmanager
def _up(environment: dict[str, str]) -> Iterator[None]:
    try:
        program([*COMMAND, "up", "-d", ROBOT], environment)()
        yield
    finally:
        program([*COMMAND, "down"], environment)()


def _memory(environment: dict[str, str], folder: Path) -> float:
    answer = json.loads(str(program([*COMMAND, "ps", "--json"], environment)()))
    root = answer["supervisor"]["pid"]
    return sum(memory_of(pid) for pid in [root, *_below(root)])


def _below(pid: int) -> list[int]:
    """Return the processes that a process has started, and theirs."""
    children = [
        int(child)
        for task in os.listdir(f"/proc/{pid}/task")
        for child in Path(f"/proc/{pid}/task/{task}/children").read_text(encoding="utf-8").split()
    ]
    return [found for child in children for found in [child, *_below(child)]]


def _stepped() -> Row:
    plan = compile_robot(ROBOT, environment={}).plan
    if plan is None:
        raise ValueError("the patrol robot has findings")
    times = []
    for _ in range(3):
        started = time.perf_counter()
        ran = run_robot(plan)
        times.append(ran.bench.clock.now() / (time.perf_counter() - started))
        if ran.outcome != "success":
            raise ValueError(f"the patrol ended in {ran.outcome}")
    return Row(
        name="the patrol on a stepped clock",
        unit="x real time",
        how="robot time over wall time, all components in one process",
        ours=Samples(tuple(times)).median,
    )
