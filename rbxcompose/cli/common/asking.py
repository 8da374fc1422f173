"""Verbs that pass one request to a running robot and print what it answers."""

from __future__ import annotations

import argparse
import json

from rbxcompose.cli.common.robots import NotDoneError, add_robot_option, find_robot, request
from rbxcompose.cli.common.telling import refuse, tell


def add_asking_options(parser: argparse.ArgumentParser) -> None:
    """Declare `--robot NAME` and `--json`."""
    add_robot_option(parser)
    parser.add_argument("--json", action="store_true", help="answer in JSON")


def pass_on(arguments: argparse.Namespace, fields: dict[str, object]) -> int:
    """Send a request, print the answer, return the exit code."""
    try:
        folder = find_robot(arguments.robot)
        answer = request(folder, fields)
    except NotDoneError as error:
        return refuse(error.finding)
    tell(json.dumps({"robot": folder.path.name, "answer": answer}) if arguments.json else str(answer))
    return 0
