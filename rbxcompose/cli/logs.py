"""Show the log of a robot, also of its last run.

The log of the run before is kept beside it as `log.1.jsonl`.
"""

from __future__ import annotations

import argparse
import sys
import time

from rbxcompose.cli.common.robots import NOT_UP, NotDoneError, add_robot_option, find_robot
from rbxcompose.cli.common.story import Story
from rbxcompose.cli.common.telling import has_colour, refuse, tell
from rbxcompose.runtime.folder import RobotFolder, base_folder
from rbxcompose.runtime.follow import Follower
from rbxcompose.runtime.log import NAME
from rbxcompose.runtime.records import Record

_PAUSE = 0.05  # [s] between looks for more


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("path", nargs="?", metavar="ROBOT|PATH", help="the robot, by name or file")
    add_robot_option(parser)
    parser.add_argument("-f", "--follow", action="store_true", help="go on with what comes, until interrupted")
    parser.add_argument("-n", "--lines", type=int, metavar="N", help="begin with the last N records")


def run(arguments: argparse.Namespace) -> int:
    """Print the records that are there and, if asked for, those that come."""
    try:
        folder = _folder(arguments.robot or arguments.path)
    except NotDoneError as error:
        return refuse(error.finding)
    follower = Follower(folder.path / NAME)
    records = follower.read()
    story = Story({record.source for record in records}, colour=has_colour(sys.stdout))
    _tell(story, records if arguments.lines is None else records[max(0, len(records) - arguments.lines) :])
    while arguments.follow:
        time.sleep(_PAUSE)
        _tell(story, follower.read())
    follower.close()
    return 0


def _tell(story: Story, records: list[Record]) -> None:
    for record in records:
        tell(story.line(record))


def _folder(wanted: str | None) -> RobotFolder:
    """Return the folder of a robot that is up, else of the one that was up last.

    Raises:
        NotDoneError: if there is no log, or several.
    """
    try:
        return find_robot(wanted)
    except NotDoneError as error:
        logs = {path.parent.name: path.stat().st_mtime for path in base_folder().glob(f"*/{NAME}")}
        latest = max(logs, key=lambda name: logs[name], default=None)
        if wanted in logs or (wanted is None and latest and error.finding.code == NOT_UP.code):
            return RobotFolder.of(wanted or str(latest))
        raise
