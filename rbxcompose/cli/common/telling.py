"""How verbs tell findings and other text: stdout is for answers, stderr for what is wrong."""

from __future__ import annotations

import os
import sys
from typing import TextIO

from rbxcompose.cli.common.answering import answer
from rbxcompose.findings import Finding, Report, Sources
from rbxcompose.rendering.text import render_text

FINDINGS = 1  # exit code


def has_colour(stream: TextIO) -> bool:
    """Tell whether colours help: on a terminal, unless `NO_COLOR` is set."""
    return stream.isatty() and not os.environ.get("NO_COLOR")


def tell(text: str) -> None:
    """Write lines to stdout at once."""
    answer().has_begun = True
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def tell_report(report: Report, sources: Sources) -> None:
    """Write all findings to stderr."""
    answer().note(report, sources)
    sys.stderr.write(render_text(report, sources, has_colour(sys.stderr)))
    sys.stderr.flush()


def refuse(finding: Finding) -> int:
    """Write one finding to stderr and return the exit code for it."""
    report = Report()
    report.add(finding)
    tell_report(report, {})
    return FINDINGS
