"""The parent of one program of others: starts it, stops it, and leaves nothing of it behind.

It is a process of its own and runs with `python -I -S`, so it imports only what starts at once. Whatever the program
forks becomes its child sooner or later, so it can end all of it. When its own parent dies, its standard input ends, and
it ends the program as well. What happens, it writes to a descriptor, a line of JSON for each event.
"""

from __future__ import annotations

import ctypes
import json
import os
import resource
import select
import signal
import time

TYPE_CHECKING = False  # as in `typing`, which takes longer to import than all else here
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    Order = dict[str, Any]
    Report = Callable[..., None]

_PDEATHSIG, _SUBREAPER = 1, 36  # options of prctl(2)
_HARMLESS = 127  # exit code of a child that could not start the command
_AT_ONCE = 1.0  # [s] for what was killed to end
_ORPHANED = 1.0  # [s] that a program has when nobody is left to drive the robot
_LIBC = ctypes.CDLL(None)
_TAKEN = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGPIPE)


def main() -> None:
    """Keep the program that the first line of the standard input describes."""
    with open(0, "rb", buffering=0, closefd=False) as orders:  # as an argument, others would see its environment
        wanted = json.loads(orders.readline())
    _LIBC.prctl(_SUBREAPER, 1, 0, 0, 0)
    for number in _TAKEN:
        signal.signal(number, signal.SIG_IGN)
    ended, wakes = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    signal.set_wakeup_fd(wakes)
    signal.signal(signal.SIGCHLD, lambda number, frame: None)
    os.set_inheritable(wanted["report"], False)

    def report(**event: object) -> None:
        try:
            os.write(wanted["report"], (json.dumps(event) + "\n").encode())
        except OSError:
            return  # nobody is left to read it

    child = start(wanted, report)
    if child is not None:
        for descriptor in (1, 2):  # only the program's: their end is its end
            os.dup2(os.open(os.devnull, os.O_WRONLY), descriptor)
        keep(wanted, child, ended, report)


def start(wanted: Order, report: Report) -> int | None:
    """Start the command; return its process, or None after a report of what prevents it."""
    failed, fails = os.pipe2(os.O_CLOEXEC)
    keeper = os.getpid()
    child = os.fork()
    if child == 0:
        try:
            _become(wanted, keeper)
        except OSError as error:
            os.write(fails, json.dumps([error.strerror, error.filename or ""]).encode())
        finally:
            os._exit(_HARMLESS)
    os.close(fails)
    problem = os.read(failed, 4096)
    if problem:
        os.waitpid(child, 0)
        report(event="failed", why=json.loads(problem))
        return None
    report(event="started", pid=child)
    return child


def _become(wanted: Order, keeper: int) -> None:
    os.setsid()
    _LIBC.prctl(_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != keeper:
        os._exit(_HARMLESS)
    for number in (*_TAKEN, signal.SIGCHLD):
        signal.signal(number, signal.SIG_DFL)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if files := wanted["open_files"]:
        resource.setrlimit(resource.RLIMIT_NOFILE, (files, files))
    if cores := wanted["cores"]:
        os.sched_setaffinity(0, cores)
    os.nice(wanted["nice"])
    os.chdir(wanted["folder"])
    os.execvpe(wanted["command"][0], wanted["command"], wanted["environment"])  # noqa: S606 -- what a user wants to run, without a shell


def keep(wanted: Order, child: int, ended: int, report: Report) -> None:
    """Wait for the end of the program, ask for it when told to, and end what it leaves behind."""
    deadline: float | None = None
    while True:
        pause = None if deadline is None else max(0.0, deadline - time.monotonic())
        ready, _, _ = select.select([ended, *([0] if deadline is None else ())], [], [], pause)
        if ended in ready:
            os.read(ended, 4096)
            if (status := _reaped(child)) is not None:
                break
        if 0 in ready:
            patience = wanted["patience"] if os.read(0, 1) else min(wanted["patience"], _ORPHANED)
            _signal_group(child, wanted["signal"])
            deadline = time.monotonic() + patience
        if deadline is not None and time.monotonic() >= deadline:
            report(event="deaf")
            _signal_group(child, signal.SIGKILL)
            deadline = time.monotonic() + _AT_ONCE
    report(event="ended", status=status)
    if left := _end_all():
        report(event="left", number=left)


def _reaped(child: int) -> int | None:
    """Collect the children that have ended; return the wait status of `child` if it is one of them."""
    found = None
    while True:
        try:
            pid, status = os.waitpid(-1, os.WNOHANG)
        except ChildProcessError:
            return found
        if pid == 0:
            return found
        if pid == child:
            found = status


def _signal_group(child: int, number: int) -> None:
    try:
        os.killpg(child, number)
    except ProcessLookupError:
        return  # it ends just now


def _end_all() -> int:
    """Kill what is left of the program, and what that leaves; return how many processes that were."""
    killed: set[int] = set()
    deadline = time.monotonic() + _AT_ONCE
    while time.monotonic() < deadline:
        _reaped(0)
        with open(f"/proc/self/task/{os.getpid()}/children", encoding="ascii") as file:
            left = {int(text) for text in file.read().split()}
        if not left:
            break
        for pid in left:
            os.kill(pid, signal.SIGKILL)
        killed |= left
        time.sleep(0.005)  # what a killed process has forked comes here when it is gone
    return len(killed)


if __name__ == "__main__":
    main()
