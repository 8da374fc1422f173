"""Apply the changed files of a running robot; restart only what has changed.

It first shows the differences, component by component with the reason, and on a terminal asks for confirmation. A
manifest with errors changes nothing. Changes that are unsafe while the robot moves or a mission runs are refused with
the reason.
"""

from __future__ import annotations

import argparse
import json
import sys

from rbxcompose.cli.output.console import FINDINGS, misused, refuse, tell, tell_report
from rbxcompose.cli.project.robot_choice import add_path_argument, robot_path
from rbxcompose.cli.project.robot_options import add_layer_options, chosen_layers, compiled
from rbxcompose.cli.robots.lookup import REFUSED, NotDoneError
from rbxcompose.cli.robots.proposal import Proposal


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_path_argument(parser)
    add_layer_options(parser)
    parser.add_argument("-y", "--yes", action="store_true", help="do not ask")
    parser.add_argument("--dry-run", action="store_true", help="show the difference and what prevents it")
    parser.add_argument("--json", action="store_true", help="write the difference as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Compile the robot, show what would change in the running one, and apply the change."""
    path = robot_path(arguments.path)
    if path is None:
        return FINDINGS
    compilation = compiled(path, arguments)
    tell_report(compilation.report, compilation.sources)
    if compilation.plan is None or compilation.robot is None:
        return 1
    try:
        proposal = Proposal.of(compilation.plan, compilation.robot, chosen_layers(arguments))
        tell(json.dumps(proposal.data) if arguments.json else proposal.text())
        return _carry_out(proposal, arguments)
    except NotDoneError as error:
        return refuse(error.finding)


def _carry_out(proposal: Proposal, arguments: argparse.Namespace) -> int:
    name = proposal.folder.path.name
    if proposal.why_not:
        return refuse(REFUSED.at(None, f"'{name}' refuses: {proposal.why_not}"))
    if arguments.dry_run or proposal.is_empty:
        return 0
    if not arguments.yes:
        if arguments.json or not sys.stdin.isatty():
            return misused("apply", "there is no terminal to ask: give --yes, or --dry-run to only look")
        if not _is_wanted(name):
            tell("nothing was changed")
            return 0
    answer = proposal.apply()
    if not arguments.json:
        tell(f"{name} is changed: {answer}")
    return 0


def _is_wanted(name: str) -> bool:
    sys.stdout.write(f"change '{name}'? [y/N] ")
    sys.stdout.flush()
    return sys.stdin.readline().strip().lower() in ("y", "yes")
