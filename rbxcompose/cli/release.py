"""Allow motion again after `stop`; nothing moves by itself.

A mission goes on after `mission resume`.
"""

from __future__ import annotations

import argparse

from rbxcompose.cli.common.asking import pass_on
from rbxcompose.cli.common.robots import add_robot_option


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_robot_option(parser)


def run(arguments: argparse.Namespace) -> int:
    """Release the robot."""
    return pass_on(arguments.robot, {"verb": "release"})
