"""Whole robots: the patrol robot and one with an arm in real processes, and as fast as the clock can be stepped."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.measuring import BARE, COMMAND, ROOT, Row, Samples, in_turns, memory_of, program, tree
from benchmarks.peers import ROS_PYTHON, Ros, free_port, missing
from rbxcompose.base.levels import Level
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.testing import run_robot

MEASURES = ("rbxcompose/bus", "rbxcompose/missions", "rbxcompose/runtime", "rbxcompose/domains/diagnostics")

ROBOT = str(ROOT / "robots/turtlebot/robot.yaml")
ARM_ROBOT = str(ROOT / "robots/pi_robot/robot.yaml")
STARTS = 3
ANSWERS = 5  # of each command, at each start
KILLED = "mission"  # a process that can come back


def rows() -> list[Row]:
    """Return the figures of the running robot."""
    times, memory, stale = [], 0.0, []
    answers: dict[str, list[float]] = {}
    with TemporaryDirectory() as folder:
        environment = {"XDG_RUNTIME_DIR": folder}
        for _ in range(STARTS):
            started = time.perf_counter()
            with up(ROBOT, environment):
                times.append(time.perf_counter() - started)
                _answers(environment, answers)
                memory = max(memory, sum(map(memory_of, tree(supervisor(environment)))))
                stale.append(_until_stale(environment))
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
            name="a process that was killed is shown as STALE, with the cause",
            unit="ms",
            how=f"`kill -9` of `{KILLED}`, until the report of `/diagnostics_agg` that shows it",
            ours=Samples(tuple(stale)).median * 1e3,
            p99=Samples(tuple(stale)).p99 * 1e3,
            most=1000,
        ),
        *_with_an_arm(),
        *_commands({name: Samples(tuple(found)) for name, found in answers.items()}),
        _stepped(),
    ]


def _with_an_arm() -> list[Row]:
    """Return how long the robot with an arm takes to start, and its memory; what is compiled is in the caches."""
    times, memory, arm = [], 0.0, 0.0
    with TemporaryDirectory() as folder:
        environment = {"XDG_RUNTIME_DIR": folder}
        with up(ARM_ROBOT, environment):
            pass
        for _ in range(STARTS):
            started = time.perf_counter()
            with up(ARM_ROBOT, environment):
                times.append(time.perf_counter() - started)
                state = json.loads(str(program([*COMMAND, "ps", "--json"], environment)()))
                memory = max(memory, sum(map(memory_of, tree(state["supervisor"]["pid"]))))
                arm = max(
                    arm,
                    *(memory_of(component["pid"]) for component in state["components"] if component["type"] == "arm"),
                )
    starts, size = Samples(tuple(times)), "proportional set size"
    return [
        Row(
            name="`up -d` of the robot with an arm until all are active",
            unit="ms",
            how="whole command, from its start until it returns; compiled code is in the caches",
            ours=starts.median * 1e3,
            p99=starts.p99 * 1e3,
            most=1500,
        ),
        Row(name="memory of that robot", unit="MB", how=f"{size} of all of its processes", ours=memory / 1e6, most=280),
        Row(name="memory of its arm", unit="MB", how=f"{size} of the process that plans", ours=arm / 1e6, most=130),
    ]


@contextmanager
def up(robot: str, environment: dict[str, str], *options: str) -> Iterator[None]:
    """Have a robot up."""
    try:
        program([*COMMAND, "up", "-d", robot, *options], environment)()
        yield
    finally:
        program([*COMMAND, "down"], environment)()


def supervisor(environment: dict[str, str]) -> int:
    """Return the process that is above all others of the robot that is up."""
    return int(_ps(environment)["supervisor"]["pid"])


def process_of(component: str, environment: dict[str, str]) -> int:
    """Return the process in which a component of the robot that is up runs."""
    return next(int(entry["pid"]) for entry in _ps(environment)["components"] if entry["name"] == component)


def _ps(environment: dict[str, str]) -> Any:
    return json.loads(str(program([*COMMAND, "ps", "--json"], environment)()))


def _answers(environment: dict[str, str], answers: dict[str, list[float]]) -> None:
    jobs = {
        "ps": program([*COMMAND, "ps", "--json"], environment),
        "topic ls": program([*COMMAND, "topic", "ls"], environment),
        BARE[0]: program(BARE),
    }
    with TemporaryDirectory() as folder:
        ros = Ros(Path(folder), free_port())
        if Ros.is_here():
            jobs["rostopic list"] = program([ROS_PYTHON, "/usr/bin/rostopic", "list"], ros.environment)
            with ros.master():
                found = in_turns(*jobs.values(), rounds=ANSWERS, clock=time.perf_counter)
        else:
            found = in_turns(*jobs.values(), rounds=ANSWERS, clock=time.perf_counter)
    for name, samples in zip(jobs, found, strict=True):
        answers.setdefault(name, []).extend(samples.values)


def _commands(answers: dict[str, Samples]) -> list[Row]:
    bare, ros = answers[BARE[0]], answers.get("rostopic list")
    against = [(bare, "python -c pass", None), *([(ros, "rostopic list", 1.0)] if ros is not None else [])]
    return [
        Row(
            name=f"`{command}` of that robot",
            unit="ms",
            how=f"from start to exit{missing() if ros is None else ''}",
            ours=answers[command].median * 1e3,
            p99=answers[command].p99 * 1e3,
            peer=peer.median * 1e3,
            against=name,
            most_ratio=most,
        )
        for command in ("ps", "topic ls")
        for peer, name, most in against
    ]


def _until_stale(environment: dict[str, str]) -> float:
    """Kill a process and return the time until diagnostics have told of it [s], by the clocks of one machine."""
    pid = next(component["pid"] for component in _ps(environment)["components"] if component["process"] == KILLED)
    whole = {**os.environ, "PYTHONPATH": str(ROOT), **environment}
    command = [*COMMAND, "topic", "echo", "/diagnostics_agg", "--json"]
    with subprocess.Popen(command, env=whole, cwd=ROOT, stdout=subprocess.PIPE, text=True) as echo:
        reports = (json.loads(line) for line in echo.stdout or ())
        next(reports)  # it listens
        killed = time.time()
        os.kill(pid, signal.SIGKILL)
        report = next(entry for entry in reports if any(map(_is_told, entry["status"])))
        echo.kill()
    stamp = report["header"]["stamp"]
    return float(stamp["sec"] + stamp["nanosec"] * 1e-9 - killed)


def _is_told(status: Any) -> bool:
    return status["level"] == Level.STALE and status["name"].endswith(KILLED) and "SIGKILL" in status["message"]


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
