"""Hold everything that moves, at once, until `release`.

It brakes the base, cancels the actions that claim what moves and pauses the missions. It is a protective stop in
software, not an emergency stop.
"""

from __future__ import annotations

import argparse

from rbxcompose.cli.robots.commands import add_asking_options, pass_on
from rbxcompose.runtime.requests import StopRobot


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_asking_options(parser)


def run(arguments: argparse.Namespace) -> int:
    """Stop the robot."""
    return pass_on(arguments, StopRobot())
