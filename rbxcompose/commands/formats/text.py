"""Findings for people: the message, the place, the line with a caret, what to do."""

from collections.abc import Callable, Iterator

from rbxcompose.base.findings import Finding, Related, Report, Severity, Sources, Span, safe_fixes
from rbxcompose.base.printable import columns, plain
from rbxcompose.commands.formats import output_format

MOST_SHOWN = 20
_LINE_CELLS = 160  # of a source line; of a longer one only the surroundings of the caret are shown
_BEFORE_CARET = 60
_WORDS = 400  # characters of a message, label or help
_MOST_PLACES = 8  # in addition to a finding's own
_RESET = "\x1b[0m"
_COLOURS = {"error": "\x1b[1;31m", "warning": "\x1b[1;33m", "gutter": "\x1b[1;34m", "bold": "\x1b[1m"}


Paint = Callable[[str, str], str]
"""Paints a piece of text in a style, or leaves it as it is."""


def _painted(style: str, text: str) -> str:
    return f"{_COLOURS[style]}{text}{_RESET}" if text else text


@output_format("text")
def render_text(report: Report, sources: Sources, colour: bool = False) -> str:
    """Return all findings, sorted by place, at most 20 of them in full, and a line that counts them; "" if none."""
    findings = list(report)
    if not findings:
        return ""
    paint: Paint = _painted if colour else lambda style, text: text
    lines = [line for finding in findings[:MOST_SHOWN] for line in _finding(finding, sources, paint)]
    if len(findings) > MOST_SHOWN:
        lines.append(f"... and {len(findings) - MOST_SHOWN} more")
    lines.append(summary(findings, len(safe_fixes(findings, sources))))
    return "\n".join(lines) + "\n"


def summary(findings: list[Finding], fixes: int) -> str:
    """Return the number of findings of each severity, and of fixes: "3 errors, 1 warning"."""
    counts = {severity: sum(finding.severity is severity for finding in findings) for severity in Severity}
    counted = ", ".join(f"{count} {severity}{'' if count == 1 else 's'}" for severity, count in counts.items() if count)
    if not fixes:
        return counted
    count = "all" if fixes == len(findings) else str(fixes)
    which = f"{count} of them" if len(findings) > 1 else "it"
    return f"{counted}; {which} can be fixed with 'check --fix'"


def _finding(finding: Finding, sources: Sources, paint: Paint) -> Iterator[str]:
    head = paint(finding.severity, f"{finding.severity}[{finding.code}]")
    yield f"{head}: {paint('bold', plain(finding.message, _WORDS))}"
    width = 1
    label = plain(finding.label, _WORDS)
    if finding.span:
        width = len(str(finding.span.line))
        yield f"{paint('gutter', '  -->')} {plain(str(finding.span), _WORDS)}"
        source = _source_line(finding.span, sources)
        if source is not None:
            yield from _caret(finding.span, source, label, finding.severity, paint)
            label = ""
    if label:
        yield f"{' ' * width} {paint('gutter', '=')} {label}"
    for line in _related(finding.related):
        yield f"{paint('gutter', '  :::')} {line}"
    if finding.help:
        yield f"{' ' * width} {paint('gutter', '=')} help: {plain(finding.help, _WORDS)}"


def _related(related: tuple[Related, ...]) -> Iterator[str]:
    """Yield further places once each, with their words in one column."""
    places = list(dict.fromkeys((plain(str(item.span), _WORDS), plain(item.message, _WORDS)) for item in related))
    shown = places[:_MOST_PLACES]
    width = max((len(place) for place, _ in shown), default=0)
    for place, words in shown:
        yield f"{place:<{width}}   {words}".rstrip()
    if len(places) > len(shown):
        yield f"and {len(places) - len(shown)} more places"


def _source_line(span: Span, sources: Sources) -> str | None:
    lines = sources.get(span.file, "").split("\n")
    return lines[span.line - 1] if span.file in sources and span.line <= len(lines) else None


def _caret(span: Span, source: str, label: str, severity: Severity, paint: Paint) -> Iterator[str]:
    start = min(span.column - 1, len(source))
    end = span.end_column - 1 if span.end_line == span.line else len(source.rstrip())
    first = start - _BEFORE_CARET if len(source) > _LINE_CELLS and start > _BEFORE_CARET else 0
    last = first + _LINE_CELLS
    before, after = "..." if first else "", "..." if len(source) > last else ""
    cells = [_cell(character) for character in source[first:last]]
    text = before + "".join(cells) + after
    indent = columns(before) + sum(map(columns, cells[: start - first]))
    carets = "^" * max(1, sum(map(columns, cells[start - first : max(end, start + 1) - first])))
    number = str(span.line)
    yield f"{paint('gutter', number + ' |')} {text}".rstrip()
    pointer = paint(severity, f"{carets} {label}".rstrip())
    yield f"{paint('gutter', ' ' * len(number) + ' |')} {' ' * indent}{pointer}"


def _cell(character: str) -> str:
    """Return what is shown for one character of a source line."""
    return "    " if character == "\t" else plain(character)
