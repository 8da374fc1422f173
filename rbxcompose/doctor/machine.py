"""Reads this machine: ports, processes, limits, clocks, packages."""

from __future__ import annotations

import ctypes
import os
import re
import resource
import time
from collections.abc import Iterator, Mapping
from importlib import metadata
from pathlib import Path

import rbxcompose
from rbxcompose.doctor.facts import Clocks, Listener, ResourceLimits, Version
from rbxcompose.runtime.processes import Process, titled

NAME = "rbxcompose"
_PROC, _SHARED = Path("/proc"), Path("/dev/shm")  # noqa: S108
_LISTENS = "0A"  # the state of a socket in /proc/net/tcp
_ADDRESS, _STATE, _INODE = 1, 3, 9  # fields of its lines
_SOCKET = re.compile(r"socket:\[(\d+)\]")
_LOCKED = re.compile(r"^([A-Za-z0-9_.-]+)==([^\s;\\]+)", re.MULTILINE)
_REQUIRED = re.compile(r"[A-Za-z0-9_.-]+")
_TIMEX = 256  # [B], more than adjtimex(2) writes
_UNSYNCHRONISED = 5  # TIME_ERROR
_DAY = 86_400.0  # [s]


def listeners(proc: Path = _PROC) -> dict[int, Listener]:
    """Return the listeners at TCP ports."""
    inodes = dict(_listening(proc))
    owners = {inode: pid for inode, pid in _sockets(proc) if inode in inodes.values()}
    return {port: _listener(owners.get(inode), proc) for port, inode in inodes.items()}


def _listening(proc: Path) -> Iterator[tuple[int, str]]:
    for name in ("net/tcp", "net/tcp6"):
        try:
            lines = (proc / name).read_text(encoding="ascii").splitlines()[1:]
        except FileNotFoundError:
            continue  # a kernel without this address family
        for fields in map(str.split, lines):
            if fields[_STATE] == _LISTENS:
                yield int(fields[_ADDRESS].rpartition(":")[2], 16), fields[_INODE]


def _sockets(proc: Path) -> Iterator[tuple[str, int]]:
    """Yield the sockets of all processes that we may inspect, by inode."""
    for folder in (one for one in proc.iterdir() if one.name.isdigit()):
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


def _listener(pid: int | None, proc: Path) -> Listener:
    return Listener(pid, "" if pid is None else _title(proc / str(pid)))


def _title(folder: Path) -> str:
    try:
        return (folder / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace").strip()
    except (FileNotFoundError, ProcessLookupError):
        return "one that has ended"


def processes() -> dict[Process, str]:
    """Return the processes of this user's robots with their titles."""
    return {process: _title(_PROC / str(process.pid)) for process in titled(f"{NAME} ")}


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
    """Return the packages that rbxcompose needs; in a checkout, the lock file is beside the package."""
    lock = Path(rbxcompose.__file__).parents[1] / "requirements.lock"
    locked = _locks(lock.read_text(encoding="utf-8")) if lock.is_file() else {}
    return [Version(name, _installed(name), locked.get(_normal(name))) for name in sorted(_needed())]


def _needed() -> set[str]:
    try:
        required = metadata.requires(NAME) or []
    except metadata.PackageNotFoundError:
        return set()  # run from its folder without being installed
    return {found[0] for one in required if "extra ==" not in one and (found := _REQUIRED.match(one))}


def _installed(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _locks(text: str) -> Mapping[str, str]:
    return {_normal(name): version for name, version in _LOCKED.findall(text)}


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()
