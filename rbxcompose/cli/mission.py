"""Pause or resume the mission of a running robot, or list its missions."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from typing import Any, cast

from rbxcompose.cli.common.asking import pass_on
from rbxcompose.cli.common.robots import NotDoneError, add_robot_option, find_robot, request
from rbxcompose.cli.common.telling import refuse, tell


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    actions = parser.add_subparsers(dest="action", metavar="pause|resume|ls", required=True)
    add_robot_option(actions.add_parser("pause", help="hold the mission; its timers stand still"))
    add_robot_option(actions.add_parser("resume", help="go on where it was held"))
    ls = actions.add_parser("ls", help="list the robot's missions")
    add_robot_option(ls)
    ls.add_argument("--json", action="store_true", help="answer with a JSON list")


def run(arguments: argparse.Namespace) -> int:
    """Pass the word on to the component that carries out missions, or list what the robot has."""
    if arguments.action == "ls":
        return _list(arguments.robot, arguments.json)
    return pass_on(arguments.robot, {"verb": "command", "to": "mission", "word": arguments.action})


def _list(robot: str | None, as_json: bool) -> int:
    try:
        missions = cast(list[dict[str, Any]], request(find_robot(robot), {"verb": "missions"}))
    except NotDoneError as error:
        return refuse(error.finding)
    tell(json.dumps(missions) if as_json else _table(missions))
    return 0


def _table(missions: Sequence[dict[str, Any]]) -> str:
    width = max((len(one["name"]) for one in missions), default=0)
    lines = [f"{'*' if one['starts'] else ' '} {one['name']:<{width}}  {one['about']}" for one in missions]
    return "\n".join([*lines, "(* starts by itself)"] if lines else ["this robot has no missions"])
