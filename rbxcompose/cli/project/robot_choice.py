"""The robot that a verb means if it is not told: the only one of this folder, or the only one that is up."""

from __future__ import annotations

import argparse
from pathlib import Path

from rbxcompose.cli.output.console import refuse
from rbxcompose.cli.project.targets import robots_below
from rbxcompose.cli.robots.lookup import NotDoneError, find_robot, known_state, robots_up
from rbxcompose.findings import kind
from rbxcompose.manifest.files import ROBOT_FILE

UNNAMED = kind("RBX9031")
_MOST = 5  # robots that are listed
_ABOUT = "the robot's file, its folder, or rbx:robots/NAME of the library; without it, the only one"


def add_path_argument(parser: argparse.ArgumentParser) -> None:
    """Declare the robot's path, which may be left out."""
    parser.add_argument("path", nargs="?", metavar="PATH", help=_ABOUT)


def robot_path(written: str | None, *, may_run: bool = True) -> str | None:
    """Return the path of the robot that is meant; None after telling that this is not clear.

    With `may_run`, the only robot that is up is meant if the folder has none.
    """
    try:
        return written if written is not None else only_path(may_run=may_run)
    except NotDoneError as error:
        refuse(error.finding)
        return None


def only_path(*, may_run: bool) -> str:
    """Return the path of the only robot here.

    Raises:
        NotDoneError: if there is none or more than one.
    """
    here = [ROBOT_FILE] if Path(ROBOT_FILE).is_file() else robots_below(Path())
    if len(here) == 1:
        return here[0]
    if may_run and len(robots_up()) == 1 and (state := known_state(find_robot(None))) is not None:
        return state.file
    more = f" and {len(here) - _MOST} more" if len(here) > _MOST else ""
    words = f"this folder has several robots: {', '.join(here[:_MOST])}{more}" if here else "this folder has no robot"
    raise NotDoneError(UNNAMED.at(None, f"no robot is named, and {words}", help="give the path of one"))
