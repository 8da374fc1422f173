"""`body check`."""

from __future__ import annotations

import argparse
import json
import sys

from rbxcompose.body.model import Body
from rbxcompose.body.text import extent_of, mass_of
from rbxcompose.cli.bodies.actions import Actions, add_reader, no_body
from rbxcompose.cli.bodies.source import DescribedBody
from rbxcompose.cli.bus.entities import add_json_option
from rbxcompose.cli.output.console import FINDINGS, has_colour, tell, tell_report
from rbxcompose.findings import Report, Severity, Sources
from rbxcompose.rendering.json_ import as_data
from rbxcompose.rendering.text import render_text

_FAMILY = "RBX20"  # codes of findings about bodies


def add(actions: Actions) -> None:
    """Declare the action."""
    about = "report what is wrong with the body alone: findings RBX20.., or the errors that keep it from being read"
    add_json_option(add_reader(actions, "check", about, _check))


def _check(arguments: argparse.Namespace, found: DescribedBody) -> int:
    report = about_body(found, arguments.path)
    if found.description is None:
        return _refused(report, found.sources, arguments.json)
    body = found.description.body
    if arguments.json:
        tell(json.dumps(_data(body, report, found.sources), ensure_ascii=False))
    else:
        tell(f"{_findings(report, found.sources)}{summary_of(body, report)}")
    return FINDINGS if report.has_errors else 0


def about_body(found: DescribedBody, path: str) -> Report:
    """Return the findings about the body; if it could not be read for another reason, all errors."""
    own = Report([one for one in found.report if one.code.startswith(_FAMILY)])
    if found.description is None and not own.has_errors:
        own.extend(one for one in found.report if one.severity is Severity.ERROR)
        if not own.has_errors:
            own.add(no_body(path))
    return own


def summary_of(body: Body, report: Report) -> str:
    """Return a line: how large the body is, and how many errors and warnings it has."""
    errors, warnings = _counts(report)
    counted = f"{errors} error{'' if errors == 1 else 's'}, {warnings} warning{'' if warnings == 1 else 's'}"
    return f"{extent_of(body)}: {counted}"


def _findings(report: Report, sources: Sources) -> str:
    """Return the findings as `check` writes them, without its last line: the summary counts them, too."""
    text = render_text(report, sources, has_colour(sys.stdout))
    return "".join(text.splitlines(keepends=True)[:-1])


def _refused(report: Report, sources: Sources, as_json: bool) -> int:
    """Tell why there is no body; the document for JSON is written as for any command that fails."""
    if as_json:
        tell_report(report, sources)
    else:
        tell(render_text(report, sources, has_colour(sys.stdout)).rstrip("\n"))
    return FINDINGS


def _data(body: Body, report: Report, sources: Sources) -> dict[str, object]:
    errors, warnings = _counts(report)
    return {
        "links": len(body.links),
        "joints": len(body.moving),
        "mass": mass_of(body),
        "errors": errors,
        "warnings": warnings,
        "findings": [as_data(one, sources) for one in report],
    }


def _counts(report: Report) -> tuple[int, int]:
    errors = sum(one.severity is Severity.ERROR for one in report)
    return errors, sum(1 for _ in report) - errors
