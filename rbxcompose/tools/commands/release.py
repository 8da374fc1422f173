"""Allow motion again after `stop`; nothing moves by itself.

A mission continues after `mission resume`.
"""

import argparse
from contextlib import suppress

from rbxcompose.commands.console import NotDoneError
from rbxcompose.commands.lookup import add_asking_options, add_robot_argument, answer_of, find_robot, show_answer
from rbxcompose.commands.options import BUS
from rbxcompose.missions.execution.requests import ListMissions
from rbxcompose.runtime.requests import ReleaseRobot

GROUP = "drive"
ON_SYSTEM = BUS
_PATIENCE = 1.0  # [s] for what is only an addition to the answer


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_robot_argument(parser)
    add_asking_options(parser)


def run(arguments: argparse.Namespace) -> int:
    """Release the robot."""
    folder = find_robot(arguments.robot)
    answer = answer_of(folder, ReleaseRobot())
    with suppress(NotDoneError):  # a robot without missions refuses
        if any(one.state == "paused" for one in answer_of(folder, ListMissions(), timeout=_PATIENCE)):
            answer = f"{answer}; 'mission resume' continues"
    show_answer(arguments, folder, answer)
    return 0
