"""Run the tests of missions, in virtual time.

PATH is a test or a folder with tests below it; without one it is `missions/`. Exit codes: 0 all passed, 1 a test failed
or has errors, 2 wrong usage.
"""

import argparse
import json
import os
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from rbxcompose.base.files import replace_file
from rbxcompose.base.findings import Report
from rbxcompose.base.printable import plain
from rbxcompose.commands.console import FINDINGS, emit, has_colour, misused, write_report
from rbxcompose.commands.options import add_unsaved_option, unsaved_of
from rbxcompose.commands.targets import tests_of
from rbxcompose.manifest.files import shown_name
from rbxcompose.manifest.tree import text_at
from rbxcompose.missions.view.tested import keep_tested
from rbxcompose.tools.mission_tests.coverage import Coverage
from rbxcompose.tools.mission_tests.reader import TrialReader, WrittenTrial
from rbxcompose.tools.mission_tests.report import FileOutcome, TrialWriter, as_json, coverage_text, junit
from rbxcompose.tools.mission_tests.runner import run_trial

GROUP = "missions"
HERE = Path("missions")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "paths", nargs="*", type=Path, default=[HERE], metavar="PATH", help="tests, or folders of tests"
    )
    add_unsaved_option(parser)
    parser.add_argument("--filter", default="", metavar="TEXT", help="only those with this text in their names")
    parser.add_argument(
        "--coverage", action="store_true", help="show what no test covered, here and on the console's page"
    )
    parser.add_argument("--junit", type=Path, metavar="FILE", help="write the results as JUnit XML")
    parser.add_argument("-v", "--verbose", action="store_true", help="show the traces of all tests")
    parser.add_argument("--json", action="store_true", help="write JSON")


def run(arguments: argparse.Namespace) -> int:
    """Read, run and judge the tests, and report the results."""
    for path in arguments.paths:
        if not path.exists():
            return misused("test", f"there is no '{plain(str(path))}'")
    files = tests_of(arguments.paths)
    if not files:
        return misused("test", f"no tests ('kind: Test') in {plain(', '.join(map(str, arguments.paths)))}")
    if problem := _save(arguments):  # now, and not after all tests have run
        return problem
    reading = TrialReader(os.environ, unsaved_of(arguments))
    coverage, writer = Coverage(), TrialWriter(has_colour(sys.stdout))
    outcomes: list[FileOutcome] = []
    unreadable = Report()
    for written in (each for file in files for each in reading.every(file)):
        began = time.perf_counter()
        if arguments.filter not in written.name:
            unreadable.extend(() if written.root else written.report)
            continue
        outcome = outcome_of(written, reading, coverage, began)
        outcomes.append(outcome)
        if not arguments.json:
            _tell(outcome, writer, arguments.verbose)
    write_report(_findings(reading, outcomes) if outcomes else unreadable, reading.sources)
    if not outcomes:
        return misused("test", f"no test has '{plain(arguments.filter)}' in its name")
    problem = _save(arguments, junit(outcomes))
    _finish(outcomes, coverage, writer, arguments)
    return problem or (0 if all(file_outcome.passed for file_outcome in outcomes) else FINDINGS)


def _save(arguments: argparse.Namespace, results: str | None = None) -> int:
    """Write the results for `--junit`, or try whether they can be; return the exit code if they cannot, else 0."""
    file: Path | None = arguments.junit
    try:
        if file is not None and results is None:
            if not file.exists():
                file.touch()
                file.unlink()
        elif file is not None and results is not None:
            if file.exists() and not file.is_file():
                file.write_text(results, encoding="utf-8")  # such as to a pipe
            else:
                replace_file(file.resolve(), results.encode())
    except OSError as error:
        return misused("test", f"'{plain(str(file))}' cannot be written: {error.strerror}")
    return 0


def outcome_of(written: WrittenTrial, reading: TrialReader, coverage: Coverage, began: float) -> FileOutcome:
    """Run a test, add the ways that it took to what is covered, and return what came of it."""
    trial = reading.understand(written)
    compiled = time.perf_counter()
    out = FileOutcome(
        shown_name(written.path),
        written.name,
        tuple(written.report),
        took=compiled - began,
        mission=text_at(written.root, ("mission",)),
    )
    if trial is None:
        return out
    verdict = run_trial(trial)
    coverage.add(verdict.trial.linked, verdict.trial.names, verdict.seen.keys, verdict.trial.plan.robot)
    return replace(out, verdict=verdict, took=time.perf_counter() - compiled)


def _tell(outcome: FileOutcome, writer: TrialWriter, verbose: bool) -> None:
    emit(writer.line(outcome))
    if outcome.verdict and (verbose or not outcome.passed):
        emit(writer.trace(outcome.verdict))


def _findings(reading: TrialReader, outcomes: Sequence[FileOutcome]) -> Report:
    return Report(
        [*reading.report, *reading.summed_up(finding for outcome in outcomes for finding in outcome.findings)]
    )


def _finish(
    outcomes: Sequence[FileOutcome], coverage: Coverage, writer: TrialWriter, arguments: argparse.Namespace
) -> None:
    if arguments.coverage and not unsaved_of(arguments):  # what is kept is of the files
        for robot, missions in coverage.by_robot(time.time()).items():
            with suppress(OSError):  # such as on a machine that is read only: it is shown here all the same
                keep_tested(robot, missions)
    if arguments.json:
        emit(json.dumps(as_json(outcomes, coverage), indent=1))
        return
    if arguments.coverage and coverage.ways:
        emit(coverage_text(coverage))
    emit(writer.summary(outcomes, coverage))
