"""Show the log of a robot, also of its last run, or what some of its components wrote.

A large log file is renamed to `log.jsonl.1`, and so on; the log of the previous run is `log.1.jsonl`.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from rbxcompose.base.findings import suggest
from rbxcompose.base.levels import LOG_LEVELS
from rbxcompose.commands.console import NotDoneError, emit, has_colour
from rbxcompose.commands.lookup import NOT_UP, add_robot_option, find_robot, known_state, warn_of_lost_log
from rbxcompose.commands.options import EACH, add_system_options, count_from_zero
from rbxcompose.runtime.folder import RobotFolder, base_folder
from rbxcompose.runtime.log import NAME, Follower, Record, StoryWriter

if TYPE_CHECKING:  # only needed for systems
    from rbxcompose.commands.hosts import SystemCommand

GROUP = "look"
IS_COMMON = True
ON_SYSTEM = EACH
_PAUSE = 0.05  # [s] between checks for new records


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    words = "the robot, by name or file, or a system; then components"
    parser.add_argument("names", nargs="*", metavar="ROBOT|PATH|COMPONENT", help=words)
    add_robot_option(parser)
    add_system_options(parser)
    parser.add_argument("--level", choices=LOG_LEVELS, default="info", help="the lowest level to show")
    parser.add_argument("-f", "--follow", action="store_true", help="follow new records, until interrupted")
    parser.add_argument("-n", "--lines", type=count_from_zero, metavar="N", help="start with the last N records")
    parser.add_argument("--json", action="store_true", help="one JSON object per record, as the log file has them")


def run(arguments: argparse.Namespace) -> int:
    """Print the existing records and, if requested, new ones as they come."""
    folder, names = _addressed(arguments.robot, arguments.names)
    follower = Follower(folder.path / NAME)
    records = follower.read()
    sources = {record.source for record in records}
    _know(names, folder, sources)
    story = StoryWriter(names or sources, colour=has_colour(sys.stdout))

    def wanted(records: Iterable[Record]) -> list[Record]:
        least = LOG_LEVELS[arguments.level]
        return [record for record in records if record.level >= least and (not names or record.source in names)]

    def show(records: Iterable[Record]) -> None:
        for record in records:
            emit(record.to_json() if arguments.json else story.line(record))

    shown = wanted(records)
    show(shown if arguments.lines is None else shown[max(0, len(shown) - arguments.lines) :])
    warn_of_lost_log(folder)
    while arguments.follow:
        time.sleep(_PAUSE)
        show(wanted(follower.read()))
    follower.close()
    return 0


def run_on_system(command: SystemCommand) -> int:
    """Show the logs of robots of a system, each line with its host."""
    from rbxcompose.commands.hosts import follow_all

    return follow_all(command.shares, command.words_for)


def _addressed(robot: str | None, names: Sequence[str]) -> tuple[RobotFolder, Sequence[str]]:
    """Return the folder of the robot and the names of components; the first name may be that of the robot.

    Raises:
        NotDoneError: if there is no log, or several.
    """
    if robot is not None or not names:
        return _folder(robot), names
    try:
        return _folder(names[0]), names[1:]
    except NotDoneError as error:
        if error.finding.code != NOT_UP.code:
            raise
    return _folder(None), names


def _know(names: Sequence[str], folder: RobotFolder, sources: Iterable[str]) -> None:
    """Check that all names are of sources that may write to the log.

    Raises:
        NotDoneError: if one is not.
    """
    state = known_state(folder)
    known = {*sources, *(component.name for component in state.components)} if state is not None else set(sources)
    for name in names:
        if name not in known:
            text = f"'{name}' is neither a robot that is up nor a component in the log of '{folder.path.name}'"
            raise NotDoneError(NOT_UP.at(None, text, help=suggest(name, sorted(known), "components")))


def _folder(wanted: str | None) -> RobotFolder:
    """Return the folder of a running robot, else of the one that ran last.

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
