"""Show how a running robot is: its groups and their parts, live or as changes; acknowledge levels.

Exit codes of `tree`: the level of the robot, 0 OK, 1 WARN, 2 ERROR, 3 STALE. The others: 0 fine, 1 refused, 2 wrong
usage.
"""

from __future__ import annotations

import argparse
import json
import os
import select
import shutil
import sys
import time
from collections.abc import Callable, Iterator

from rbxcompose.cli.output.console import has_colour, refuse, tell
from rbxcompose.cli.output.terminal import full_screen, raw, show
from rbxcompose.cli.robots.commands import add_asking_options, pass_on
from rbxcompose.cli.robots.health import change_line, told_change, told_tree, tree_lines
from rbxcompose.cli.robots.lookup import NotDoneError, answer_of, find_robot
from rbxcompose.diagnostics.requests import (
    TYPE,
    Acknowledge,
    DiagnosticsTree,
    LevelChange,
    ListChanges,
    ShowDiagnostics,
)
from rbxcompose.runtime.folder import RobotFolder

ON_SYSTEM = TYPE
_PERIOD = 0.2  # [s] between two requests to a robot that is followed


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)

    def add(action: str, words: str, do: Callable[[argparse.Namespace], int]) -> argparse.ArgumentParser:
        made = actions.add_parser(action, help=words, description=words)
        made.set_defaults(do=do)
        add_asking_options(made)
        return made

    tree = add("tree", "print groups and parts with their levels; the exit code is the level of the robot", _tree)
    watch = add("watch", "show the tree live, until q or Ctrl-C", _watch)
    for one in (tree, watch):
        one.add_argument("-v", "--values", action="store_true", help="also the values that parts tell")
    add("echo", "print each change of a level with its cause, until interrupted", _echo)
    history = add("history", "print the last changes of levels, oldest first", _history)
    history.add_argument("path", nargs="?", default="", metavar="PATH", help="only of this group and what is below it")
    ack = add("ack", "let latched levels follow the present again", _acknowledge)
    ack.add_argument("path", nargs="?", default="", metavar="PATH", help="the group, such as /power; without it, all")


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    do: Callable[[argparse.Namespace], int] = arguments.do
    try:
        return do(arguments)
    except NotDoneError as error:
        return refuse(error.finding)


def _tree(arguments: argparse.Namespace) -> int:
    folder = find_robot(arguments.robot)
    tree = answer_of(folder, ShowDiagnostics())
    if arguments.json:
        tell(_document(folder, tree))
    else:
        tell("\n".join(tree_lines(folder.path.name, tree, values=arguments.values, colour=has_colour(sys.stdout))))
    return int(tree.level)


def _document(folder: RobotFolder, tree: DiagnosticsTree) -> str:
    return json.dumps({"robot": folder.path.name, **told_tree(tree)})


def _watch(arguments: argparse.Namespace) -> int:
    """Show the tree until it is enough; without a terminal once, as JSON after each change of a level."""
    folder = find_robot(arguments.robot)
    try:
        if arguments.json:
            return _follow_tree(folder)
        if not (sys.stdin.isatty() and sys.stdout.isatty()):
            _tree(arguments)
            return 0
        return _show_live(folder, values=arguments.values)
    except KeyboardInterrupt:
        return 0


def _follow_tree(folder: RobotFolder) -> int:
    told: list[tuple[str, int]] | None = None
    while True:
        tree = answer_of(folder, ShowDiagnostics())
        levels = [(one.path, int(one.level)) for one in tree.lines]
        if levels != told:
            tell(_document(folder, tree))
        told = levels
        time.sleep(_PERIOD)


def _show_live(folder: RobotFolder, *, values: bool) -> int:
    keyboard, colour = sys.stdin.fileno(), has_colour(sys.stdout)
    with raw(keyboard), full_screen(sys.stdout):
        while True:
            size = shutil.get_terminal_size()  # takes 80 x 24 for a terminal that reports 0 x 0
            tree = answer_of(folder, ShowDiagnostics())
            lines = tree_lines(folder.path.name, tree, values=values, colour=colour, width=size.columns)
            show(sys.stdout, list(lines)[: size.lines])
            if select.select([keyboard], [], [], _PERIOD)[0] and os.read(keyboard, 100).lower().count(b"q"):
                return 0


def _echo(arguments: argparse.Namespace) -> int:
    folder = find_robot(arguments.robot)
    known = list(_changes(folder))
    number = known[-1].number if known else 0
    try:
        while True:
            for change in _changes(folder, number):
                tell(json.dumps(told_change(change)) if arguments.json else change_line(change, has_colour(sys.stdout)))
                number = change.number
            time.sleep(_PERIOD)
    except KeyboardInterrupt:
        return 0


def _changes(folder: RobotFolder, number: int = 0) -> Iterator[LevelChange]:
    """Yield all known changes after one, as many at a time as an answer holds."""
    while some := answer_of(folder, ListChanges(number)):
        yield from some
        number = some[-1].number


def _history(arguments: argparse.Namespace) -> int:
    above = f"/{arguments.path.strip('/')}".rstrip("/")
    known = _changes(find_robot(arguments.robot))
    changes = [one for one in known if f"{one.path}/".startswith(f"{above}/")]
    if arguments.json:
        tell(json.dumps([told_change(one) for one in changes]))
    elif not changes:
        tell("no level has changed")
    else:
        tell("\n".join(change_line(one, has_colour(sys.stdout)) for one in changes))
    return 0


def _acknowledge(arguments: argparse.Namespace) -> int:
    return pass_on(arguments, Acknowledge(arguments.path))
