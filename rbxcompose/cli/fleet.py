"""See, command and follow many robots of systems at once, chosen by their labels.

A label is one of `labels` of a robot, its name, or the name that its instances have in common; of several, a robot
must have all. Without a SYSTEM, the only one of the project is meant.
"""

from __future__ import annotations

import argparse

from rbxcompose.cli.output.console import refuse
from rbxcompose.cli.project.robot_choice import UNNAMED
from rbxcompose.cli.project.targets import systems_here
from rbxcompose.cli.systems.options import add_system_options
from rbxcompose.levels import LOG_LEVELS


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    actions = parser.add_subparsers(dest="action", metavar="ls|run|logs", required=True)
    ls = actions.add_parser("ls", help="list robots: hosts, state, mission, batteries")
    run_ = actions.add_parser("run", help="start a mission on each")
    run_.add_argument("mission", metavar="MISSION", help="which one")
    run_.add_argument("--set", action="append", default=[], dest="sets", metavar="K=V", help="give it an input")
    logs = actions.add_parser("logs", help="show the logs of all, each line with its robot")
    logs.add_argument("--level", choices=LOG_LEVELS, default="info", help="the lowest level to show")
    logs.add_argument("-f", "--follow", action="store_true", help="follow new records, until interrupted")
    logs.add_argument("-n", "--lines", type=int, metavar="N", help="start with the last N records of each")
    for one in (ls, run_, logs):
        one.add_argument("paths", metavar="SYSTEM", nargs="*", help="files of systems")
        one.add_argument("--label", action="append", default=[], dest="labels", metavar="L", help="only robots with it")
        add_system_options(one)
    for one in (ls, run_):
        one.add_argument("--json", action="store_true", help="answer in JSON")


def run(arguments: argparse.Namespace) -> int:
    """Run the chosen subcommand."""
    from rbxcompose.cli.systems.fleet import Fleet  # the compiler, which completion does not need

    paths = arguments.paths or systems_here()
    if not arguments.paths and len(paths) != 1:
        message = f"no system is named, and this folder has {', '.join(paths) if paths else 'none'}"
        return refuse(UNNAMED.at(None, message, help="give the path of one"))
    fleet = Fleet.of(paths, arguments)
    if isinstance(fleet, int):
        return fleet
    match arguments.action:
        case "ls":
            return fleet.tell(in_json=arguments.json)
        case "run":
            return fleet.run(arguments.mission, arguments.sets, in_json=arguments.json)
        case _:
            lines = ["-n", str(arguments.lines)] if arguments.lines is not None else []
            return fleet.follow(["--level", arguments.level, *(["-f"] if arguments.follow else []), *lines])
