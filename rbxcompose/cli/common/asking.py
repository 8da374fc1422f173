"""Verbs that pass one request to a running robot and print what it answers."""

from __future__ import annotations

from rbxcompose.cli.common.robots import NotDoneError, find_robot, request
from rbxcompose.cli.common.telling import refuse, tell


def pass_on(robot: str | None, fields: dict[str, object]) -> int:
    """Send a request, print the answer, return the exit code."""
    try:
        answer = request(find_robot(robot), fields)
    except NotDoneError as error:
        return refuse(error.finding)
    tell(str(answer))
    return 0
