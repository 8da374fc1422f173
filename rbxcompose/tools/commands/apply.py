"""Apply the changed files of a running robot; restart only what has changed.

It first shows the differences, component by component with the reason, and on a terminal asks for confirmation. A
manifest with errors changes nothing. Changes that are unsafe while the robot moves or a mission runs are refused with
the reason. Of a system, all hosts are asked first: if one refuses, none is changed.
"""

import argparse
import json

from rbxcompose.commands.console import emit
from rbxcompose.commands.lookup import answer_of, find_robot, show_answer
from rbxcompose.commands.options import add_system_options, is_system
from rbxcompose.commands.targets import (
    add_layer_options,
    add_path_argument,
    chosen_layers,
    compiled,
    robot_path,
    without_errors,
)
from rbxcompose.runtime.plan_requests import RevertPlan
from rbxcompose.tools.robot_changes import LONGEST_CHANGE, Proposal, carry_out, unsure

GROUP = "run"
_LAST = -1  # generation of the last change


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_path_argument(parser)
    add_layer_options(parser)
    add_system_options(parser, has_profile=True)
    parser.add_argument("--host", metavar="NAME", help="of a system: only what this host runs, which is this machine")
    parser.add_argument("--robot", metavar="NAME", help="of a system: only this robot")
    parser.add_argument("--partial", action="store_true", help="of a system: change the hosts that can, without others")
    undo = "take back the last change, then the one before it; only that of generation N, as --json shows it"
    parser.add_argument("--undo", nargs="?", type=_generation, const=_LAST, metavar="N", help=undo)
    parser.add_argument("-y", "--yes", action="store_true", help="do not ask")
    parser.add_argument("--dry-run", action="store_true", help="show the difference and what prevents it")
    parser.add_argument("--json", action="store_true", help="write the difference as JSON")


def _generation(text: str) -> int:
    """Return the number of a generation; the path of a robot may not follow it."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"'{text}' is no generation; a path stands first: 'apply {text} --undo'")
    return int(text)


def run(arguments: argparse.Namespace) -> int:
    """Compile the robot, show what would change in the running one, and apply the change."""
    path = robot_path(arguments.path)
    if is_system(path):
        from rbxcompose.tools.system_runs import apply_system  # only needed for systems

        return apply_system(path, arguments)
    if arguments.undo is not None:
        return _undo(path, arguments)
    robot, plan = without_errors(compiled(path, arguments))
    proposal = Proposal.of(plan, robot, chosen_layers(arguments))
    emit(json.dumps(proposal.data) if arguments.json else proposal.text())
    if not arguments.json:
        from rbxcompose.tools.parameters.files import staying  # and the bus, which only people wait for

        for line in staying(robot, plan, proposal.found, proposal.folder):
            emit(line)
    return carry_out(proposal, arguments)


def _undo(path: str, arguments: argparse.Namespace) -> int:
    """Take back the last change of a running robot."""
    folder = find_robot(path)
    if (problem := unsure(folder.path.name, arguments)) is not None:
        return problem
    generation = None if arguments.undo == _LAST else arguments.undo
    answer = answer_of(folder, RevertPlan(generation), timeout=LONGEST_CHANGE)
    show_answer(arguments, folder, f"{folder.path.name} is as before: {answer}")
    return 0
