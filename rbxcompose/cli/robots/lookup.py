"""Find the robot that a command addresses: by `--robot NAME`, by its name or file, or the only running one."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable
from contextlib import suppress
from typing import TypeVar

from rbxcompose.findings import Finding, kind, suggest
from rbxcompose.requests import Refused, Request
from rbxcompose.runtime.control import ANSWER, NoAnswerError, ask
from rbxcompose.runtime.folder import BrokenStateError, RobotFolder, RobotState, UnsafeFolderError, all_folders
from rbxcompose.runtime.requests import RobotStatus

A = TypeVar("A")

ALREADY_UP = kind("RBX9001")
NOT_UP = kind("RBX9002")
WHICH = kind("RBX9003")
REFUSED = kind("RBX9004")
NO_ANSWER = kind("RBX9005")
UNSAFE = kind("RBX9006")


class NotDoneError(Exception):
    """Raised with the finding when it is unclear which robot is addressed, or none is up."""

    def __init__(self, finding: Finding) -> None:
        super().__init__(finding.message)
        self.finding = finding


def add_robot_option(parser: argparse.ArgumentParser) -> None:
    """Declare `--robot NAME`."""
    parser.add_argument("--robot", metavar="NAME", help="the robot, if several are up")


def find_robot(wanted: str | None) -> RobotFolder:
    """Return the folder of the robot with a given name or path, or of the only one.

    Raises:
        NotDoneError: if there is none or more than one.
    """
    found = {folder.path.name: folder for folder in robots_up()}
    if wanted is None:
        return _only(found)
    if wanted in found:
        return found[wanted]
    files = {_file_of(folder): folder for folder in found.values()}
    for path in _possible_files(wanted):
        if path in files:
            return files[path]
    raise NotDoneError(NOT_UP.at(None, f"no robot '{wanted}' is up", help=suggest(wanted, found, "robots that are up")))


def robots_up() -> list[RobotFolder]:
    """Return the folders of all robots that are up or were left behind.

    Raises:
        NotDoneError: if another user could have put something there.
    """
    try:
        return all_folders()
    except UnsafeFolderError as error:
        raise NotDoneError(UNSAFE.at(None, str(error))) from error


def _only(found: dict[str, RobotFolder]) -> RobotFolder:
    if not found:
        raise NotDoneError(NOT_UP.at(None, "no robot is up", help="start one with 'rbxcompose up PATH'"))
    if len(found) > 1:
        names = ", ".join(found)
        raise NotDoneError(WHICH.at(None, f"several robots are up: {names}", help="name one with '--robot NAME'"))
    return next(iter(found.values()))


def _file_of(folder: RobotFolder) -> str:
    state = known_state(folder)
    return state.file if state else ""


def _possible_files(path: str) -> Iterable[str]:
    yield os.path.realpath(path)
    yield os.path.realpath(os.path.join(path, "robot.yaml"))


def known_state(folder: RobotFolder) -> RobotState | None:
    """Return the state from the robot's folder or, if that file is gone or broken, from its supervisor; else None."""
    with suppress(BrokenStateError):
        if (state := folder.read_state()) is not None:
            return state
    try:
        return ask(folder, RobotStatus())
    except (NoAnswerError, Refused):
        return None


def answer_of(folder: RobotFolder, request: Request[A], *, timeout: float = ANSWER) -> A:
    """Return a robot's answer to a request, which may take `timeout` [s].

    Raises:
        NotDoneError: if it refuses or does not answer.
    """
    name = folder.path.name
    try:
        return ask(folder, request, timeout=timeout)
    except Refused as refusal:
        raise NotDoneError(REFUSED.at(None, f"'{name}' refuses: {refusal}")) from refusal
    except NoAnswerError as error:
        raise NotDoneError(no_answer(folder)) from error


def no_answer(folder: RobotFolder) -> Finding:
    """Return the finding that a robot does not answer, with the reason if its state has one."""
    name, state = folder.path.name, known_state(folder)
    why = ""
    if state is not None and not state.is_supervised:
        why = ": its supervisor has died, so it brakes and ends"
    elif state is not None and state.supervisor.is_stopped:
        why = ": its supervisor is suspended"
    return NO_ANSWER.at(
        None, f"'{name}' does not answer{why}", help=f"'rbxcompose down {name}' ends what is left of it"
    )
