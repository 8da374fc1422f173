"""Report every error of a robot before a motor moves.

PATH is a project, a robot's file or folder, a folder with robots or tests below it, a test, a system, or a mission or
part: it checks the robots of the project that use it. An overlay is checked on the robot beside it, else: check ROBOT
-f FILE.
Exit codes: 0 fine, 1 errors found (with --strict also warnings), 2 wrong usage.
"""

import argparse
import os
import re
import sys
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import field, replace
from pathlib import Path

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import read_regular, replace_file
from rbxcompose.base.findings import Finding, Fix, Report, Sources, apply_fixes, nearest, safe_fixes
from rbxcompose.base.printable import plain
from rbxcompose.commands.console import FINDINGS, emit, good, has_colour, misused
from rbxcompose.commands.formats import format_names, renderer
from rbxcompose.commands.options import add_unsaved_option, unsaved_of
from rbxcompose.commands.targets import add_layer_options, compiled, projects_of, targets
from rbxcompose.compiler.compile import Compilation
from rbxcompose.compiler.plan.model import Plan, extent
from rbxcompose.manifest.documents import KINDS
from rbxcompose.manifest.tree import FILE_BYTES

GROUP = "write"
IS_COMMON = True
TEXT = "text"
FOR_PEOPLE = (TEXT, "github")  # formats that may contain lines without a finding
_KIND = re.compile(r"^[ \t]*+(?:[{,]\s*+|\{[^\n]*?,\s*+)?+['\"]?kind['\"]?\s*+:\s*+['\"]?(\w++)", re.MULTILINE)
ROUNDS = 20  # one fix may reveal the next mistake
_WORDS = 200  # characters of a title


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("paths", nargs="*", default=["."], metavar="PATH", help="what to check; else the project here")
    add_layer_options(parser)
    add_unsaved_option(parser)
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

    def add(self, compilation: Compilation) -> None:
        """Add the findings of one robot."""
        self.report.extend(compilation.report)
        self.sources.update(compilation.sources)
        if compilation.plan is not None:
            self.fine.append(compilation.plan)


def run(arguments: argparse.Namespace) -> int:
    """Compile the robots, apply fixes if requested, and write the findings to stdout."""
    if arguments.fix and arguments.unsaved:
        return misused("check", "--fix changes files, and --unsaved is for texts that are in none: use one of them")
    if arguments.fix:
        fix(lambda: _check(arguments), emit if arguments.format == TEXT else _whisper)
    checked = _check(arguments)
    emit(_written(checked, arguments.format).rstrip("\n"))
    is_wrong = checked.report.has_errors or (arguments.strict and any(checked.report))
    return FINDINGS if is_wrong else 0


def _check(arguments: argparse.Namespace) -> CheckedRobots:
    checked, wanted = CheckedRobots(), targets(arguments.paths)
    for robot in wanted.robots:
        checked.add(compiled(robot, arguments, tries_profiles=True))
    for robot, overlay in wanted.overlays:
        one = compiled(robot, arguments, overlay, tries_profiles=True)
        one.report = Report(checked.report.new_among(one.report))
        checked.add(one)
    for robot in wanted.users:
        one = compiled(robot, arguments, tries_profiles=True)
        if any(file in one.sources for file in wanted.files):
            checked.add(one)
    if wanted.tests:
        _check_tests(wanted.tests, arguments, checked)
    for path in wanted.systems:
        _check_system(path, arguments, checked)
    on_robots = [robot for robot, _ in wanted.overlays]
    projects = projects_of([*wanted.robots, *on_robots, *wanted.users, *wanted.tests, *wanted.systems, *wanted.files])
    checked.report.extend(wanted.unused(checked.sources, unsaved_of(arguments)))
    checked.report = Report([*only_ours(checked.report, checked.sources, projects)])
    return checked


def _check_tests(tests: list[str], arguments: argparse.Namespace, checked: CheckedRobots) -> None:
    from rbxcompose.tools.mission_tests.reader import TrialReader  # only needed for tests

    reading, found = TrialReader(os.environ, unsaved_of(arguments)), Report()
    for path in tests:
        trial, report = reading.read(Path(path).absolute())
        found.extend(report)
        if trial is not None:
            checked.tests.append(trial.name)
    checked.report.extend([*reading.report, *reading.summed_up(found)])
    checked.sources.update(reading.sources)


def _check_system(path: str, arguments: argparse.Namespace, checked: CheckedRobots) -> None:
    from rbxcompose.compiler.systems.reader import compile_system
    from rbxcompose.tools.inspection.plan_text import system_extent  # only needed for systems

    chosen, unsaved = arguments.profile, unsaved_of(arguments)
    system = compile_system(
        path, environment=os.environ, real=arguments.real, profiles=chosen, unsaved=unsaved, tries_profiles=True
    )
    checked.report.extend(checked.report.new_among(system.report))
    checked.sources.update(system.sources)
    if not system.report.has_errors:
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


PrintLine = Callable[[str], None]


def fix(check: Callable[[], CheckedRobots | Compilation], say: PrintLine) -> None:
    """Check, apply and report all safe fixes, and repeat until none is left."""
    for _ in range(ROUNDS):
        checked = check()
        fixes = safe_fixes(checked.report, checked.sources)
        if not fixes or not _apply(fixes, checked.sources, say):
            return
    say(f"stopped after {ROUNDS} rounds: each fix leads to another")


def only_ours(findings: Iterable[Finding], sources: Sources, projects: Collection[Path]) -> Iterator[Finding]:
    """Yield the findings, but drop fixes that would change a file outside of `projects`, or one that is not ours."""
    for finding in findings:
        is_ours = finding.fix is None or _is_ours(finding.fix, sources, projects)
        yield finding if is_ours else replace(finding, fix=None)


def _is_ours(one: Fix, sources: Sources, projects: Collection[Path]) -> bool:
    files = {edit.span.file for edit in one.edits}
    if not all(_has_known_kind(sources[file]) for file in files if file in sources):
        return False
    paths = {Path(file).resolve() for file in files}
    return all(any(path.is_relative_to(project) for project in projects) for path in paths)


def _has_known_kind(text: str) -> bool:
    """Return whether a text is XML, which a robot names as its body, or a manifest of a kind that there is."""
    if text.lstrip().startswith("<"):
        return True
    written = _KIND.search(text)
    return written is not None and bool(nearest(written[1], KINDS))  # a misspelt one may be corrected


def _apply(fixes: list[Fix], sources: Sources, say: PrintLine) -> bool:
    """Write fixes and return whether any file has changed."""
    texts = {}
    for file in dict.fromkeys(edit.span.file for one in fixes for edit in one.edits):
        text = _unchanged_text(file, sources[file])
        if text is None:
            say(f"left {plain(file)} as it is: it has changed since it was read, or can no longer be read")
        else:
            texts[file] = text
    out = apply_fixes(fixes, texts)
    written = {file for file, text in out.texts.items() if text != texts[file] and _write(file, text, say)}
    for one in out.done:
        if all(edit.span.file in written for edit in one.edits):
            say(f"fixed {_shown(one)}")
    for one in out.postponed:
        say(f"not yet {_shown(one)}: it overlaps with another fix")
    return bool(written)


def _shown(one: Fix) -> str:
    first = next(edit for edit in one.edits if edit.text != edit.old)
    return f"{plain(str(first.span))}: {plain(one.title, _WORDS)}"


def _unchanged_text(file: str, read: str) -> str | None:
    """Return the text of a file with its byte order mark and line ends; None if it differs from what was read."""
    try:
        text = read_regular(Path(file), FILE_BYTES).decode("utf-8")
    except (OSError, UnicodeDecodeError):
        return None
    return text if text.removeprefix("\ufeff").replace("\r\n", "\n") == read else None


def _write(file: str, text: str, say: PrintLine) -> bool:
    try:
        replace_file(Path(file).resolve(), text.encode("utf-8"))
    except OSError as error:
        say(f"left {plain(file)} as it is: {error.strerror}")
        return False
    return True
