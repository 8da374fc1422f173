"""Examinations of this machine: how they are declared, the data they use, and reading it."""

import ctypes
import os
import re
import resource
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Any

import rbxcompose
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import state_folder
from rbxcompose.base.findings import Finding, Severity
from rbxcompose.base.plugins import LEFT_OUT, Plugins
from rbxcompose.bus.graph import Graph
from rbxcompose.compiler.check_runner import answers_of
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.domains.devices.serial_ports import SerialPort
from rbxcompose.runtime.folder import RobotFolder, RobotState, base_folder
from rbxcompose.runtime.processes import Process, titled

PLUGINS = Plugins("doctor", "examinations")
FINE = "ok"
NAME = "rbxcompose"
_PROC, _SHARED = Path("/proc"), Path("/dev/shm")  # noqa: S108
_LISTENS = "0A"  # the state of a socket in /proc/net/tcp
_ADDRESS, _STATE, _INODE = 1, 3, 9  # fields of its lines
_LOOPBACK = re.compile("(0{16}FFFF0000)?[0-9A-F]{6}7F|0{24}01000000")  # there, words of IPv4 and IPv6
_SOCKET = re.compile(r"socket:\[(\d+)\]")
_LOCKED = re.compile(r"^([A-Za-z0-9_.-]+)==([^\s;\\]+)", re.MULTILINE)
_REQUIRED = re.compile(r"[A-Za-z0-9_.-]+")
_TIMEX = 256  # [B], more than adjtimex(2) writes
_UNSYNCHRONISED = 5  # TIME_ERROR
_DAY = 86_400.0  # [s]


@dataclass(frozen=True, slots=True)
class BusFacts:
    """The participants of a robot's bus, and the minimum age of the nodes' stamps [s], by node."""

    graph: Graph
    ages: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class RunningRobot:
    """A robot that is up, or the remains of one.

    `problem` is why its state cannot be read, `robot` is what its file describes now; `bus` is None if it cannot be
    reached.
    """

    folder: RobotFolder
    state: RobotState | None
    problem: str = ""
    robot: Robot | None = None
    bus: BusFacts | None = None

    @property
    def name(self) -> str:
        """Return the robot's name."""
        return self.folder.path.name


@dataclass(frozen=True, slots=True)
class ResourceLimits:
    """The limits of this user's processes; None means no limit. Sizes in bytes."""

    open_files: int | None
    real_time_priority: int | None
    locked_memory: int | None
    shared_memory: int | None  # free space; None if there is none


@dataclass(frozen=True, slots=True)
class Clocks:
    """The wall clock [s since the epoch], and its step against the monotonic clock during the examination [s].

    `is_synchronised` says whether the kernel follows a time server; None if unknown. `oldest` is a time that has surely
    passed.
    """

    wall: float
    step: float
    is_synchronised: bool | None
    oldest: float


@dataclass(frozen=True, slots=True)
class Listener:
    """A listener at a TCP port; the process is unknown if it belongs to another user."""

    pid: int | None
    title: str
    is_open: bool = False  # to other machines


@dataclass(frozen=True, slots=True)
class Version:
    """A package, with its installed and its locked version; None where there is none."""

    name: str
    installed: str | None
    locked: str | None


@dataclass(frozen=True, slots=True)
class HostFacts:
    """All facts. `file` is the named robot, which need not be up; `processes` are this user's titled processes.

    `latencies` are the latency timers of USB adapters [s], by the paths of their ports; `ports` are plugged in.
    `disks` has the free space [B] where each kind of file goes.
    """

    running: Sequence[RunningRobot]
    file: Robot | None
    python: str
    versions: Sequence[Version]
    clocks: Clocks
    limits: ResourceLimits
    listeners: Mapping[int, Listener]
    processes: Mapping[Process, str]
    base: Path
    latencies: Mapping[str, float] = field(default_factory=dict)
    ports: Sequence[SerialPort] = ()
    disks: Mapping[str, int] = field(default_factory=dict)

    @property
    def robots(self) -> list[Robot]:
        """Return the robots that the files describe, of all that are examined."""
        described = (self.file, *(running.robot for running in self.running))
        return [robot for robot in described if robot is not None]


Examine = Callable[[HostFacts], Iterable[str | Finding]]
"""Yields findings, and words on what is fine."""

EXAMINATIONS: dict[str, Examine] = {}  # every one that has been imported, by name


@dataclass(frozen=True, slots=True)
class ExaminationResult:
    """The result of one examination: words on what is fine, or a finding."""

    examination: str
    answer: str | Finding

    @property
    def level(self) -> str:
        """Return `ok`, `warning` or `error`."""
        return FINE if isinstance(self.answer, str) else self.answer.severity.value

    def to_data(self) -> dict[str, Any]:
        """Return the result as data for JSON."""
        data: dict[str, Any] = {"examination": self.examination, "level": self.level}
        if isinstance(self.answer, str):
            return {**data, "message": self.answer}
        return {**data, "code": self.answer.code, "message": self.answer.message, "help": self.answer.help}


def examination(examine: Examine) -> Examine:
    """Declare an examination under the name of its function.

    Raises:
        ValueError: if another one has this name.
    """
    name = getattr(examine, "__name__", "")
    if EXAMINATIONS.setdefault(name, examine) is not examine:
        raise ValueError(f"two examinations have the name {name!r}")
    return examine


def examine_all(facts: HostFacts) -> list[ExaminationResult]:
    """Run every examination, by name; one of another package is left out if it is broken, or has the name of ours."""
    PLUGINS.load_shipped()
    foreign = [name for name in sorted(PLUGINS.third_party) if name not in EXAMINATIONS]
    broken = [(name, LEFT_OUT.at(None, problem)) for name in foreign if (problem := PLUGINS.problem(name))]
    answers = [
        (name, answer)
        for name, examine in sorted(EXAMINATIONS.items())
        for answer in answers_of(examine, f"examination {name}", partial(examine, facts))
    ]
    return [ExaminationResult(*result) for result in (*answers, *broken)]


def has_errors(answers: Sequence[ExaminationResult]) -> bool:
    """Return whether anything keeps a robot from running."""
    return any(result.level == Severity.ERROR.value for result in answers)


def listeners() -> dict[int, Listener]:
    """Return the listeners at TCP ports."""
    sockets = sorted(_listening())  # of several at a port, the one that is open to other machines
    inodes = {inode for _, _, inode in sockets}
    owners = {inode: pid for inode, pid in _sockets() if inode in inodes}
    found = {port: (owners.get(inode), is_open) for port, is_open, inode in sockets}
    return {port: Listener(pid, "" if pid is None else _title(pid), is_open) for port, (pid, is_open) in found.items()}


def _listening() -> Iterator[tuple[int, bool, str]]:
    """Yield the port of each socket that listens, whether other machines reach it, and its inode."""
    for name in ("net/tcp", "net/tcp6"):
        try:
            lines = (_PROC / name).read_text(encoding="ascii").splitlines()[1:]
        except FileNotFoundError:
            continue  # a kernel without this address family
        for fields in map(str.split, lines):
            if fields[_STATE] == _LISTENS:
                address, _, port = fields[_ADDRESS].partition(":")
                yield int(port, 16), not _LOOPBACK.fullmatch(address), fields[_INODE]


def _sockets() -> Iterator[tuple[str, int]]:
    """Yield the sockets of all processes that we may inspect, by inode."""
    for folder in (path for path in _PROC.iterdir() if path.name.isdigit()):
        for link in _links(folder / "fd"):
            if found := _SOCKET.fullmatch(link):
                yield found[1], int(folder.name)


def _links(folder: Path) -> Iterator[str]:
    """Yield the open files of a process; nothing if it belongs to somebody else or has ended meanwhile."""
    try:
        for link in os.listdir(folder):
            try:
                yield os.readlink(folder / link)
            except FileNotFoundError:
                continue  # closed meanwhile
    except (PermissionError, FileNotFoundError, ProcessLookupError):
        return


def _title(pid: int) -> str:
    try:
        return (_PROC / str(pid) / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace").strip()
    except (FileNotFoundError, ProcessLookupError):
        return "one that has ended"


def processes() -> dict[Process, str]:
    """Return the processes of this user's robots with their titles."""
    return {process: _title(process.pid) for process in titled(f"{NAME} ")}


def limits() -> ResourceLimits:
    """Return the limits of processes."""
    return ResourceLimits(
        _limit(resource.RLIMIT_NOFILE), _limit(resource.RLIMIT_RTPRIO), _limit(resource.RLIMIT_MEMLOCK), _free(_SHARED)
    )


def _limit(which: int) -> int | None:
    soft, _ = resource.getrlimit(which)
    return None if soft == resource.RLIM_INFINITY else soft


def _free(folder: Path) -> int | None:
    try:
        found = os.statvfs(folder)
    except FileNotFoundError:
        return None
    return found.f_bavail * found.f_frsize


def disks() -> dict[str, int]:
    """Return the free space where each kind of file goes [B]."""
    folders = {"logs": base_folder(), "snapshots of missions": state_folder(), "recordings made here": Path.cwd()}
    there = {kind: next(each for each in (path, *path.parents) if each.exists()) for kind, path in folders.items()}
    return {f"{kind}, in {path}": free for kind, path in there.items() if (free := _free(path)) is not None}


class ClockWatch:
    """Compares the wall clock with the monotonic clock, from its creation on."""

    def __init__(self) -> None:
        self._offset = time.time() - time.monotonic()

    def clocks(self) -> Clocks:
        """Return the present state of the clocks."""
        made = Path(rbxcompose.__file__).stat().st_mtime - _DAY  # time zones and archives may be that far off
        return Clocks(time.time(), time.time() - time.monotonic() - self._offset, _is_synchronised(), made)


def _is_synchronised() -> bool | None:
    """Query the kernel with an adjtimex(2) that changes nothing."""
    state = ctypes.CDLL(None, use_errno=True).adjtimex(ctypes.create_string_buffer(_TIMEX))
    return None if state < 0 else state != _UNSYNCHRONISED


def versions() -> list[Version]:
    """Return rbxcompose and the packages that it needs; in a checkout, the lock file is beside the package."""
    lock = Path(rbxcompose.__file__).parents[1] / "requirements.lock"
    lines = _LOCKED.findall(lock.read_text(encoding="utf-8")) if lock.is_file() else []
    locked = {_normal(name): version for name, version in lines}
    needed = [Version(name, _installed(name), locked.get(_normal(name))) for name in sorted(_needed())]
    return [Version(NAME, rbxcompose.__version__, None), *needed]


def _needed() -> set[str]:
    try:
        required = metadata.requires(NAME) or []
    except metadata.PackageNotFoundError:
        return set()  # run from its folder without being installed
    return {found[0] for item in required if "extra ==" not in item and (found := _REQUIRED.match(item))}


def _installed(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()
