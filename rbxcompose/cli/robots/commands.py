"""Verbs that send one command to a running robot and print its answer."""

from __future__ import annotations

import argparse
import json

from rbxcompose.cli.output.console import refuse, tell
from rbxcompose.cli.robots.lookup import NotDoneError, add_robot_option, answer_of, find_robot
from rbxcompose.cli.systems.options import add_system_options
from rbxcompose.requests import Command
from rbxcompose.runtime.folder import RobotFolder


def add_asking_options(parser: argparse.ArgumentParser) -> None:
    """Declare `--robot NAME`, which may be a robot of a system, and `--json`."""
    add_robot_option(parser)
    add_system_options(parser)
    parser.add_argument("--json", action="store_true", help="answer in JSON")


def pass_on(arguments: argparse.Namespace, command: Command) -> int:
    """Send a command, print the answer, return the exit code."""
    try:
        folder = find_robot(arguments.robot)
        answer = answer_of(folder, command)
    except NotDoneError as error:
        return refuse(error.finding)
    show_answer(arguments, folder, answer)
    return 0


def show_answer(arguments: argparse.Namespace, folder: RobotFolder, answer: str) -> None:
    """Print a robot's answer."""
    tell(json.dumps({"robot": folder.path.name, "answer": answer}) if arguments.json else answer)
