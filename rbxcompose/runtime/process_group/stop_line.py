"""A second path for `stop`, past the supervisor: a query here makes this process hold everything that moves.

A supervisor that is suspended by a signal, or waits for a disk, answers nobody while the robot drives on.
"""

from __future__ import annotations

from collections.abc import Callable

from rbxcompose.bus.names import admin_key
from rbxcompose.bus.transport import Closable, Question, Transport

PATH = "stop"  # below the robot's own keys; a process adds its name


def stop_key(robot: str, process: str = "*") -> str:
    """Return the Zenoh key of the stop query of a process; without a name, that of all processes."""
    return admin_key(robot, f"{PATH}/{process}")


def open_stop_line(
    transport: Transport,
    robot: str,
    process: str,
    stop: Callable[[], None],
    post: Callable[[str, Callable[[], None]], None],
) -> Closable:
    """Call `stop` in the scheduler's thread for each query, and answer with the name of the process."""

    def asked(question: Question) -> None:
        def carry_out() -> None:
            stop()
            question.reply(process.encode(), b"")

        post("", carry_out)

    return transport.serve(stop_key(robot, process), asked)
