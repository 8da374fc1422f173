"""The parent of one program of others: starts it, stops it, and leaves nothing of it behind.

It is a process of its own and runs with `python -I -S`, so it imports only what starts at once. Whatever the program
forks becomes its child sooner or later, so it can end all of it. When its own parent dies, its standard input ends, and
it ends the program as well. What happens, it writes to a descriptor, a line of JSON for each event.
"""

from __future__ import annotations

import ctypes
import json
import math
import os
import resource
import select
import signal
import time

TYPE_CHECKING = False  # as in `typing`, which takes longer to import than all else here
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    ProgramOrder = dict[str, Any]
    Report = Callable[..., None]

_PDEATHSIG, _SUBREAPER = 1, 36  # options of prctl(2)
_HARMLESS = 127  # exit code of a child that could not start the command
_AT_ONCE = 1.0  # [s] for what was killed to end
_ORPHANED = 1.0  # [s] that a program has when nobody is left to drive the robot
_CLEANS_UP = 5.0  # [s] for the command that cleans up
_LIBC = ctypes.CDLL(None)
_ELF = b"\x7fELF"  # how a binary begins
_CLASS, _MACHINE = 4, slice(18, 20)  # where its header has whether it is of 32 or 64 bit, and for which processor
_EMULATORS = "/proc/sys/fs/binfmt_misc"
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

    def report(what: str, value: object = None) -> None:
        try:
            os.write(wanted["report"], (json.dumps((what, value)) + "\n").encode())
        except OSError:
            return  # nobody is left to read it

    child = start(wanted, report)
    if child is not None:
        for descriptor in (1, 2):  # only the program's: their end is its end
            os.dup2(os.open(os.devnull, os.O_WRONLY), descriptor)
        keep(wanted, child, ended, report)
        clean_up(wanted)


def start(wanted: ProgramOrder, report: Report) -> int | None:
    """Start the command; return its process, or None after a report of what prevents it."""
    failed, fails = os.pipe2(os.O_CLOEXEC)
    keeper = os.getpid()
    child = os.fork()
    if child == 0:
        try:
            _become(wanted, keeper)
        except Exception as error:
            os.write(fails, str(error).encode("utf-8", "replace"))
        finally:
            os._exit(_HARMLESS)
    os.close(fails)
    problem = os.read(failed, 4096)
    os.close(failed)
    if problem:
        os.waitpid(child, 0)
        report("failed", problem.decode("utf-8", "replace"))
        return None
    report("started", child)
    return child


class CannotRunError(Exception):
    """Why the program cannot be run, in plain words."""


def _become(wanted: ProgramOrder, keeper: int) -> None:
    os.setsid()
    _LIBC.prctl(_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != keeper:
        os._exit(_HARMLESS)
    for number in (*_TAKEN, signal.SIGCHLD):
        signal.signal(number, signal.SIG_DFL)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    files, cores, nice = wanted["open_files"], wanted["cores"], wanted["nice"]
    if files:
        _limit("open_files", lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (files, files)))
    if cores:
        _limit("cores", lambda: os.sched_setaffinity(0, cores))
    _limit("nice", lambda: os.nice(nice))
    command, folder, environment = wanted["command"], wanted["folder"], wanted["environment"]
    if why := obstacle(command[0], folder, environment.get("PATH", os.defpath)):
        raise CannotRunError(why)
    file = found(command[0], folder, environment.get("PATH", os.defpath))
    try:
        os.chdir(folder)
        os.execve(file, command, environment)  # noqa: S606 -- what a user wants to run, without a shell
    except OSError as error:
        raise CannotRunError(f"{file}: {error.strerror}") from error


def _limit(name: str, apply: Callable[[], object]) -> None:
    try:
        apply()
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise CannotRunError(f"'limits.{name}' cannot be kept here: {why}") from error


def found(word: str, folder: str, path: str) -> str:
    """Return the file that the first word of a command means: relative to `folder`, else by PATH; "" if none."""
    if "/" in word:
        return os.path.join(folder, word.removeprefix("./"))
    files = (os.path.join(folder, place, word) for place in path.split(os.pathsep))
    return next((file for file in files if os.path.isfile(file) and os.access(file, os.X_OK)), "")


def obstacle(word: str, folder: str, path: str) -> str:
    """Return why a program cannot be run on this machine, "" if it seems that it can."""
    if not os.path.isdir(folder):
        return f"there is no folder {folder}"
    file = found(word, folder, path)
    if not file:
        return f"there is no executable '{word}' in PATH"
    if os.path.isdir(file):
        return f"{file} is a folder"
    if not os.path.exists(file):
        return f"there is no file {file}"
    if not os.access(file, os.X_OK):
        return f"{file} is not executable"
    return _obstacle_in(file)


def _obstacle_in(file: str) -> str:
    """Return why Linux cannot run an executable by what it begins with: the name of an interpreter, or a binary."""
    try:
        with open(file, "rb") as script:
            start = script.read(256)
    except OSError:
        return ""  # it may be run, but not read
    if start.startswith(_ELF):
        return _obstacle_in_binary(file, start)
    words = start[2:].partition(b"\n")[0].replace(b"\t", b" ").strip(b" ").split(b" ")  # a CR belongs to a word
    interpreter = os.fsdecode(words[0]) if start.startswith(b"#!") else ""
    if not interpreter:
        return "" if b"\0" in start else f"{file}: the first line of a script names what runs it: '#!/bin/sh'"
    name = words[-1] if len(words) == 2 and interpreter.endswith("/env") else words[0]
    if name.endswith(b"\r"):
        return f"the lines of {file} end with CR LF; Linux needs LF alone"
    return f"{file} is to be run by {interpreter}, which is not there" if not os.path.exists(interpreter) else ""


def _obstacle_in_binary(file: str, start: bytes) -> str:
    """Return why this machine cannot run a binary with this header, by that of the Python which runs here."""
    if len(start) < _MACHINE.stop:
        return f"{file} is cut off: it begins as a binary, and ends within its header"
    with open("/proc/self/exe", "rb") as python:
        own = python.read(_MACHINE.stop)
    is_alike = start[_CLASS] == own[_CLASS]  # a machine of 64 bit may also run what is for its ancestor of 32 bit
    if not is_alike or start[_MACHINE] == own[_MACHINE]:
        return ""
    emulators = os.listdir(_EMULATORS) if os.path.isdir(_EMULATORS) else []
    is_emulated = any(name.startswith("qemu") for name in emulators)
    return "" if is_emulated else f"{file} is built for another kind of processor"


def keep(wanted: ProgramOrder, child: int, ended: int, report: Report) -> None:
    """Wait for the end of the program, ask for it when told to, and end what it leaves behind.

    All that it has started is asked with it, and has the same time.
    """
    status, deadline = None, math.inf
    is_asked = is_deaf = is_orphan = False
    while status is None or (is_asked and not is_deaf and _children()):
        pause = None if deadline == math.inf else max(0.0, deadline - time.monotonic())
        ready, _, _ = select.select([ended, *(() if is_orphan else (0,))], [], [], pause)
        if ended in ready:
            os.read(ended, 4096)
        status = _reaped(child, status)
        if 0 in ready:
            is_orphan = not os.read(0, 64)
            if not is_asked:
                _signal_group(child, wanted["signal"])
            patience = min(wanted["patience"], _ORPHANED) if is_orphan else wanted["patience"]
            is_asked, deadline = True, min(deadline, time.monotonic() + patience)
        if time.monotonic() >= deadline:
            if not is_deaf:
                report("deaf")
            is_deaf, deadline = True, time.monotonic() + _AT_ONCE
            _signal_group(child, signal.SIGKILL)
    report("ended", status)
    left = _end_all()
    if left and not is_deaf:
        report("left", left)


def _reaped(child: int, status: int | None) -> int | None:
    """Collect the children that have ended; return the wait status of `child` if it is one of them, else `status`."""
    while True:
        try:
            pid, how = os.waitpid(-1, os.WNOHANG)
        except ChildProcessError:
            return status
        if pid == 0:
            return status
        if pid == child:
            status = how


def _children() -> set[int]:
    """Return what has been started by the program and not ended; all of it comes to this process sooner or later."""
    with open(f"/proc/self/task/{os.getpid()}/children", encoding="ascii") as file:
        return {int(text) for text in file.read().split()}


def _signal_group(child: int, number: int) -> None:
    try:
        os.killpg(child, number)
    except (ProcessLookupError, PermissionError):
        return  # it ends just now, or has become somebody else's


def _end_all() -> int:
    """Kill what is left of the program, and what that leaves; return how many processes that were."""
    killed: set[int] = set()
    deadline = time.monotonic() + _AT_ONCE
    while time.monotonic() < deadline:
        _reaped(0, None)
        left = _children()
        if not left:
            break
        for pid in left:
            try:
                os.kill(pid, signal.SIGKILL)
            except PermissionError:
                continue  # it has become somebody else's
        killed |= left
        time.sleep(0.005)  # what a killed process has forked comes here when it is gone
    return len(killed)


def clean_up(wanted: ProgramOrder) -> None:
    """Run the command that ends what runs elsewhere on behalf of the program, such as its container."""
    command = wanted["cleanup"]
    if not command:
        return
    null = [(os.POSIX_SPAWN_OPEN, number, os.devnull, os.O_RDWR, 0) for number in (0, 1, 2)]
    try:
        os.posix_spawn(command[0], command, wanted["environment"], file_actions=null, setsigdef=_TAKEN)
    except OSError:
        return  # it is not there any more
    deadline = time.monotonic() + _CLEANS_UP
    while _children() and time.monotonic() < deadline:
        _reaped(0, None)
        time.sleep(0.005)
    _end_all()


if __name__ == "__main__":
    main()
