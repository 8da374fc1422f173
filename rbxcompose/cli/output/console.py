"""What commands write: answers go to stdout, what is wrong to stderr.

Who asks for JSON gets JSON: what kept a command from its answer is one document too, beside the words on stderr.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import NoReturn, TextIO

from rbxcompose.findings import Finding, Report, Severity, Sources
from rbxcompose.rendering.text import render_text

FINDINGS, USAGE = 1, 2  # exit codes


@dataclass(slots=True)
class Output:
    """What has been told of one command: whether its answer has begun, else what is wrong."""

    has_begun: bool = False
    misuse: str = ""
    findings: list[Finding] = field(default_factory=list)
    sources: dict[str, str] = field(default_factory=dict)

    def note(self, report: Report, sources: Sources) -> None:
        """Keep findings that were told."""
        self.findings.extend(report)
        self.sources.update(sources)

    @property
    def error(self) -> str:
        """Return in a line what is wrong, empty if nothing is."""
        errors = (one.message for one in Report(self.findings) if one.severity is Severity.ERROR)
        return self.misuse or next(errors, "")

    def data(self) -> dict[str, object]:
        """Return what is wrong, for JSON."""
        from rbxcompose.rendering.json_ import as_data  # only for who asks for it

        return {"error": self.error, "findings": [as_data(one, self.sources) for one in Report(self.findings)]}


_commands = [Output()]  # the one that runs is the last; all of its threads tell, so that this is no variable of one


def output() -> Output:
    """Return what has been told of the command that runs."""
    return _commands[-1]


@contextmanager
def answered(in_json: bool) -> Iterator[None]:
    """Run a command; with `in_json`, write what is wrong to stdout if nothing else was written there."""
    _commands.append(Output())
    try:
        yield
    finally:
        told = _commands.pop()
        if in_json and told.error and not told.has_begun:
            sys.stdout.write(f"{json.dumps(told.data())}\n")


def misused(verb: str, problem: str) -> int:
    """Report that a command cannot be meant like this, and return the exit code for it."""
    output().misuse = problem
    sys.stderr.write(f"rbxcompose {verb}: {problem}\n")
    return USAGE


def has_colour(stream: TextIO) -> bool:
    """Return whether colours help: on a terminal, unless `NO_COLOR` is set."""
    return stream.isatty() and not os.environ.get("NO_COLOR")


def tell(text: str) -> None:
    """Write lines to stdout at once."""
    output().has_begun = True
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def tell_report(report: Report, sources: Sources) -> None:
    """Write all findings to stderr."""
    output().note(report, sources)
    sys.stderr.write(render_text(report, sources, has_colour(sys.stderr)))
    sys.stderr.flush()


def refuse(finding: Finding) -> int:
    """Write one finding to stderr and return the exit code for it."""
    report = Report()
    report.add(finding)
    tell_report(report, {})
    return FINDINGS


class Parser(argparse.ArgumentParser):
    """Reads the words behind a verb; what it refuses is noted as well."""

    def error(self, message: str) -> NoReturn:
        """Note it, tell it with the usage, and end the command."""
        output().misuse = message
        super().error(message)
