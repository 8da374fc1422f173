"""Show the components of a running robot: state, process, restarts."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from typing import Any, cast

from rbxcompose.cli.common.robots import NotDoneError, add_robot_option, find_robot, known_state, request
from rbxcompose.cli.common.telling import refuse, tell
from rbxcompose.runtime.folder import RobotFolder, State

_COLUMNS = ("name", "type", "state", "process", "pid", "restarts")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("path", nargs="?", metavar="ROBOT|PATH", help="the robot, by name or file")
    add_robot_option(parser)
    parser.add_argument("--json", action="store_true", help="answer with one JSON object")


def run(arguments: argparse.Namespace) -> int:
    """Show what the supervisor says or, if it does not answer, what it last wrote."""
    try:
        folder = find_robot(arguments.robot or arguments.path)
        shown = _shown(folder)
    except NotDoneError as error:
        return refuse(error.finding)
    tell(json.dumps(shown) if arguments.json else _table(shown))
    return 0


def _shown(folder: RobotFolder) -> dict[str, Any]:
    try:
        state = cast(dict[str, Any], request(folder, {"verb": "ps"}))
    except NotDoneError:
        written = known_state(folder)
        if written is None:
            raise
        return _last_known(written)
    return {
        "robot": state["robot"],
        "supervisor": {"pid": state["supervisor"]["pid"]},
        "router": {"endpoint": state["router"]},
        "components": list(state["components"]),
    }


def _last_known(state: State) -> dict[str, Any]:
    alive = state.alive()
    components = [
        {
            "name": one.name,
            "type": one.type,
            "state": one.state if one.process in alive else "dead",
            "process": one.process,
            "pid": alive[one.process].pid if one.process in alive else None,
            "restarts": one.restarts,
        }
        for one in state.components
    ]
    supervisor = state.supervisor.pid if state.is_supervised else None
    router = state.router if "router" in alive else None
    return {
        "robot": state.robot,
        "supervisor": {"pid": supervisor},
        "router": {"endpoint": router},
        "components": components,
    }


def _table(shown: Mapping[str, Any]) -> str:
    pid, endpoint = shown["supervisor"]["pid"], shown["router"]["endpoint"]
    head = f"{shown['robot']}: supervisor {pid or 'dead'}, router {endpoint or 'none'}"
    rows = [_COLUMNS, *([_cell(one[column]) for column in _COLUMNS] for one in shown["components"])]
    widths = [max(len(row[index]) for row in rows) for index in range(len(_COLUMNS))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    return "\n".join([head, *lines])


def _cell(value: object) -> str:
    return "-" if value is None else str(value)
