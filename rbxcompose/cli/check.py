"""Report every error of a robot before a motor moves.

PATH is a robot's file or folder, a folder with robots or tests below it, a test, a system, or a mission or part: it
checks the robots of the project that use it. Check an overlay on a robot: check ROBOT -f FILE. Exit codes: 0 fine, 1
errors found (with --strict also warnings), 2 wrong usage.
"""

from __future__ import annotations

import argparse
import os
import sys
from dataclasses import field
from pathlib import Path

from rbxcompose.cli.output.console import FINDINGS, good, has_colour, tell
from rbxcompose.cli.project.fixes import fix, only_ours
from rbxcompose.cli.project.robot_options import add_layer_options, compiled
from rbxcompose.cli.project.targets import Targets, projects_of, targets
from rbxcompose.compiler import Compilation
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Report
from rbxcompose.formats import format_names, renderer
from rbxcompose.plan.model import Plan, extent

TEXT = "text"
FOR_PEOPLE = (TEXT, "github")  # formats that may contain lines without a finding


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("paths", nargs="*", default=["."], metavar="PATH", help="what to check; else the robots here")
    add_layer_options(parser)
    parser.add_argument("--format", choices=format_names(), default=TEXT, help="output format")
    parser.add_argument("--strict", action="store_true", help="count warnings as errors")
    parser.add_argument("--fix", action="store_true", help="fix what is certain, in the files")


@dataclass(slots=True)
class CheckedRobots:
    """The findings of all robots together; `fine` has the plans of those that can run."""

    report: Report = field(default_factory=Report)
    sources: dict[str, str] = field(default_factory=dict)
    fine: list[Plan] = field(default_factory=list)
    tests: list[str] = field(default_factory=list)  # names of the tests that can run
    systems: list[str] = field(default_factory=list)  # systems that can run, in words

    def add(self, one: Compilation) -> None:
        """Add the findings of one robot."""
        self.report.extend(one.report)
        self.sources.update(one.sources)
        if one.plan is not None:
            self.fine.append(one.plan)


def run(arguments: argparse.Namespace) -> int:
    """Compile the robots, apply fixes if requested, and write the findings to stdout."""
    wanted = targets(arguments.paths)
    if arguments.fix:
        fix(lambda: _check(wanted, arguments), tell if arguments.format == TEXT else _whisper)
    checked = _check(wanted, arguments)
    tell(_written(checked, arguments.format).rstrip("\n"))
    is_wrong = checked.report.has_errors or (arguments.strict and any(checked.report))
    return FINDINGS if is_wrong else 0


def _check(wanted: Targets, arguments: argparse.Namespace) -> CheckedRobots:
    checked = CheckedRobots()
    for robot in wanted.robots:
        checked.add(compiled(robot, arguments))
    for robot in wanted.users:
        one = compiled(robot, arguments)
        if any(file in one.sources for file in wanted.files):
            checked.add(one)
    if wanted.tests:
        _check_tests(wanted.tests, checked)
    for path in wanted.systems:
        _check_system(path, arguments, checked)
    projects = projects_of([*wanted.robots, *wanted.users, *wanted.tests, *wanted.systems])
    checked.report = Report([*only_ours(checked.report, checked.sources, projects), *wanted.unused(checked.sources)])
    return checked


def _check_tests(tests: list[str], checked: CheckedRobots) -> None:
    from rbxcompose.mission_tests.reader import TrialReader  # only needed for tests

    reading, found = TrialReader(os.environ), Report()
    for path in tests:
        trial, report = reading.read(Path(path).resolve())
        found.extend(report)
        if trial is not None:
            checked.tests.append(trial.name)
    checked.report.extend([*reading.report, *reading.summed_up(found)])
    checked.sources.update(reading.sources)


def _check_system(path: str, arguments: argparse.Namespace, checked: CheckedRobots) -> None:
    from rbxcompose.inspection.system_text import system_extent  # only needed for systems
    from rbxcompose.systems.reader import compile_system

    system = compile_system(path, environment=os.environ, real=arguments.real, profiles=arguments.profile)
    tried = [] if arguments.profile else [(name,) for name in system.known_profiles]
    all_ = [system, *(compile_system(path, environment=os.environ, real=arguments.real, profiles=one) for one in tried)]
    for one in all_:
        known = {(each.code, each.span, each.message) for each in checked.report}
        checked.report.extend(each for each in one.report if (each.code, each.span, each.message) not in known)
        checked.sources.update(one.sources)
    if not any(one.report.has_errors for one in all_):
        checked.systems.append(f"{system.name} is fine: {system_extent(system)}")


def _written(checked: CheckedRobots, form: str) -> str:
    if any(checked.report) or form not in FOR_PEOPLE:
        return renderer(form)(checked.report, checked.sources, has_colour(sys.stdout))
    lines = [f"{plan.robot} is fine: {extent(len(plan.instances), len(plan.groups))}" for plan in checked.fine]
    lines += [f"the test {name} is fine" for name in checked.tests]
    return "\n".join(map(good, [*lines, *checked.systems]))


def _whisper(text: str) -> None:
    """Write to stderr, beside output that a program reads."""
    sys.stderr.write(f"{text}\n")
