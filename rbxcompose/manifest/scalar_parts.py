"""Places inside a scalar."""

from __future__ import annotations

from rbxcompose.findings import Span
from rbxcompose.manifest.tree import ScalarNode


def part_span(scalar: ScalarNode, start: int, end: int) -> Span:
    """Return the place of `scalar.text[start:end]`, or of the whole scalar if escapes or line breaks hide it."""
    span, quote = scalar.span, 0 if scalar.plain else 1
    if span.line != span.end_line or span.end_column - span.column != len(scalar.text) + 2 * quote:
        return span
    first = span.column + quote
    return span._replace(column=first + start, end_column=first + max(end, start + 1))
