"""Stop everything that moves immediately, until `release`.

The base brakes, actions that claim what moves are cancelled, and missions pause. This is a protective stop in
software, not an emergency stop.
"""

import argparse

from rbxcompose.commands import lookup
from rbxcompose.commands.console import NotDoneError
from rbxcompose.commands.options import EACH
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.runtime.requests import StopRobot

GROUP = "drive"
IS_COMMON = True
ON_SYSTEM = EACH
_ANSWER = 1.0  # [s] for all processes together
_OTHERS = ("parent", "router")  # processes in which nothing moves


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    lookup.add_robot_argument(parser)
    lookup.add_asking_options(parser)


def run(arguments: argparse.Namespace) -> int:
    """Stop the robot, over the bus if its supervisor does not answer."""
    folder = lookup.awaited_robot(arguments.robot)
    answer = _stopped(folder)
    lookup.show_answer(arguments, folder, answer)
    return 0


def _stopped(folder: RobotFolder) -> str:
    state = lookup.known_state(folder)
    if state is None or not state.supervisor.is_stopped:  # waste no time on a stopped supervisor
        try:
            return lookup.answer_of(folder, StopRobot())
        except NotDoneError as error:
            if error.finding.code != lookup.NO_ANSWER.code:
                raise
    try:
        return stop_by_bus(folder)
    except NotDoneError:
        return lookup.answer_soon(folder, StopRobot(), _ANSWER)


def stop_by_bus(folder: RobotFolder) -> str:
    """Stop the robot without its supervisor, and return which processes were reached and which were not.

    Raises:
        NotDoneError: if no process can be reached.
    """
    from rbxcompose.commands.guest import Guest  # importing the bus takes time
    from rbxcompose.runtime.process_group.group import stop_key

    name, state = folder.path.name, lookup.known_state(folder)
    with Guest(lookup.place_of(folder)) as guest:
        stopped = sorted(answer.decode() for answer in guest.ask(stop_key(name), _ANSWER))
    missing = sorted({*(state.alive() if state else ())} - {*stopped, *_OTHERS})
    if not stopped:
        raise NotDoneError(lookup.NO_ANSWER.at(None, f"'{name}' does not answer, nor does any of its processes"))
    rest = f"; NOT stopped: {', '.join(missing)}" if missing else ""
    return f"the supervisor does not answer: stopped over the bus: {', '.join(stopped)}{rest}"
