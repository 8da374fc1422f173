"""The report of tests: one line each, a trace of each failure, a summary, the paths not covered; text and JSON."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Finding, Severity
from rbxcompose.levels import Level
from rbxcompose.mission_tests.coverage import Coverage
from rbxcompose.mission_tests.judge import UnmetExpectation
from rbxcompose.mission_tests.record import TrialRecord
from rbxcompose.mission_tests.runner import Verdict
from rbxcompose.printable import plain

MOST_LINES = 60  # of a trace; the middle of a longer one is left out
MARK = ">>>"  # precedes what is not as expected
_COLOURS = {"pass": "\x1b[32m", "fail": "\x1b[1;31m", "time": "\x1b[2m", "warn": "\x1b[33m"}
_RESET = "\x1b[0m"


@dataclass(frozen=True, slots=True)
class FileOutcome:
    """The result of one file: a verdict, or the findings that kept it from running; `took` is real time [s]."""

    file: str
    name: str
    findings: tuple[Finding, ...] = ()
    verdict: Verdict | None = None
    took: float = 0.0

    @property
    def passed(self) -> bool:
        """Return whether the test ran and all was as expected."""
        return self.verdict is not None and self.verdict.passed

    @property
    def robot_time(self) -> float:
        """Return how long the robot ran [s]."""
        return self.verdict.record.now if self.verdict else 0.0


class Teller:
    """Writes for people; with `colour`, for a terminal."""

    def __init__(self, colour: bool = False) -> None:
        self.colour = colour

    def paint(self, style: str, text: str) -> str:
        """Return a text in a colour."""
        return f"{_COLOURS[style]}{text}{_RESET}" if self.colour else text

    def line(self, one: FileOutcome) -> str:
        """Return the one line on a test."""
        word = self.paint("pass", "passed") if one.passed else self.paint("fail", "FAILED")
        times = f"{one.took * 1e3:.0f} ms" + (f", {one.robot_time:.1f} s of robot time" if one.verdict else "")
        return f"{word}  {plain(one.name) or '?'}  {self.paint('time', f'({plain(one.file)}, {times})')}"

    def trace(self, verdict: Verdict) -> str:
        """Return the trace, with each problem after the line that it concerns."""
        record = verdict.record
        placed: dict[int, list[UnmetExpectation]] = {}
        for problem in verdict.problems:
            line = len(record.lines) - 1 if problem.line is None else problem.line
            placed.setdefault(line, []).append(problem)
        shown = _shown(len(record.lines), placed)
        lines = [self._problem(problem) for problem in placed.get(-1, [])]
        before = -1
        for index in shown:
            if index != before + 1:
                lines.append(f"  {'':>9}  ... {index - before - 1} more lines")
            lines.append(self._step(record, index))
            lines += [self._problem(problem) for problem in placed.get(index, [])]
            before = index
        return "\n".join(lines)

    def _step(self, record: TrialRecord, index: int) -> str:
        line = record.lines[index]
        text = plain(line.text)
        told = text if line.level is Level.OK else self.paint("warn", text)
        return f"  {self.paint('time', f'{line.time:9.2f}')}  {told}"

    def _problem(self, problem: UnmetExpectation) -> str:
        where = f"  [{plain(problem.span.file)}:{problem.span.line}]" if problem.span else ""
        return f"  {self.paint('fail', f'{MARK:>9}  {plain(problem.message)}')}{where}"

    def summary(self, outcomes: Sequence[FileOutcome], coverage: Coverage) -> str:
        """Return how many tests passed, and how many paths of the missions were taken."""
        failed = sum(not one.passed for one in outcomes)
        took = sum(one.took for one in outcomes)
        counted = f"{len(outcomes) - failed} passed" + (f", {failed} failed" if failed else "")
        lines = [f"{self.paint('fail' if failed else 'pass', counted)} in {took * 1e3:.0f} ms"]
        if coverage.ways:
            share = f"{len(coverage.taken)} of {len(coverage.ways)}"
            rest = "" if not coverage.missing else "; --coverage shows the others"
            lines.append(f"{share} paths of the missions were taken{rest}")
        return "\n".join(lines)


def _shown(count: int, placed: dict[int, list[UnmetExpectation]]) -> Iterator[int]:
    """Yield the lines of a trace to show: all, or for a long one its ends and the lines around the problems."""
    near = {line + offset for line in placed for offset in range(-5, 6)}
    for index in range(count):
        if count <= MOST_LINES or index < MOST_LINES // 2 or index >= count - MOST_LINES // 4 or index in near:
            yield index


def coverage_text(coverage: Coverage) -> str:
    """Return the paths that no test took, by mission, each with its place."""
    lines = []
    for mission in sorted({way.mission for way in coverage.ways}):
        ways = [way for way in coverage.ways if way.mission == mission]
        missing = [way for way in coverage.missing if way.mission == mission]
        lines.append(f"{plain(mission)}: {len(ways) - len(missing)} of {len(ways)} paths taken")
        lines += [f"  {plain(way.span.file)}:{way.span.line}  {plain(way.text)}" for way in missing]
    return "\n".join(lines)


def as_json(outcomes: Sequence[FileOutcome], coverage: Coverage) -> dict[str, Any]:
    """Return the report as data for programs."""
    return {
        "tests": [_test(one) for one in outcomes],
        "coverage": {
            "ways": len(coverage.ways),
            "taken": len(coverage.taken),
            "missing": [
                {"mission": way.mission, "file": way.span.file, "line": way.span.line, "way": way.text}
                for way in coverage.missing
            ],
        },
    }


def _test(one: FileOutcome) -> dict[str, Any]:
    problems = one.verdict.problems if one.verdict else []
    findings = [finding for finding in one.findings if finding.severity is Severity.ERROR]
    lines = one.verdict.record.lines if one.verdict else []
    return {
        "name": one.name,
        "file": one.file,
        "passed": one.passed,
        "milliseconds": round(one.took * 1e3, 3),
        "robot_time": one.robot_time,
        "outcome": one.verdict.record.outcome if one.verdict else "",
        "problems": [
            *({"message": p.message, "place": str(p.span or "")} for p in problems),
            *({"message": f.message, "place": str(f.span or ""), "code": f.code} for f in findings),
        ],
        "trace": [{"time": line.time, "text": line.text} for line in lines],
    }
