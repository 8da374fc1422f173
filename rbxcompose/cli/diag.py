"""Show how a running robot is, as a tree of groups and their parts.

`tree` ends with the level of the robot: 0 OK, 1 WARN, 2 ERROR, 3 STALE.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable

from rbxcompose.cli.output.console import has_colour, refuse, tell
from rbxcompose.cli.robots.commands import add_asking_options
from rbxcompose.cli.robots.health import told_tree, tree_lines
from rbxcompose.cli.robots.lookup import NotDoneError, answer_of, find_robot
from rbxcompose.diagnostics.requests import ShowDiagnostics


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    actions = parser.add_subparsers(dest="action", metavar="tree", required=True)
    tree = actions.add_parser("tree", help="print groups and parts with their levels; the exit code is the worst")
    tree.add_argument("-v", "--values", action="store_true", help="also the values that parts tell")
    tree.set_defaults(do=_tree)
    add_asking_options(tree)


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
        tell(json.dumps({"robot": folder.path.name, **told_tree(tree)}))
    else:
        tell("\n".join(tree_lines(folder.path.name, tree, values=arguments.values, colour=has_colour(sys.stdout))))
    return int(tree.level)
