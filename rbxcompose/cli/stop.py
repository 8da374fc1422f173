"""Hold everything that moves, at once, until `release`.

It brakes the base, cancels the actions that claim what moves and pauses the missions. It is a protective stop by
software and no emergency stop.
"""

from __future__ import annotations

import argparse

from rbxcompose.cli.common.asking import pass_on
from rbxcompose.cli.common.robots import add_robot_option


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_robot_option(parser)


def run(arguments: argparse.Namespace) -> int:
    """Stop the robot."""
    return pass_on(arguments.robot, {"verb": "stop"})
