"""The output of commands: answers go to stdout, errors to stderr; and what interrupts them.

With `--json`, stdout has JSON in any case: errors without an answer are one document, too, besides the text on stderr.
Interrupts are Ctrl-C, SIGTERM, and the end of the terminal.
"""

import argparse
import json
import os
import re
import signal
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import field
from types import FrameType
from typing import Any, NoReturn, TextIO

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Report, Severity, Sources
from rbxcompose.base.printable import plain
from rbxcompose.commands.formats.text import render_text

FINDINGS, USAGE, INTERRUPTED = 1, 2, 130  # exit codes
ENDINGS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_OF_OTHERS = {"list": "ls", "info": "show"}  # actions as ROS 2 calls them
_ROBOT = "--robot"
_NO_ACTION = re.compile(r"-(?!h$|-help$)|.*[./]")  # an option, a path or a type


@dataclass(slots=True)
class Output:
    """The output of one command so far: whether its answer has begun, else what is wrong."""

    has_begun: bool = False
    misuse: str = ""
    findings: list[Finding] = field(default_factory=list)
    sources: dict[str, str] = field(default_factory=dict)

    def note(self, report: Report, sources: Sources) -> None:
        """Keep reported findings."""
        self.findings.extend(report)
        self.sources.update(sources)

    @property
    def error(self) -> str:
        """Return what is wrong in one line; empty if nothing is."""
        errors = (finding.message for finding in Report(self.findings) if finding.severity is Severity.ERROR)
        return self.misuse or next(errors, "")

    def data(self) -> dict[str, object]:
        """Return what is wrong, for JSON."""
        from rbxcompose.commands.formats.json_ import as_data  # only needed for JSON

        return {"error": self.error, "findings": [as_data(finding, self.sources) for finding in Report(self.findings)]}


_commands = [Output()]  # the running command is last; no thread-local variable, since all of its threads report


def output() -> Output:
    """Return the output of the running command."""
    return _commands[-1]


@contextmanager
def answered(in_json: bool) -> Iterator[None]:
    """Run a command; with `in_json`, write what is wrong to stdout if nothing else was written there."""
    _commands.append(Output())
    try:
        yield
    finally:
        finished = _commands.pop()
        if in_json and finished.error and not finished.has_begun:
            sys.stdout.write(f"{json.dumps(finished.data())}\n")


def misused(verb: str, problem: str) -> int:
    """Report wrong usage of a command, and return the exit code for it."""
    output().misuse = problem
    sys.stderr.write(f"rbxcompose {verb}: {problem}\n")
    return USAGE


def has_colour(stream: TextIO) -> bool:
    """Return whether to use colours: on a terminal, unless `NO_COLOR` is set."""
    return stream.isatty() and not os.environ.get("NO_COLOR")


def good(text: str) -> str:
    """Return a line of good news, green where stdout shows colours."""
    return f"\x1b[32m{text}\x1b[0m" if has_colour(sys.stdout) else text


class UnwritableError(OSError):
    """Raised when stdout takes nothing any more, as on a full disk."""


def emit(text: str) -> None:
    """Write lines to stdout and flush.

    Raises:
        BrokenPipeError: if nobody reads any more.
        UnwritableError: if they cannot be written.
    """
    output().has_begun = True
    try:
        sys.stdout.write(f"{text}\n")
        sys.stdout.flush()
    except BrokenPipeError:
        raise
    except OSError as error:
        raise UnwritableError(*error.args) from error


def write_report(report: Report, sources: Sources) -> None:
    """Write all findings to stderr."""
    output().note(report, sources)
    sys.stderr.write(render_text(report, sources, has_colour(sys.stderr)))
    sys.stderr.flush()


def refuse(finding: Finding) -> int:
    """Write one finding to stderr and return the exit code for it."""
    write_report(Report([finding]), {})
    return FINDINGS


class Parser(argparse.ArgumentParser):
    """Parses the words after a verb; what it refuses is noted as well.

    A quantity below zero, `-90deg`, is a value and not an option. Without an action, the default of `action` is
    carried out: `diag --json` is `diag tree --json`, `arm robots/mini` is `arm ls robots/mini`, and `diag turtlebot` is
    `diag tree --robot turtlebot` if a robot of this name is up. Actions may be called as ROS 2 does: `topic list`.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._negative_number_matcher = re.compile(r"-\.?\d")  # by itself, it knows only numbers without a unit
        self._why = ""  # why the first word is no robot, if it is no action either

    def parse_known_args(self, args: Iterable[str] | None = None, namespace: Any = None) -> tuple[Any, list[str]]:
        """Parse words, with the usual action before them if they begin with none: a plain word is a misspelt one."""
        words = list(sys.argv[1:] if args is None else args)
        if usual := self.get_default("action"):
            groups = self._subparsers._group_actions if self._subparsers else ()
            actions = {str(name): parser for group in groups for name, parser in dict(group.choices or {}).items()}
            if words and words[0] not in actions and _OF_OTHERS.get(words[0]) in actions:
                words[0] = _OF_OTHERS[words[0]]
            if not words or _NO_ACTION.match(words[0]):
                words.insert(0, usual)
            elif words[0] not in actions:
                takes_name = _ROBOT in actions[usual]._option_string_actions
                if _is_robot(words[0]):
                    words[:0] = [usual, _ROBOT] if takes_name else [usual]
                elif takes_name:
                    self._why = f"; and no robot {words[0]!r} is up"
        return super().parse_known_args(words, namespace)

    def error(self, message: str) -> NoReturn:
        """Note the error, report it with the usage, and end the command."""
        output().misuse = f"{message}{self._why}"
        super().error(output().misuse)


def _is_robot(word: str) -> bool:
    from rbxcompose.runtime.folder import RobotFolder  # which verbs that need no robot do not import

    return RobotFolder.of(word).is_known


class NotDoneError(Exception):
    """Raised with the finding that says why a verb cannot be carried out; `main` reports it."""

    def __init__(self, finding: Finding) -> None:
        super().__init__(finding.message)
        self.finding = finding


class ReportedError(Exception):
    """Raised with the exit code when a verb cannot be carried out, after the reasons have been written."""

    def __init__(self, exit_code: int = FINDINGS) -> None:
        super().__init__(exit_code)
        self.exit_code = exit_code


@contextmanager
def handling(handle: Callable[[int, FrameType | None], None], numbers: Sequence[int] = ENDINGS) -> Iterator[None]:
    """Let signals call `handle`; at the end they do what they did before."""
    before = {number: signal.signal(number, handle) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def noted_interrupts() -> Iterator[list[int]]:
    """Yield a list to which interrupts are added; they do not end the process meanwhile."""
    interrupts: list[int] = []
    with handling(lambda number, frame: interrupts.append(number)):
        yield interrupts


def table(rows: Sequence[Sequence[str]]) -> str:
    """Return rows of cells as lines in aligned columns; make foreign names safe for a terminal."""
    cells = [[plain(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in cells
    )
