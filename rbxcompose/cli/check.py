"""Tell every mistake of a robot before a motor moves.

Exit codes: 0 fine, 1 errors found, 2 wrong usage. Warnings do not count.
"""

from __future__ import annotations

import argparse
import os
import sys

from rbxcompose.cli.common.telling import FINDINGS, has_colour, tell
from rbxcompose.compiler import Compilation, compile_robot
from rbxcompose.rendering import render_json, render_text

FORMATS = ("text", "json")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("path", metavar="PATH", help="the robot's file, its folder, or rbx:robots/NAME of the library")
    parser.add_argument("--profile", action="append", default=[], metavar="P", help="put this profile on top")
    parser.add_argument("--set", action="append", default=[], dest="sets", metavar="K=V", help="change one value")
    parser.add_argument("--real", action="store_true", help="check for the real devices, not for the simulation")
    parser.add_argument("--format", choices=FORMATS, default="text", help="how findings are written")


def run(arguments: argparse.Namespace) -> int:
    """Compile the robot and write its findings to stdout."""
    out = compile_robot(
        arguments.path, profiles=arguments.profile, sets=arguments.sets, real=arguments.real, environment=os.environ
    )
    tell(_written(out, arguments.format).rstrip("\n"))
    return FINDINGS if out.report.has_errors else 0


def _written(out: Compilation, form: str) -> str:
    if form == "json":
        return render_json(out.report)
    if out.plan is None or list(out.report):
        return render_text(out.report, out.sources, has_colour(sys.stdout))
    groups = len(out.plan.groups)
    return f"{out.plan.robot} is fine: {len(out.plan.instances)} components in {groups} processes"
