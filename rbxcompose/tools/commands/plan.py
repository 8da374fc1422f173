"""Show what would run: processes, components in start order, their topics; or the changes to a plan.

Exit codes: 0 fine, 1 errors found, 2 wrong usage.
"""

import argparse
import json
import sys
from pathlib import Path

from rbxcompose.base.files import read_regular
from rbxcompose.base.findings import kind
from rbxcompose.commands.console import USAGE, NotDoneError, emit
from rbxcompose.commands.options import add_unsaved_option, is_system, unsaved_of
from rbxcompose.commands.targets import (
    Layers,
    add_layer_options,
    add_path_argument,
    layers_of,
    robot_path,
    system_without_errors,
    without_errors,
)
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.plan.diff import difference
from rbxcompose.compiler.plan.dump import PlanTextError, dump, load
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.manifest.tree import ALL_BYTES
from rbxcompose.tools.inspection.plan_text import plan_text, system_data, system_text

GROUP = "look"
NO_PLAN = kind("RBX9012")
SAVED = ".json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_path_argument(parser)
    add_layer_options(parser)
    add_unsaved_option(parser)
    parser.add_argument("--json", action="store_true", help="write the plan, or the difference, as JSON")
    parser.add_argument("--keys", action="store_true", help="show the keys on the wire, too")
    parser.add_argument("--diff", metavar="FILE", help="a plan that --json wrote, or a robot: what has changed since")


def run(arguments: argparse.Namespace) -> int:
    """Write the plan of a robot without errors, or its difference from another plan."""
    path = robot_path(arguments.path)
    if is_system(path):
        return _show_system(path, arguments)
    layers = layers_of(arguments)
    _, after = without_errors(compile_robot(path, **layers))
    if arguments.diff is None:
        emit(dump(after).rstrip("\n") if arguments.json else plan_text(after, with_keys=arguments.keys))
        return 0
    before = _other(arguments.diff, {**layers, "profiles": (), "overlays": (), "sets": ()})
    found = difference(before, after)
    emit(json.dumps(found.data(), indent=2, ensure_ascii=False) if arguments.json else found.text())
    return 0


def _show_system(path: str, arguments: argparse.Namespace) -> int:
    if arguments.diff is not None or arguments.overlays or arguments.sets:
        sys.stderr.write("rbxcompose plan: --diff, -f and --set are for robots, not for systems\n")
        return USAGE
    system = system_without_errors(path, arguments.profile, real=arguments.real, unsaved=unsaved_of(arguments))
    if arguments.json:
        emit(json.dumps(system_data(system), indent=2, ensure_ascii=False))
    else:
        emit(system_text(system, with_keys=arguments.keys))
    return 0


def _other(written: str, layers: Layers) -> Plan:
    """Return the plan to compare with: a saved one, or that of a robot's file with these layers."""
    if not written.endswith(SAVED):
        _, plan = without_errors(compile_robot(written, **layers))
        return plan
    try:
        return load(read_regular(Path(written), ALL_BYTES).decode("utf-8"))
    except (OSError, UnicodeDecodeError, PlanTextError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise NotDoneError(NO_PLAN.at(None, f"'{written}' cannot be read as a plan: {reason}")) from error
