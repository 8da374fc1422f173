"""Findings as GitHub workflow commands; GitHub shows each next to its line of the change."""

from collections.abc import Iterator

from rbxcompose.base.findings import COMMAND_LINE, Finding, Report, Sources, Span
from rbxcompose.base.printable import plain
from rbxcompose.commands.formats import output_format

_IN_TEXT = str.maketrans({"%": "%25", "\r": "%0D", "\n": "%0A"})
_IN_PROPERTY = {**_IN_TEXT, **str.maketrans({":": "%3A", ",": "%2C"})}


@output_format("github")
def render_github(report: Report, sources: Sources, colour: bool = False) -> str:
    """Return one command for each finding, sorted by place."""
    return "".join(f"{_command(finding)}\n" for finding in report)


def _command(finding: Finding) -> str:
    properties = {**_place(finding.span), "title": finding.code}
    written = ",".join(f"{name}={value.translate(_IN_PROPERTY)}" for name, value in properties.items())
    text = "\n".join(_lines(finding)).translate(_IN_TEXT)
    return f"::{finding.severity} {written}::{text}"


def _place(span: Span | None) -> dict[str, str]:
    if span is None or span.file.startswith(COMMAND_LINE):
        return {}
    place = {"file": plain(span.file), "line": str(span.line)}
    if span.end_line > span.line:  # columns are meaningful within one line only
        return {**place, "endLine": str(span.end_line)}
    return {**place, "col": str(span.column), "endColumn": str(span.end_column)}


def _lines(finding: Finding) -> Iterator[str]:
    span = finding.span
    yield f"{span}: {finding.message}" if span and span.file.startswith(COMMAND_LINE) else finding.message
    if finding.label:
        yield finding.label
    yield from dict.fromkeys(f"{related.span}: {related.message}" for related in finding.related)
    if finding.help:
        yield f"help: {finding.help}"
