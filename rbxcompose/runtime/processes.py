"""Processes of this machine, identified so that a reused process id cannot fool us."""

from __future__ import annotations

import ctypes
import os
import select
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from rbxcompose.base.dataclass import dataclass

_PR_SET_CHILD_SUBREAPER = 36
_M_MMAP_THRESHOLD = -3  # of mallopt(3)
_LARGE = 1 << 20  # [B]
_LIBC = ctypes.CDLL(None, use_errno=True)
_STATE, _USER_TIME, _SYSTEM_TIME, _START_TIME, _RESIDENT = 0, 11, 12, 19, 21
"""Fields of /proc/<pid>/stat, counted after the last bracket."""
_MOST_STAT = 4096  # [B]
_TICK, _PAGE = os.sysconf("SC_CLK_TCK"), os.sysconf("SC_PAGE_SIZE")  # [1/s], [B]


@dataclass(frozen=True, slots=True)
class Process:
    """A process: its id and its start time [clock ticks since boot], which together are never used twice."""

    pid: int
    started: int

    @classmethod
    def of(cls, pid: int) -> Process:
        """Return the process that has this id now.

        Raises:
            ProcessLookupError: if there is none.
        """
        fields = _stat(pid)
        if fields is None:
            raise ProcessLookupError(f"there is no process {pid}")
        return cls(pid, int(fields[_START_TIME]))

    @property
    def is_running(self) -> bool:
        """Return whether it still exists and has not ended."""
        return self._state() not in ("", "Z", "X")

    @property
    def is_stopped(self) -> bool:
        """Return whether a signal has suspended it, so that it reacts to no other signal but SIGKILL."""
        return self._state() in ("T", "t")

    def is_titled(self, prefix: str) -> bool:
        """Return whether it is a process of this user whose title starts with `prefix`."""
        folder = Path(f"/proc/{self.pid}")
        try:
            return folder.stat().st_uid == os.getuid() and folder.joinpath("cmdline").read_bytes().startswith(
                prefix.encode()
            )
        except (OSError, ValueError):  # it has ended
            return False

    def holds_file_of(self, folder: Path) -> bool:
        """Return whether it has a file open that is in `folder`, or was before it was removed."""
        try:
            return any(os.readlink(path).startswith(f"{folder}/") for path in Path(f"/proc/{self.pid}/fd").iterdir())
        except OSError:  # it has ended, or has closed one meanwhile
            return False

    @property
    def usage(self) -> tuple[float, int] | None:
        """Return its processor time so far [s] and its memory [B]; None if it has ended."""
        fields = _stat(self.pid)
        if fields is None or int(fields[_START_TIME]) != self.started:
            return None
        return (int(fields[_USER_TIME]) + int(fields[_SYSTEM_TIME])) / _TICK, int(fields[_RESIDENT]) * _PAGE

    def open(self) -> int | None:
        """Return a pidfd for it, or None if it has ended. The caller closes it."""
        try:
            descriptor = os.pidfd_open(self.pid)
        except ProcessLookupError:
            return None
        if self.is_running:  # read after opening: from here on the id cannot be reused unnoticed
            return descriptor
        os.close(descriptor)
        return None

    def send_signal(self, number: signal.Signals) -> bool:
        """Send a signal to it and to no other process; return whether it existed."""
        descriptor = self.open()
        if descriptor is None:
            return False
        try:
            return signal_descriptor(descriptor, number)
        finally:
            os.close(descriptor)

    def _state(self) -> str:
        fields = _stat(self.pid)
        return fields[_STATE] if fields is not None and int(fields[_START_TIME]) == self.started else ""


def _stat(pid: int) -> list[str] | None:
    # A supervisor reads it often, and a `Path` takes three times as many system calls.
    try:
        descriptor = os.open(f"/proc/{pid}/stat", os.O_RDONLY | os.O_CLOEXEC)
    except (FileNotFoundError, ProcessLookupError):
        return None
    try:
        text = os.read(descriptor, _MOST_STAT)
    except ProcessLookupError:
        return None
    finally:
        os.close(descriptor)
    return text.rpartition(b")")[2].decode("ascii").split()


def waits_of(pid: int) -> dict[str, float]:
    """Return for how long each thread of a process has been ready to run but waited for a processor [s], by its id.

    Nothing, if the process has ended or the kernel does not count it.
    """
    waits = {}
    try:
        for thread in os.listdir(f"/proc/{pid}/task"):
            with suppress(FileNotFoundError, ProcessLookupError), open(f"/proc/{pid}/task/{thread}/schedstat") as file:
                waits[thread] = int(file.read().split()[1]) * 1e-9
    except (FileNotFoundError, ProcessLookupError):
        return {}
    return waits


def longest_wait(before: Mapping[str, float], after: Mapping[str, float]) -> float:
    """Return for how long a thread has waited for a processor between two answers of `waits_of` [s], at most."""
    return max((wait - before.get(thread, 0.0) for thread, wait in after.items()), default=0.0)


def signal_descriptor(descriptor: int, number: signal.Signals) -> bool:
    """Send a signal through a pidfd; return whether the process existed."""
    try:
        signal.pidfd_send_signal(descriptor, number)
    except ProcessLookupError:
        return False
    return True


def wait_until_ended(processes: Sequence[Process], seconds: float) -> list[Process]:
    """Wait until all have ended, at most `seconds` of real time, and return those that have not."""
    deadline = time.monotonic() + seconds
    for process in processes:
        descriptor = process.open()
        if descriptor is None:
            continue
        try:
            select.select([descriptor], [], [], max(0.0, deadline - time.monotonic()))
        finally:
            os.close(descriptor)
    return [process for process in processes if process.is_running]


def adopt_orphans() -> None:
    """Become the parent of descendants whose own parent ends, so that they can be waited for."""
    if _LIBC.prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "prctl(PR_SET_CHILD_SUBREAPER) failed")


def give_back_large_memory() -> None:
    """Return freed memory of large messages to the system, now and in all forked processes.

    Else the C library considers the size of the last freed block usual, and keeps that much.
    """
    _LIBC.mallopt(_M_MMAP_THRESHOLD, _LARGE)


def give_back_free_memory() -> None:
    """Return to the system what the C library has of freed memory: all that was needed only to get started."""
    _LIBC.malloc_trim(0)


def boot_id() -> str:
    """Return an id that differs between boots of this machine."""
    return Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()


def titled(prefix: str) -> Iterator[Process]:
    """Yield the processes of this user whose title starts with `prefix`."""
    for number in (folder.name for folder in Path("/proc").iterdir() if folder.name.isdigit()):
        with suppress(ProcessLookupError):  # it ended while we looked
            process = Process.of(int(number))
            if process.is_titled(prefix):
                yield process


KILLED = f"was killed by {signal.SIGKILL.name}"
"""How a process ended that was killed, by whomever."""


def describe_exit(status: int) -> str:
    """Return in words how a process ended, from its wait status."""
    code = os.waitstatus_to_exitcode(status)
    return f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with status {code}"


def close_all(keep: Sequence[int]) -> None:
    """Close all descriptors but the standard ones and `keep`: a lock held by mistake would be held for ever."""
    lowest = 3
    for descriptor in sorted(set(keep)):
        os.closerange(lowest, descriptor)
        lowest = descriptor + 1
    os.closerange(lowest, os.sysconf("SC_OPEN_MAX"))


def in_child(main: Callable[[], None]) -> None:
    """Run `main` in a process that was just forked and end it there, bypassing all that the parent has registered."""
    status = 1
    try:
        main()
        status = 0
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
