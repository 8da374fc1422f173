"""Show where a value of a robot comes from: its file and line, the layers below it, what it is for.

VALUE is a path as for --set (battery.runtime, missions.patrol.with.rounds), or a port (go_to.cmd_vel). The robot may
stand before it.
Exit codes: 0 fine, 1 the robot cannot be read or has no such path, 2 wrong usage.
"""

import argparse
import json
from dataclasses import replace

from rbxcompose.base.findings import Finding
from rbxcompose.base.printable import plain
from rbxcompose.commands.console import FINDINGS, emit, misused, refuse, write_report
from rbxcompose.commands.options import add_unsaved_option
from rbxcompose.commands.targets import add_layer_options, compiled, put_robot_last, robot_path
from rbxcompose.manifest.files import find
from rbxcompose.tools.inspection.why import why

GROUP = "look"
_USAGE = "write 'rbxcompose why VALUE [ROBOT]'"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("path", metavar="VALUE", help="its path: battery.runtime, muxes.cmd_vel, go_to.cmd_vel")
    parser.add_argument(
        "robot", nargs="?", metavar="ROBOT", help="the robot's file, its folder, or rbx:robots/NAME; else the only one"
    )
    add_layer_options(parser)
    add_unsaved_option(parser)
    parser.add_argument("--json", action="store_true", help="write the answer as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Write what is known about a path; explain a robot with mistakes as far as it could be read."""
    put_robot_last(arguments, "path", "robot")
    if arguments.robot is None and "/" in arguments.path:
        return misused("why", f"'{plain(arguments.path)}' is a robot, and no value of it is named; {_USAGE}")
    robot = robot_path(arguments.robot)
    if isinstance(missing := find(robot), Finding):
        return refuse(replace(missing, help="; ".join(filter(None, (missing.help, _USAGE)))))
    compilation = compiled(robot, arguments)
    if compilation.robot is None:
        write_report(compilation.report, compilation.sources)
        return FINDINGS
    answer = why(compilation.robot, arguments.path)
    if isinstance(answer, Finding):
        return refuse(answer)
    emit(json.dumps(answer.data(), indent=2, ensure_ascii=False) if arguments.json else answer.text())
    return 0
