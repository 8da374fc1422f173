"""Find the robot that a command addresses, or its bus; ask it, and show its answer."""

import argparse
import json
import math
import os
import sys
import time
from contextlib import suppress
from typing import TypeVar

from rbxcompose import __version__
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, kind, suggest
from rbxcompose.base.requests import Command, Refused, Request
from rbxcompose.commands.console import NotDoneError, emit
from rbxcompose.commands.options import add_system_options, system_and_robot
from rbxcompose.runtime.control import ANSWER, NoAnswerError, ask
from rbxcompose.runtime.folder import (
    BrokenStateError,
    RobotFolder,
    RobotState,
    UnsafeFolderError,
    all_folders,
    is_starting,
)
from rbxcompose.runtime.log import write_problem
from rbxcompose.runtime.requests import RobotStatus

A = TypeVar("A")
ALREADY_UP = kind("RBX9001")
NOT_UP = kind("RBX9002")
WHICH = kind("RBX9003")
REFUSED = kind("RBX9004")
NO_ANSWER = kind("RBX9005")
UNSAFE = kind("RBX9006")
_LOOK = 0.05  # [s] between looks for a robot that is about to come up
_ADDRESSED = "the robot, by name or file; or a system"
NO_SUPERVISOR = "its supervisor has died"


def add_robot_option(parser: argparse.ArgumentParser) -> None:
    """Declare `--robot NAME`."""
    parser.add_argument("--robot", metavar="NAME", help="the robot, if several are up")


def add_addressed_robot(parser: argparse.ArgumentParser, words: str = _ADDRESSED) -> None:
    """Declare the robot as an argument, or as `--robot NAME`, either of which may be left out."""
    parser.add_argument("path", nargs="?", metavar="ROBOT|PATH", help=words)
    add_robot_option(parser)
    add_system_options(parser)


def add_robot_argument(parser: argparse.ArgumentParser) -> None:
    """Declare the robot as the only argument, for what is typed in a hurry; `--robot` says the same."""
    parser.add_argument("robot", nargs="?", default=argparse.SUPPRESS, metavar="ROBOT|PATH", help=_ADDRESSED)


def find_robot(wanted: str | None) -> RobotFolder:
    """Return the folder of the robot with a given name or path, or of the only one; `SYSTEM:NAME` is a name, too.

    Raises:
        NotDoneError: if there is none or more than one.
    """
    found = {folder.path.name: folder for folder in robots_up()}
    if wanted is None:
        if not found:
            raise NotDoneError(NOT_UP.at(None, "no robot is up", help="start one with 'rbxcompose up PATH'"))
        if len(found) > 1:
            names = ", ".join(found)
            raise NotDoneError(WHICH.at(None, f"several robots are up: {names}", help="name one with '--robot NAME'"))
        return next(iter(found.values()))
    if wanted in found:
        return found[wanted]
    files = {state.file: folder for folder in found.values() if (state := known_state(folder)) is not None}
    for path in map(os.path.realpath, (wanted, os.path.join(wanted, "robot.yaml"))):
        if path in files:
            return files[path]
    system, robot = system_and_robot(wanted) or ("", wanted)
    if robot in found:
        return found[robot]
    if not robot:
        message = f"'{system}' is a system, and this command is for one robot, which is up on this machine"
        raise NotDoneError(WHICH.at(None, message, help=f"name it with '--robot {system}:NAME'"))
    where = " on this machine" if system else ""
    if wanted.endswith((".yaml", ".yml")) and not wanted.startswith("rbx:") and not os.path.exists(wanted):
        where = ", and there is no such file"
    help_text = suggest(robot, found, "robots that are up")
    raise NotDoneError(NOT_UP.at(None, f"no robot '{robot}' is up{where}", help=help_text))


def awaited_robot(wanted: str | None) -> RobotFolder:
    """Find a robot as `find_robot` does, or once its `up` has begun: who reads that none is up may come near."""
    is_reported, last = False, math.inf  # the last look [s, monotonic] for the state of a robot that is there
    while True:
        may_come = is_starting()
        try:
            folder = find_robot(wanted)
            last = min(last, time.monotonic() + ANSWER)
            if known_state(folder) is not None or not may_come or time.monotonic() > last:
                return folder
        except NotDoneError as error:
            if error.finding.code != NOT_UP.code or not may_come:
                raise
            if not is_reported:
                sys.stderr.write(f"{error.finding.message}, but an 'up' is on its way: waits for it\n")
            is_reported = True
        time.sleep(_LOOK)


def robots_up() -> list[RobotFolder]:
    """Return the folders of all robots that are up or were left behind.

    Raises:
        NotDoneError: if another user could have put something there.
    """
    try:
        return all_folders()
    except UnsafeFolderError as error:
        raise NotDoneError(UNSAFE.at(None, str(error))) from error


def known_state(folder: RobotFolder) -> RobotState | None:
    """Return the state from the robot's folder or, if that file is gone or broken, from its supervisor; else None."""
    with suppress(BrokenStateError):
        if (state := folder.read_state()) is not None:
            return state
    try:
        return ask(folder, RobotStatus())
    except (NoAnswerError, Refused):
        return None


def warn_of_lost_log(folder: RobotFolder) -> None:
    """Write to stderr why what a robot logs is lost, if it is."""
    if problem := write_problem(folder.path):
        sys.stderr.write(f"the log of '{folder.path.name}' cannot be written: {problem}\n")


def version_problem(robot: str, version: str) -> str:
    """Return that a robot's supervisor runs another version than the one that is installed, or nothing."""
    if version == __version__:
        return ""
    return f"'{robot}' runs rbxcompose {version}, and {__version__} is installed: 'down', then 'up', starts that"


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


def answer_soon(folder: RobotFolder, request: Request[A], patience: float) -> A:
    """Ask a robot that may have just begun, and will soon listen, again for some time [s].

    Raises:
        NotDoneError: if it still refuses or does not answer.
    """
    deadline = time.monotonic() + patience
    while True:
        try:
            return answer_of(folder, request, timeout=patience)
        except NotDoneError:
            if time.monotonic() > deadline:
                raise
        time.sleep(_LOOK)


def no_answer(folder: RobotFolder) -> Finding:
    """Return the finding that a robot does not answer, with the reason if its state has one."""
    name, state = folder.path.name, known_state(folder)
    why = ""
    if state is not None and not state.is_supervised:
        why = f": {NO_SUPERVISOR}, so it brakes and ends"
    elif state is not None and state.supervisor.is_stopped:
        why = ": its supervisor is suspended"
    return NO_ANSWER.at(
        None, f"'{name}' does not answer{why}", help=f"'rbxcompose down {name}' ends what is left of it"
    )


@dataclass(frozen=True, slots=True)
class BusPlace:
    """A Zenoh endpoint (`tcp/127.0.0.1:7447`) and a ROS domain."""

    router: str
    domain: int = 0


def add_bus_options(parser: argparse.ArgumentParser) -> None:
    """Declare `--robot NAME`, `--router ENDPOINT` and `--domain N`."""
    add_robot_option(parser)
    parser.add_argument("--router", metavar="ENDPOINT", help="another bus, by its Zenoh router: tcp/192.168.1.7:7447")
    parser.add_argument("--domain", type=int, metavar="N", help="the ROS domain (default: that of the robot, or 0)")


def find_place(arguments: argparse.Namespace) -> BusPlace:
    """Return the place that the options name.

    Raises:
        NotDoneError: if no robot is found, or it has no router.
    """
    if arguments.router is not None:
        return BusPlace(arguments.router, arguments.domain or 0)
    found = place_of(find_robot(arguments.robot))
    return found if arguments.domain is None else BusPlace(found.router, arguments.domain)


def place_of(folder: RobotFolder) -> BusPlace:
    """Return the place of a robot's own bus; names of message types mean those of the robot from then on.

    Raises:
        NotDoneError: if it has no router.
    """
    state = known_state(folder)
    if state is not None and not state.is_supervised:
        raise NotDoneError(no_answer(folder))  # its router is gone, too, or about to go
    if state is None or state.router is None:
        raise NotDoneError(NO_ANSWER.at(None, f"'{folder.path.name}' has no known router"))
    if texts := folder.read_messages():
        from rbxcompose.msgs import registry  # most robots have none, and lists need no types

        registry.choose(texts)
    return BusPlace(state.router, state.domain)


def add_asking_options(parser: argparse.ArgumentParser) -> None:
    """Declare `--robot NAME`, which may be a robot of a system, and `--json`."""
    add_robot_option(parser)
    add_system_options(parser)
    parser.add_argument("--json", action="store_true", help="answer in JSON")


def pass_on(arguments: argparse.Namespace, command: Command) -> int:
    """Send a command, print the answer, return the exit code."""
    folder = find_robot(arguments.robot)
    answer = answer_of(folder, command)
    show_answer(arguments, folder, answer)
    return 0


def show_answer(arguments: argparse.Namespace, folder: RobotFolder, answer: str) -> None:
    """Print a robot's answer."""
    emit(json.dumps({"robot": folder.path.name, "answer": answer}) if arguments.json else answer)
