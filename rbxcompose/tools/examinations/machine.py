"""This machine: its limits, versions, private files, and what robots have left behind on it."""

import os
import re
import stat
from collections.abc import Iterator
from pathlib import Path

from rbxcompose.base.findings import Finding, Severity, kind
from rbxcompose.base.printable import plain
from rbxcompose.commands.lookup import version_problem
from rbxcompose.commands.targets import missing_extras
from rbxcompose.manifest.files import project_of, shown_name
from rbxcompose.manifest.fill import SECRETS_FOLDER
from rbxcompose.sdk.capabilities import NeedsExtra
from rbxcompose.tools.doctor import HostFacts, RunningRobot, examination

LEFT = kind("RBX9409", Severity.WARNING)
_TITLE = re.compile(r"rbxcompose (?P<robot>[^:]+): (?P<process>.+)")
_SUPERVISOR = "supervisor"
FEWEST_FILES = 1024
SMALLEST_SHARED = SMALLEST_DISK = 16_000_000  # [B]
LOW_LIMIT = kind("RBX9406", Severity.WARNING)
OPEN_TO_OTHERS = kind("RBX9410")
OTHER_VERSION = kind("RBX9401", Severity.WARNING)


@examination
def leftovers(facts: HostFacts) -> Iterator[str | Finding]:
    """Look for state without a supervisor, and for processes without one."""
    for running_robot in facts.running:
        yield from _left_by(running_robot)
    known = {one.name for one in facts.running}
    found: dict[str, dict[str, int]] = {}
    for process, title in facts.processes.items():
        if match := _TITLE.fullmatch(title):
            found.setdefault(match["robot"], {})[match["process"]] = process.pid
    lost = {robot: pids for robot, pids in found.items() if robot not in known and _SUPERVISOR not in pids}
    for robot, pids in sorted(lost.items()):
        listed = ", ".join(f"{plain(name)} ({pid})" for name, pid in sorted(pids.items()))
        words = f"processes of '{plain(robot)}' run without a supervisor and without a state: {listed}"
        yield LEFT.at(None, words, help=f"kill {' '.join(map(str, sorted(pids.values())))}")
    if not lost and not any(_still_runs(one) for one in facts.running):
        yield "no process runs without a supervisor"


def _still_runs(robot: RunningRobot) -> bool:
    return robot.state is not None and not robot.state.is_supervised and bool(robot.state.alive())


def _left_by(robot: RunningRobot) -> Iterator[str | Finding]:
    todo = f"rbxcompose down {robot.name}"
    if robot.state is None:
        yield LEFT.at(None, f"the state of '{robot.name}' cannot be read: {robot.problem}", help=todo)
    elif not robot.state.is_supervised:
        alive = ", ".join(robot.state.alive())
        rest = f"these processes still run: {alive}" if alive else "its files, and shared memory, are still there"
        yield LEFT.at(None, f"the supervisor of '{robot.name}' is dead; {rest}", help=todo)
    else:
        yield f"{robot.name}: its supervisor runs"


@examination
def limits(facts: HostFacts) -> Iterator[str | Finding]:
    """Report the limits and which of them are too low."""
    has = facts.limits
    if has.open_files is not None and has.open_files < FEWEST_FILES:
        words = f"a process may have only {has.open_files} open files"
        yield LOW_LIMIT.at(None, words, help=f"ulimit -n {FEWEST_FILES}, or more in /etc/security/limits.conf")
    if has.shared_memory is None or has.shared_memory < SMALLEST_SHARED:
        free = "there is none" if has.shared_memory is None else f"only {has.shared_memory / 1e6:.0f} MB of it free"
        yield LOW_LIMIT.at(None, f"shared memory: {free}", help="of a container: docker run --shm-size=256m")
    shared = "none" if has.shared_memory is None else f"{has.shared_memory / 1e6:.0f} MB"
    yield (
        f"open files {_number(has.open_files)}, real-time priority {_number(has.real_time_priority)}, "
        f"locked memory {_size(has.locked_memory)}, shared memory {shared}"
    )


@examination
def disks(facts: HostFacts) -> Iterator[str | Finding]:
    """Report the free space for logs, snapshots and recordings, which are lost without it."""
    for where, free in facts.disks.items():
        words = f"{where}: {_size(free)} free"
        yield words if free >= SMALLEST_DISK else LOW_LIMIT.at(None, words, help="remove what is not needed there")


def _number(value: int | None) -> str:
    return "without limit" if value is None else str(value)


def _size(value: int | None) -> str:
    return "without limit" if value is None else f"{value / 1e6:.0f} MB"


@examination
def permissions(facts: HostFacts) -> Iterator[str | Finding]:
    """Check the folders of robots and the secrets of their projects."""
    folders = [path for path in (facts.base, *(robot.folder.path for robot in facts.running)) if path.exists()]
    secrets = [path for folder in _secret_folders(facts) if folder.is_dir() for path in sorted(folder.iterdir())]
    wrong = [*_open_to_others(folders, "700"), *_open_to_others(secrets, "600")]
    yield from wrong
    if not wrong:
        yield f"{len(folders)} folders of robots and {len(secrets)} secrets are private"


def _secret_folders(facts: HostFacts) -> list[Path]:
    files = (Path(robot.manifest.root.span.file) for robot in facts.robots)
    return list(dict.fromkeys(project_of(file) / SECRETS_FOLDER for file in files))


def _open_to_others(paths: list[Path], mode: str) -> Iterator[Finding]:
    for path in paths:
        try:
            found = path.lstat()
        except FileNotFoundError:
            continue  # removed meanwhile
        name = plain(shown_name(path))
        if found.st_uid != os.getuid():
            yield OPEN_TO_OTHERS.at(None, f"'{name}' belongs to another user", help=f"chown $USER {name}")
        elif stat.S_IMODE(found.st_mode) & 0o077:
            words = f"others may open '{name}' (mode {stat.S_IMODE(found.st_mode):04o})"
            yield OPEN_TO_OTHERS.at(None, words, help=f"chmod {mode} {name}")


@examination
def versions(facts: HostFacts) -> Iterator[str | Finding]:
    """Compare the installed versions with those that robots run, and with the locked ones, if there is a lock file."""
    wrong = [one for one in facts.versions if one.installed is None or one.locked not in (None, one.installed)]
    for one in wrong:
        there = f"{one.name} {one.installed} is installed" if one.installed else f"{one.name} is not installed"
        locked = f", {one.locked} is locked" if one.locked else ""
        todo = "pip install -r requirements.lock" if one.locked else f"pip install {one.name}"
        yield OTHER_VERSION.at(None, there + locked, help=todo)
    for robot in (running.state for running in facts.running if running.state is not None):
        if problem := version_problem(robot.robot, robot.package_version):
            yield OTHER_VERSION.at(None, problem)
    fine = ", ".join(f"{one.name} {one.installed}" for one in facts.versions if one not in wrong)
    yield f"Python {facts.python}, {fine}" if fine else f"Python {facts.python}"


@examination
def extras(facts: HostFacts) -> Iterator[str | Finding]:
    """Look for the packages that components need beside those of rbxcompose itself."""
    for robot in facts.robots:
        missing = list(missing_extras(robot))
        yield from missing
        needed = sorted({needed.extra.value for _, needed in robot.declared(NeedsExtra)})
        if not missing:
            installed = f"{robot.manifest.name}: {', '.join(needed)} installed"
            yield installed if needed else f"{robot.manifest.name} needs none"
    if not facts.robots:
        yield "no robot was examined that may need one"
