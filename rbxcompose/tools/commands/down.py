"""Stop a robot and end all of its processes, also those that a dead supervisor has left."""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING

from rbxcompose.base.levels import Level
from rbxcompose.commands.console import NotDoneError, emit
from rbxcompose.commands.lookup import NO_ANSWER, NOT_UP, add_addressed_robot, answer_soon, awaited_robot, known_state
from rbxcompose.commands.options import EACH
from rbxcompose.runtime.control import supervisor_of
from rbxcompose.runtime.folder import RobotFolder, RobotState
from rbxcompose.runtime.log import NAME, Follower
from rbxcompose.runtime.processes import Process, wait_until_ended
from rbxcompose.runtime.requests import BringDown
from rbxcompose.runtime.supervision.leftovers import end_leftovers, kill_supervisor

if TYPE_CHECKING:  # only needed for systems
    from rbxcompose.commands.hosts import SystemCommand

GROUP = "run"
IS_COMMON = True
ON_SYSTEM = EACH
_ANSWER = 1.0  # [s]
_ORDERLY = 3.0  # [s] for a supervisor to bring everything down, after it has come to rest


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_addressed_robot(parser)
    parser.add_argument("--json", action="store_true", help="answer in JSON")


def run(arguments: argparse.Namespace) -> int:
    """End the robot: orderly if its supervisor answers, else by force."""
    folder = awaited_robot(arguments.robot or arguments.path)
    log = Follower(folder.path / NAME)
    try:
        log.read()  # what came before is no matter of its end
        report = _end(folder)
        report += [f"{record.source}: {record.text}" for record in log.read() if record.level is Level.ERROR]
    finally:
        log.close()
    if arguments.json:
        emit(json.dumps({"robot": folder.path.name, "told": report}))
        return 0
    for text in report:
        emit(text)
    emit(f"{folder.path.name} is down")
    return 0


def run_on_system(command: SystemCommand) -> int:
    """End robots of a system; the end on one host may end a robot on the others before they do."""
    from rbxcompose.commands.hosts import remember

    if (exit_code := command.ask(tolerates=NOT_UP.code)) == 0:
        remember(command.path, {}, gone=command.shares)
    return exit_code


def _end(folder: RobotFolder) -> list[str]:
    """End the robot and return a report for people.

    Raises:
        NotDoneError: if someone else holds the robot and cannot be found.
    """
    report: list[str] = []
    state = known_state(folder)
    patience = _ORDERLY + (state.rest_time if state is not None else 1.0)
    if (supervisor := _supervisor(folder, state)) is not None:
        if not supervisor.is_stopped and _asked(folder) and not wait_until_ended([supervisor], patience):
            return report
        report.append("the supervisor did not answer and was killed")
        kill_supervisor(supervisor)
    lock = folder.lock()
    if lock is None:
        raise NotDoneError(NO_ANSWER.at(None, f"'{folder.path.name}' is held by a process that cannot be found"))
    report += end_leftovers(folder)
    folder.clear()
    return report


def _supervisor(folder: RobotFolder, state: RobotState | None) -> Process | None:
    return state.supervisor if state is not None and state.is_supervised else supervisor_of(folder)


def _asked(folder: RobotFolder) -> bool:
    try:
        answer_soon(folder, BringDown(), _ANSWER)
    except NotDoneError:
        return False
    return True
