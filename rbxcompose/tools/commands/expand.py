"""Print the composed robot: parts, profiles and overlays put together, with the origin of each value.

The output is a manifest itself, for the folder of the robot's file.
Exit codes: 0 fine, 1 errors found, 2 wrong usage.
"""

import argparse
import json

from rbxcompose.base.printable import escaped
from rbxcompose.commands.console import FINDINGS, emit, write_report
from rbxcompose.commands.targets import add_layer_options, add_path_argument, compiled, robot_path
from rbxcompose.tools.inspection.origin import expand, expand_data

GROUP = "write"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_path_argument(parser)
    add_layer_options(parser)
    parser.add_argument("--no-origins", action="store_true", help="omit where each value comes from")
    parser.add_argument("--json", action="store_true", help="write values and origins as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Write the robot to stdout and its findings to stderr; if it has mistakes, as far as it could be read."""
    compilation = compiled(robot_path(arguments.path), arguments)
    write_report(compilation.report, compilation.sources)
    if compilation.robot is not None:
        manifest = compilation.robot.manifest
        if arguments.json:
            emit(escaped(json.dumps(expand_data(manifest), indent=2, ensure_ascii=False)))
        else:
            emit(expand(manifest, has_origins=not arguments.no_origins).rstrip("\n"))
    return FINDINGS if compilation.report.has_errors else 0
