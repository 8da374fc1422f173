"""A second way for `stop`, past the supervisor: whoever asks here has this process hold everything that moves.

A supervisor that a signal suspended, or that waits for a disk, answers nobody while the robot drives on.
"""

from __future__ import annotations

from collections.abc import Callable

from rbxcompose.bus.names import admin_key
from rbxcompose.bus.transport import Closable, Question, Transport

PATH = "stop"  # below the robot's own keys; a process adds its name


def stop_key(robot: str, process: str = "*") -> str:
    """Return the Zenoh key at which a process is asked to stop; without its name, those of all."""
    return admin_key(robot, f"{PATH}/{process}")


def open_stop_line(
    transport: Transport,
    robot: str,
    process: str,
    stop: Callable[[], None],
    post: Callable[[str, Callable[[], None]], None],
) -> Closable:
    """Have `stop` called by the scheduler's thread for each question, and answer with the name of the process."""

    def asked(question: Question) -> None:
        def carry_out() -> None:
            stop()
            question.reply(process.encode(), b"")

        post("", carry_out)

    return transport.serve(stop_key(robot, process), asked)
