"""Show what would run: processes, components in start order, their topics; or the changes to a plan.

Exit codes: 0 fine, 1 errors found, 2 wrong usage.
"""

import argparse
import json
import os
import sys
from pathlib import Path

from rbxcompose.base.files import read_regular
from rbxcompose.base.findings import Finding, kind
from rbxcompose.commands.console import FINDINGS, emit, refuse, write_report
from rbxcompose.commands.options import add_unsaved_option, is_system, unsaved_of
from rbxcompose.commands.targets import add_layer_options, add_path_argument, layers_of, robot_path
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.plan.diff import difference
from rbxcompose.compiler.plan.dump import PlanTextError, dump, load
from rbxcompose.compiler.plan.model import Plan
from rbxcompose.manifest.tree import ALL_BYTES
from rbxcompose.tools.inspection.plan_text import plan_text

GROUP = "look"
NO_PLAN = kind("RBX9012")
SAVED = ".json"
USAGE = 2


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
    after = _compiled(path, arguments, is_layered=True)
    if after is None:
        return FINDINGS
    if arguments.diff is None:
        emit(dump(after).rstrip("\n") if arguments.json else plan_text(after, with_keys=arguments.keys))
        return 0
    before = _other(arguments.diff, arguments)
    if before is None or isinstance(before, Finding):
        return refuse(before) if before else FINDINGS
    found = difference(before, after)
    emit(json.dumps(found.data(), indent=2, ensure_ascii=False) if arguments.json else found.text())
    return 0


def _show_system(path: str, arguments: argparse.Namespace) -> int:
    from rbxcompose.compiler.systems.reader import compile_system
    from rbxcompose.tools.inspection.plan_text import system_data, system_text  # only needed for systems

    if arguments.diff is not None or arguments.overlays or arguments.sets:
        sys.stderr.write("rbxcompose plan: --diff, -f and --set are for robots, not for systems\n")
        return USAGE
    system = compile_system(
        path, environment=os.environ, real=arguments.real, profiles=arguments.profile, unsaved=unsaved_of(arguments)
    )
    write_report(system.report, system.sources)
    if system.report.has_errors:
        return FINDINGS
    if arguments.json:
        emit(json.dumps(system_data(system), indent=2, ensure_ascii=False))
    else:
        emit(system_text(system, with_keys=arguments.keys))
    return 0


def _compiled(path: str, arguments: argparse.Namespace, *, is_layered: bool) -> Plan | None:
    """Return the plan of a robot; on errors, report them and return None."""
    layers = layers_of(arguments)
    if not is_layered:
        layers = {**layers, "profiles": (), "overlays": (), "sets": ()}
    compilation = compile_robot(path, **layers)
    write_report(compilation.report, compilation.sources)
    return None if compilation.report.has_errors else compilation.plan


def _other(written: str, arguments: argparse.Namespace) -> Plan | Finding | None:
    """Return the plan to compare with: a saved one, or that of a robot's file alone."""
    if not written.endswith(SAVED):
        return _compiled(written, arguments, is_layered=False)
    try:
        return load(read_regular(Path(written), ALL_BYTES).decode("utf-8"))
    except (OSError, UnicodeDecodeError, PlanTextError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        return NO_PLAN.at(None, f"'{written}' cannot be read as a plan: {reason}")
