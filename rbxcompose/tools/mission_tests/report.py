"""The report of tests: a line each, a trace of each failure, a summary; JUnit XML."""

from collections.abc import Iterator, Sequence
from typing import Any
from xml.etree import ElementTree

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Severity
from rbxcompose.base.levels import Level
from rbxcompose.base.printable import FORBIDDEN, plain
from rbxcompose.tools.mission_tests.coverage import Coverage
from rbxcompose.tools.mission_tests.judge import UnmetExpectation
from rbxcompose.tools.mission_tests.record import TrialRecord
from rbxcompose.tools.mission_tests.runner import Verdict

MOST_LINES = 60  # of a trace; the middle of a longer one is left out
MARK = ">>>"  # precedes what is not as expected
_COLOURS = {"pass": "\x1b[32m", "fail": "\x1b[1;31m", "time": "\x1b[2m", "warn": "\x1b[33m"}
_RESET = "\x1b[0m"


@dataclass(frozen=True, slots=True)
class FileOutcome:
    """The result of one file: a verdict, or the findings that kept it from running; `took` is real time [s].

    `mission` is the one that the file names; empty if the file cannot be read.
    """

    file: str
    name: str
    findings: tuple[Finding, ...] = ()
    verdict: Verdict | None = None
    took: float = 0.0
    mission: str = ""

    @property
    def passed(self) -> bool:
        """Return whether the test ran and all was as expected."""
        return self.verdict is not None and self.verdict.passed

    @property
    def robot_time(self) -> float:
        """Return how long the robot ran [s]."""
        return self.verdict.record.now if self.verdict else 0.0


class TrialWriter:
    """Writes for people; with `colour`, for a terminal."""

    def __init__(self, colour: bool = False) -> None:
        self.colour = colour

    def paint(self, style: str, text: str) -> str:
        """Return a text in a colour."""
        return f"{_COLOURS[style]}{text}{_RESET}" if self.colour else text

    def line(self, outcome: FileOutcome) -> str:
        """Return the one line on a test."""
        word = self.paint("pass", "passed") if outcome.passed else self.paint("fail", "FAILED")
        robot_time = f", {outcome.robot_time:.1f} s of robot time" if outcome.verdict else ""
        times = f"{outcome.took * 1e3:.0f} ms{robot_time}"
        return f"{word}  {plain(outcome.name) or '?'}  {self.paint('time', f'({plain(outcome.file)}, {times})')}"

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
        shown = text if line.level is Level.OK else self.paint("warn", text)
        return f"  {self.paint('time', f'{line.time:9.2f}')}  {shown}"

    def _problem(self, problem: UnmetExpectation) -> str:
        where = f"  [{plain(problem.span.file)}:{problem.span.line}]" if problem.span else ""
        return f"  {self.paint('fail', f'{MARK:>9}  {plain(problem.message)}')}{where}"

    def summary(self, outcomes: Sequence[FileOutcome], coverage: Coverage) -> str:
        """Return how many tests passed, and how many paths of the missions were taken."""
        failed = sum(not outcome.passed for outcome in outcomes)
        took = sum(outcome.took for outcome in outcomes)
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
        "tests": [_test(outcome) for outcome in outcomes],
        "coverage": {
            "ways": len(coverage.ways),
            "taken": len(coverage.taken),
            "missing": [
                {"mission": way.mission, "file": way.span.file, "line": way.span.line, "way": way.text}
                for way in coverage.missing
            ],
        },
    }


def _test(outcome: FileOutcome) -> dict[str, Any]:
    problems = outcome.verdict.problems if outcome.verdict else []
    findings = [finding for finding in outcome.findings if finding.severity is Severity.ERROR]
    lines = outcome.verdict.record.lines if outcome.verdict else []
    return {
        "name": outcome.name,
        "file": outcome.file,
        "passed": outcome.passed,
        "milliseconds": round(outcome.took * 1e3, 3),
        "robot_time": outcome.robot_time,
        "outcome": outcome.verdict.record.outcome if outcome.verdict else "",
        "problems": [
            *({"message": p.message, "place": str(p.span or "")} for p in problems),
            *({"message": f.message, "place": str(f.span or ""), "code": f.code} for f in findings),
        ],
        "trace": [{"time": line.time, "text": line.text} for line in lines],
    }


def junit(outcomes: Sequence[FileOutcome]) -> str:
    """Return one suite with a case for each test; what kept a test from running is an error, the rest a failure."""
    failed = sum(1 for outcome in outcomes if outcome.verdict and not outcome.passed)
    counts = {"tests": len(outcomes), "failures": failed, "errors": sum(not outcome.verdict for outcome in outcomes)}
    numbers = {key: str(value) for key, value in counts.items()}
    took = f"{sum(outcome.took for outcome in outcomes):.3f}"
    root = ElementTree.Element("testsuites", {"name": "rbxcompose test", "time": took, **numbers})
    suite = ElementTree.SubElement(root, "testsuite", {"name": "missions", "time": took, **numbers})
    for outcome in outcomes:
        name, file = _fit(outcome.name or outcome.file), _fit(outcome.file)
        about = {
            "name": name,
            "classname": _fit(outcome.mission or outcome.file),
            "time": f"{outcome.took:.3f}",
            "file": file,
        }
        case = ElementTree.SubElement(suite, "testcase", about)
        if outcome.verdict and not outcome.passed:
            messages = [problem.message for problem in outcome.verdict.problems]
            _add(case, "failure", messages[0], TrialWriter().trace(outcome.verdict))
        elif not outcome.verdict:
            words = "\n".join(f"{finding.span or ''} {finding.message}" for finding in outcome.findings)
            _add(case, "error", "the test has errors", words)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _add(case: ElementTree.Element, tag: str, message: str, text: str) -> None:
    ElementTree.SubElement(case, tag, message=_fit(message)).text = _fit(text)


def _fit(text: str) -> str:
    """Return a text without characters that XML cannot hold, or that would change how a reader of it shows the text."""
    return FORBIDDEN.sub("?", text)
