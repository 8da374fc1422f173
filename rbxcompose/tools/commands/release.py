"""Allow motion again after `stop`; nothing moves by itself.

A mission continues after `mission resume`.
"""

import argparse

from rbxcompose.commands.lookup import add_asking_options, add_robot_argument, pass_on
from rbxcompose.commands.options import BUS
from rbxcompose.runtime.requests import ReleaseRobot

GROUP = "drive"
ON_SYSTEM = BUS


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_robot_argument(parser)
    add_asking_options(parser)


def run(arguments: argparse.Namespace) -> int:
    """Release the robot."""
    return pass_on(arguments, ReleaseRobot())
