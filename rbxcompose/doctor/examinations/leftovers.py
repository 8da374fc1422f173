"""What robots have left behind."""

from __future__ import annotations

import re
from collections.abc import Iterator

from rbxcompose.doctor.facts import HostFacts, RunningRobot
from rbxcompose.doctor.registry import examination
from rbxcompose.findings import Finding, Severity, kind
from rbxcompose.printable import plain

LEFT = kind("RBX9409", Severity.WARNING)
_TITLE = re.compile(r"rbxcompose (?P<robot>[^:]+): (?P<process>.+)")
_SUPERVISOR = "supervisor"


@examination
def leftovers(facts: HostFacts) -> Iterator[str | Finding]:
    """Look for state without a supervisor, and for processes without one."""
    for one in facts.running:
        yield from _folder(one)
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


def _still_runs(one: RunningRobot) -> bool:
    return one.state is not None and not one.state.is_supervised and bool(one.state.alive())


def _folder(one: RunningRobot) -> Iterator[str | Finding]:
    todo = f"rbxcompose down {one.name}"
    if one.state is None:
        yield LEFT.at(None, f"the state of '{one.name}' cannot be read: {one.problem}", help=todo)
    elif not one.state.is_supervised:
        alive = ", ".join(one.state.alive())
        rest = f"these processes still run: {alive}" if alive else "its files, and shared memory, are still there"
        yield LEFT.at(None, f"the supervisor of '{one.name}' is dead; {rest}", help=todo)
    else:
        yield f"{one.name}: its supervisor runs"
