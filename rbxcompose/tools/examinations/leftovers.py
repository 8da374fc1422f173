"""What robots have left behind."""

from __future__ import annotations

import re
from collections.abc import Iterator

from rbxcompose.base.findings import Finding, Severity, kind
from rbxcompose.base.printable import plain
from rbxcompose.tools.doctor import HostFacts, RunningRobot, examination

LEFT = kind("RBX9409", Severity.WARNING)
_TITLE = re.compile(r"rbxcompose (?P<robot>[^:]+): (?P<process>.+)")
_SUPERVISOR = "supervisor"


@examination
def leftovers(facts: HostFacts) -> Iterator[str | Finding]:
    """Look for state without a supervisor, and for processes without one."""
    for running_robot in facts.running:
        yield from _folder(running_robot)
    known = {one.name for one in facts.running}
    found: dict[str, dict[str, int]] = {}
    for process, title in facts.processes.items():
        if match := _TITLE.fullmatch(title):
            found.setdefault(match["robot"], {})[match["process"]] = process.pid
    lost = {robot: pids for robot, pids in found.items() if robot not in known and _SUPERVISOR not in pids}
    for robot, pids in sorted(lost.items()):
        told = ", ".join(f"{plain(name)} ({pid})" for name, pid in sorted(pids.items()))
        words = f"processes of '{plain(robot)}' run without a supervisor and without a state: {told}"
        yield LEFT.at(None, words, help=f"kill {' '.join(map(str, sorted(pids.values())))}")
    if not lost and not any(_still_runs(one) for one in facts.running):
        yield "no process runs without a supervisor"


def _still_runs(robot: RunningRobot) -> bool:
    return robot.state is not None and not robot.state.is_supervised and bool(robot.state.alive())


def _folder(robot: RunningRobot) -> Iterator[str | Finding]:
    todo = f"rbxcompose down {robot.name}"
    if robot.state is None:
        yield LEFT.at(None, f"the state of '{robot.name}' cannot be read: {robot.problem}", help=todo)
    elif not robot.state.is_supervised:
        alive = ", ".join(robot.state.alive())
        rest = f"these processes still run: {alive}" if alive else "its files, and shared memory, are still there"
        yield LEFT.at(None, f"the supervisor of '{robot.name}' is dead; {rest}", help=todo)
    else:
        yield f"{robot.name}: its supervisor runs"
