"""Fences around processes that evaluate strangers' texts, the questions to these, and processes that end with ours."""

import ctypes
import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import rbxcompose

SECONDS = 1.2  # of processor time; with the rest of `check`, a file that never ends is told within 2 s
STARTS = 12  # on a slow machine, as much processor time as so many starts of this process,
MOST_SECONDS = 4.0  # but no more than this
MEMORY = 140_000_000  # [bytes] of address space beyond what it has at its start
ANSWER = 20_000_000  # [bytes] that it may write in all, to files that are open already
_HARMLESS = {"compile", "exec", "glob.glob", "glob.glob/2", "builtins.id"}
_LISTS = ("os.listdir", "os.scandir")
_PR_SET_PDEATHSIG = 1
_PR_SET_NO_NEW_PRIVS = 38
_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446  # numbers of Landlock's system calls
_READ_FILE, _READ_FOLDER, _FILE_RIGHTS, _TRUNCATE = 1 << 2, 1 << 3, (1 << 13) - 1, 1 << 14
_NEW_USER, _NEW_NET = 0x10000000, 0x40000000
_LIBC = ctypes.CDLL(None, use_errno=True)
_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND


def is_below(path: str, roots: Iterable[str]) -> bool:
    """Return whether a real path is one of the roots or lies below one."""
    return any(os.path.commonpath([path, root]) == root for root in roots)


def processor_time() -> float:
    """Return the processor time that this process has taken [s]."""
    return time.process_time()


def fence(
    roots: Iterable[str], used: set[str], start: float, what: str = "a description", also: Iterable[str] = ()
) -> None:
    """Limit what this process can use from now on, and refuse whatever Python reports that is not needed.

    The files and folders that it reads, or tries to read, are added to `used`. `start` is the processor time [s] that
    the start of such a process takes here. `what` names the stranger's text in errors, which may cause the events that
    `also` names as well.
    """
    real = tuple(os.path.realpath(root) for root in roots)
    harmless = frozenset((*_HARMLESS, *also))
    if _LIBC.unshare(_NEW_NET):
        _LIBC.unshare(_NEW_USER | _NEW_NET)  # where users may; then there is no network, whatever Python reports
    _limit(start)
    _confine(real)

    def audit(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            if not _may_open(arguments[0], arguments[2], real):
                raise PermissionError(f"{what} may only read files of its project, not {arguments[0]!r}")
        elif event in _LISTS:
            if not _may_open(arguments[0], os.O_RDONLY, real):
                raise PermissionError(f"{what} may only list folders of its project, not {arguments[0]!r}")
        elif event not in harmless:
            raise PermissionError(f"{what} may not use {event}")
        else:
            return
        if isinstance(arguments[0], str | bytes):
            used.add(os.path.realpath(os.fsdecode(arguments[0])))

    sys.addaudithook(audit)


def _limit(start: float) -> None:
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    most = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    seconds = min(max(SECONDS, STARTS * start), MOST_SECONDS)
    signal.setitimer(signal.ITIMER_PROF, seconds)  # ends the process
    last = int(time.process_time() + seconds) + 1  # if it resets the timer
    resource.setrlimit(resource.RLIMIT_CPU, (last, last))
    resource.setrlimit(resource.RLIMIT_FSIZE, (ANSWER, ANSWER))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_NOFILE, (64, 64))
    resource.setrlimit(resource.RLIMIT_NPROC, (0, 0))  # which root has no limit of


class _PathBeneath(ctypes.Structure):
    """What Landlock allows below an open folder."""

    _pack_, _layout_ = 1, "ms"  # as the C compiler lays it out: nothing between the fields
    _fields_ = (("allowed", ctypes.c_uint64), ("folder", ctypes.c_int32))


def _confine(roots: Iterable[str]) -> None:
    """Have the kernel refuse this process all files but reading below the roots, where it has Landlock.

    It does so even if a stranger's code gets around what Python reports.
    """
    version = _LIBC.syscall(_CREATE_RULESET, None, 0, 1)
    handled = ctypes.c_uint64(_FILE_RIGHTS | (_TRUNCATE if version >= 3 else 0))
    if version < 1 or (rules := _LIBC.syscall(_CREATE_RULESET, ctypes.byref(handled), 8, 0)) < 0:
        return
    for root in roots:
        with suppress(OSError):  # which may not be there
            folder = os.open(root, os.O_PATH | os.O_CLOEXEC)
            below = _PathBeneath(_READ_FILE | (_READ_FOLDER if os.path.isdir(root) else 0), folder)
            _LIBC.syscall(_ADD_RULE, rules, 1, ctypes.byref(below), 0)
            os.close(folder)
    _LIBC.prctl(_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0)
    _LIBC.syscall(_RESTRICT_SELF, rules, 0)
    os.close(rules)


def _may_open(file: object, flags: int, roots: Iterable[str]) -> bool:
    if isinstance(file, int):  # it is open already
        return True
    return (
        isinstance(file, str | bytes) and not flags & _WRITES and is_below(os.path.realpath(os.fsdecode(file)), roots)
    )


def end_with(parent: int, number: signal.Signals) -> None:
    """Have the kernel send `number` to this process when its parent ends; end now if the parent has already ended.

    Call it in a child of the main thread: for the kernel, the parent is the thread that forked.
    """
    if _LIBC.prctl(_PR_SET_PDEATHSIG, int(number), 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "prctl(PR_SET_PDEATHSIG) failed")
    if os.getppid() != parent:
        os._exit(0)


LONGEST_ANSWER = 12.0  # [s] of real time, on a busy machine; the processes limit their processor time themselves
_RUN = "import sys; sys.path.insert(0, sys.argv[1]); from {} import main; main()"


def fenced_answers(
    module: str, requests: Sequence[str], environment: Mapping[str, str] | None = None, deadline: float = LONGEST_ANSWER
) -> list[bytes]:
    """Return what `main` of a module answers to each request, which is JSON; empty where it kept to no limit."""
    package = str(Path(rbxcompose.__file__).parents[1])
    with subprocess.Popen(
        [sys.executable, "-I", "-B", "-c", _RUN.format(module), package],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=dict(environment or {}),
        start_new_session=True,
    ) as process:
        try:
            output, _ = process.communicate(f"[{','.join(requests)}]".encode(), timeout=deadline)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            output = b""
    written = list(_split(output))
    return written if len(written) == len(requests) else [b""] * len(requests)


def _split(output: bytes) -> Iterator[bytes]:
    """Yield the answers, each of which follows its length."""
    while output:
        end = 8 + int.from_bytes(output[:8], "little")
        yield output[8:end]
        output = output[end:]


def answer_all(answer: Callable[[dict[str, Any], float], Any]) -> None:
    """Answer requests, each in a process of its own: the length in 8 bytes and the answer, or 0 if there is none.

    `answer` gets a request and the processor time [s] that a start takes, builds the fence, and returns plain data.
    """
    start = processor_time()
    answers = [_begun(answer, request, start) for request in json.load(sys.stdin)]
    for process, file in answers:
        _, status = os.waitpid(process, 0)
        written = os.pread(file, os.fstat(file).st_size, 0) if status == 0 else b""
        sys.stdout.buffer.write(len(written).to_bytes(8, "little") + written)
    sys.stdout.buffer.flush()


def _begun(answer: Callable[[dict[str, Any], float], Any], request: dict[str, Any], start: float) -> tuple[int, int]:
    """Return the process that answers a request, and the file that it writes the answer to."""
    file = os.memfd_create("answer")  # a file, since its size can be limited
    process = os.fork()
    if process == 0:
        os.closerange(3, file)  # those of other requests
        for standard in (0, 1, 2):
            os.dup2(os.open(os.devnull, os.O_RDWR), standard)
        written = json.dumps(answer(request, start), ensure_ascii=False).encode(errors="replace")
        os._exit(0 if os.write(file, written) == len(written) else 1)
    return process, file
