"""Show how a running robot is: its groups and their parts, live or as changes; acknowledge levels.

Exit codes of `tree`: the level of the robot, 0 OK, 1 WARN, 2 ERROR, 3 STALE, also if it is not up or does not answer.
The others: 0 fine, 1 refused, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

from rbxcompose.base.findings import clauses, suggest
from rbxcompose.base.levels import Level
from rbxcompose.base.printable import fitted, plain
from rbxcompose.base.requests import to_data
from rbxcompose.commands.console import NotDoneError, emit, has_colour, refuse
from rbxcompose.commands.lookup import REFUSED, add_asking_options, answer_of, find_robot, pass_on
from rbxcompose.commands.options import Subcommand, add_actions, argument, run_action
from rbxcompose.commands.terminal import LiveScreen, is_terminal
from rbxcompose.domains.diagnostics import requests
from rbxcompose.runtime.folder import RobotFolder

GROUP = "look"
ON_SYSTEM = requests.TYPE
FOR_ALL = ("tree", "history")
_PERIOD = 0.2  # [s] between two requests to a robot that is followed
_STARTS = 3.0  # [s] that a robot has to report for the first time
_RESET, _FAINT = "\x1b[0m", "\x1b[2m"
_COLOURS = {Level.OK: "\x1b[32m", Level.WARN: "\x1b[33m", Level.ERROR: "\x1b[1;31m", Level.STALE: "\x1b[35m"}
_STEP = "  "
_WIDEST = 40  # columns of a name; longer ones move their message to the right
_LONGEST = 1000  # characters of a message


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    values = argument("-v", "--values", action="store_true", help="also the values that parts report")
    below = argument("path", nargs="?", default="", metavar="PATH", help="only of this group and what is below it")
    group = argument("path", nargs="?", default="", metavar="PATH", help="the group, such as /power; without it, all")
    actions = (
        ("tree", "print groups and parts with their levels; the exit code is the level of the robot", _tree, values),
        ("watch", "show the tree live, until q or Ctrl-C", _watch, values),
        ("echo", "print each change of a level with its cause, until interrupted", _echo),
        ("history", "print the last changes of levels, oldest first", _history, below),
        ("ack", "let latched levels follow the present again", _acknowledge, group),
    )
    described = (Subcommand(name, words, do, (add_asking_options, *own), words) for name, words, do, *own in actions)
    add_actions(parser, described, metavar="ACTION")


run = run_action


def _tree(arguments: argparse.Namespace) -> int:
    try:
        return _show_tree(arguments)
    except NotDoneError as error:
        refuse(error.finding)
        return int(Level.STALE)  # nothing is known


def _show_tree(arguments: argparse.Namespace) -> int:
    folder = find_robot(arguments.robot)
    tree, deadline = answer_of(folder, requests.ShowDiagnostics()), time.monotonic() + _STARTS
    while any(line.message == requests.NOT_YET for line in tree.lines) and time.monotonic() < deadline:
        time.sleep(_PERIOD)
        tree = answer_of(folder, requests.ShowDiagnostics())
    if arguments.json:
        emit(_document(folder, tree))
    else:
        emit("\n".join(tree_lines(folder.path.name, tree, values=arguments.values, colour=has_colour(sys.stdout))))
    return int(tree.level)


def _document(folder: RobotFolder, tree: requests.DiagnosticsTree) -> str:
    return json.dumps({"robot": folder.path.name, **tree_data(tree)})


def _watch(arguments: argparse.Namespace) -> int:
    """Show the tree until it is enough; without a terminal once, as JSON after each change of a level."""
    folder = find_robot(arguments.robot)
    try:
        if arguments.json:
            return _follow_tree(folder)
        if not is_terminal():
            _show_tree(arguments)
            return 0
        return _show_live(folder, values=arguments.values)
    except KeyboardInterrupt:
        return 0


def _follow_tree(folder: RobotFolder) -> int:
    printed: list[tuple[str, int]] | None = None
    while True:
        tree = answer_of(folder, requests.ShowDiagnostics())
        levels = [(line.path, int(line.level)) for line in tree.lines]
        if levels != printed:
            emit(_document(folder, tree))
        printed = levels
        time.sleep(_PERIOD)


def _show_live(folder: RobotFolder, *, values: bool) -> int:
    colour = has_colour(sys.stdout)
    with LiveScreen() as screen:
        while not screen.is_over:
            tree = answer_of(folder, requests.ShowDiagnostics())
            screen.draw(partial(_tree_picture, folder.path.name, tree, values, colour))
            screen.wait(_PERIOD)
    return 0


def _tree_picture(
    robot: str, tree: requests.DiagnosticsTree, values: bool, colour: bool, width: int, height: int
) -> Sequence[str]:
    return list(tree_lines(robot, tree, values=values, colour=colour, width=width))


def _echo(arguments: argparse.Namespace) -> int:
    folder = find_robot(arguments.robot)
    known = list(_changes(folder))
    number = known[-1].number if known else 0
    try:
        while True:
            for change in _changes(folder, number):
                emit(json.dumps(change_data(change)) if arguments.json else change_line(change, has_colour(sys.stdout)))
                number = change.number
            time.sleep(_PERIOD)
    except KeyboardInterrupt:
        return 0


def _changes(folder: RobotFolder, number: int = 0) -> Iterator[requests.LevelChange]:
    """Yield all known changes after one, as many at a time as an answer holds."""
    while some := answer_of(folder, requests.ListChanges(number)):
        yield from some
        number = some[-1].number


def _history(arguments: argparse.Namespace) -> int:
    above, folder = f"/{arguments.path.strip('/')}".rstrip("/"), find_robot(arguments.robot)
    changes = [change for change in _changes(folder) if f"{change.path}/".startswith(f"{above}/")]
    if above and not changes:
        _check_path(above, folder)
    if arguments.json:
        emit(json.dumps([change_data(change) for change in changes]))
    elif not changes:
        emit("no level has changed")
    else:
        emit("\n".join(change_line(change, has_colour(sys.stdout)) for change in changes))
    return 0


def _check_path(path: str, folder: RobotFolder) -> None:
    """Check that the tree has a group or a part with this path.

    Raises:
        NotDoneError: if it has not.
    """
    tree = answer_of(folder, requests.ShowDiagnostics())
    if not tree.left_out and all(line.path != path for line in tree.lines):
        groups = [line.path for line in tree.lines if line.is_group]
        raise NotDoneError(REFUSED.at(None, clauses(f"there is no group '{path}'", suggest(path, groups, "groups"))))


def _acknowledge(arguments: argparse.Namespace) -> int:
    return pass_on(arguments, requests.Acknowledge(arguments.path))


def tree_lines(
    robot: str, tree: requests.DiagnosticsTree, *, values: bool = False, colour: bool = False, width: int = 0
) -> Iterator[str]:
    """Yield the robot with its level and the cause, then a line for each group and part; `width` 0 cuts nothing."""
    names = [f"{_STEP * (tree_line.depth + 1)}{plain(tree_line.name)}" for tree_line in tree.lines]
    column = max((len(name) for name in (robot, *names) if len(name) <= _WIDEST), default=0)
    yield _row(robot, tree.level, tree.cause, column, colour, width)
    for name, line in zip(names, tree.lines, strict=True):
        message = "" if line.is_group and line.message == line.level.name else line.message
        yield _row(name, line.level, message, column, colour, width)
        if values and not line.is_group:
            yield from _values(line, colour, width)
    notes = [f"{tree.left_out:,} more are on /diagnostics_agg"] if tree.left_out else []
    notes += [f"{tree.dropped:,} statuses were refused; the log says why"] if tree.dropped else []
    for text in notes:
        yield fitted(text, width) if width else text


def _row(name: str, level: Level, message: str, column: int, colour: bool, width: int) -> str:
    text = f"{name:<{column}}  {level.name:<5}  {plain(message, _LONGEST)}".rstrip()
    text = fitted(text, width) if width else text
    if not colour:
        return text
    start = len(f"{name:<{column}}  ")
    word = text[start : start + 5]
    return f"{text[:start]}{_COLOURS[level]}{word}{_RESET}{text[start + 5 :]}"


def _values(line: requests.TreeLine, colour: bool, width: int) -> Iterator[str]:
    pairs = [*((("hardware_id", line.hardware_id),) if line.hardware_id else ()), *line.values]
    keys = max((len(plain(key)) for key, _ in pairs), default=0)
    for key, value in pairs:
        text = f"{_STEP * (line.depth + 2)}{plain(key):<{keys}}  {plain(value, _LONGEST)}"
        text = fitted(text, width) if width else text
        yield f"{_FAINT}{text}{_RESET}" if colour else text


def change_line(change: requests.LevelChange, colour: bool) -> str:
    """Return a change as a line: `   12.30  /power  OK -> WARN  battery: Medium battery`."""
    old, new = (f"{_COLOURS[item]}{item.name}{_RESET}" if colour else item.name for item in (change.old, change.new))
    cause = "" if change.cause == change.new.name else plain(change.cause, _LONGEST)
    return f"{change.time:8.2f}  {plain(change.path)}  {old} -> {new}  {cause}".rstrip()


def change_data(change: requests.LevelChange) -> dict[str, Any]:
    """Return a change as data for JSON; levels are words."""
    return {**to_data(change), "old": change.old.name.lower(), "new": change.new.name.lower()}


def tree_data(tree: requests.DiagnosticsTree) -> dict[str, Any]:
    """Return the tree as data for JSON: levels are words, values a map."""
    lines = [{**to_data(line), "level": line.level.name.lower(), "values": dict(line.values)} for line in tree.lines]
    return {**to_data(tree), "level": tree.level.name.lower(), "lines": lines}
