"""Ending the processes that a dead or unresponsive supervisor has left behind; apart from what starts one."""

import os
import signal
from collections.abc import Sequence

from rbxcompose.bus import shared_memory
from rbxcompose.runtime.folder import BrokenStateError, RobotFolder, title
from rbxcompose.runtime.processes import Process, titled, wait_until_ended

ORDERLY = 2.5  # [s] for process groups to come to rest and end by themselves
AT_ONCE = 1.0  # [s] for the kernel to end what was killed


def end_leftovers(folder: RobotFolder) -> list[str]:
    """End the processes of a robot whose supervisor is gone and return what a person should know about it.

    The kernel has signalled them to stop; those that still respond get the time for it.
    """
    warnings: list[str] = []
    try:
        state = folder.read_state()
    except BrokenStateError as error:
        warnings.append(
            f"the state of '{folder.path.name}' cannot be read ({error}); its processes were found by title"
        )
        state = None
    found = dict(state.alive()) if state else _found_by_title(folder)
    stopped = [process for process in found.values() if process.is_stopped]
    _kill(stopped)
    left = wait_until_ended(list(found.values()), ORDERLY)
    _kill(left)
    wait_until_ended(left, AT_ONCE)
    shared_memory.remove_orphans()
    killed = [name for name, process in found.items() if process in (*stopped, *left)]
    if killed:
        warnings.append(f"processes left behind were killed: {', '.join(sorted(killed))}")
    return warnings


def _found_by_title(folder: RobotFolder) -> dict[str, Process]:
    """Return the processes that are titled as ones of this robot and have its log open."""
    return {
        str(process.pid): process
        for process in titled(title(folder.path.name))
        if process.pid != os.getpid() and process.holds_file_of(folder.path)
    }


def kill_supervisor(supervisor: Process) -> None:
    """End a supervisor that does not answer; the kernel then signals its process groups to stop."""
    _kill([supervisor])
    wait_until_ended([supervisor], AT_ONCE)


def _kill(processes: Sequence[Process]) -> None:
    for process in processes:
        process.send_signal(signal.SIGKILL)
