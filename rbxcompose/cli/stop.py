"""Stop everything that moves immediately, until `release`.

The base brakes, actions that claim what moves are cancelled, and missions pause. This is a protective stop in
software, not an emergency stop.
"""

from __future__ import annotations

import argparse

from rbxcompose.cli.output.console import refuse
from rbxcompose.cli.robots.commands import add_asking_options, show_answer
from rbxcompose.cli.robots.lookup import NO_ANSWER, NotDoneError, answer_of, find_robot, known_state
from rbxcompose.cli.systems.options import EACH
from rbxcompose.runtime.folder import RobotFolder
from rbxcompose.runtime.requests import StopRobot

ON_SYSTEM = EACH


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_asking_options(parser)


def run(arguments: argparse.Namespace) -> int:
    """Stop the robot, over the bus if its supervisor does not answer."""
    try:
        folder = find_robot(arguments.robot)
        answer = _stopped(folder)
    except NotDoneError as error:
        return refuse(error.finding)
    show_answer(arguments, folder, answer)
    return 0


def _stopped(folder: RobotFolder) -> str:
    state = known_state(folder)
    if state is None or not state.supervisor.is_stopped:  # waste no time on a stopped supervisor
        try:
            return answer_of(folder, StopRobot())
        except NotDoneError as error:
            if error.finding.code != NO_ANSWER.code:
                raise
    from rbxcompose.cli.robots.stop_by_bus import stop_by_bus  # importing the bus takes time

    return stop_by_bus(folder)
