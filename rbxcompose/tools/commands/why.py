"""Show where a value of a robot comes from: its file and line, the layers below it, what it is for.

VALUE is a path as for --set (battery.runtime, missions.patrol.with.rounds), or a port (go_to.cmd_vel).
Exit codes: 0 fine, 1 the robot cannot be read or has no such path, 2 wrong usage.
"""

import argparse
import json

from rbxcompose.base.findings import Finding
from rbxcompose.commands.console import FINDINGS, emit, refuse, write_report
from rbxcompose.commands.targets import add_layer_options, compiled, robot_path
from rbxcompose.tools.inspection.why import why


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("path", metavar="VALUE", help="its path: battery.runtime, muxes.cmd_vel, go_to.cmd_vel")
    parser.add_argument(
        "robot", nargs="?", metavar="ROBOT", help="the robot's file, its folder, or rbx:robots/NAME; else the only one"
    )
    add_layer_options(parser)
    parser.add_argument("--json", action="store_true", help="write the answer as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Write what is known about a path; explain a robot with mistakes as far as it could be read."""
    compilation = compiled(robot_path(arguments.robot), arguments)
    if compilation.robot is None:
        write_report(compilation.report, compilation.sources)
        return FINDINGS
    answer = why(compilation.robot, arguments.path)
    if isinstance(answer, Finding):
        return refuse(answer)
    emit(json.dumps(answer.data(), indent=2, ensure_ascii=False) if arguments.json else answer.text())
    return 0
