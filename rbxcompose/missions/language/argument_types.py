"""Checks that the value of a typed argument or input can be of that type."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.expressions.text import TextSlot, parse_template, refuse_foreign
from rbxcompose.expressions.tree import ExpressionError
from rbxcompose.expressions.types import UNKNOWN, Type, TypeKind
from rbxcompose.findings import Finding, FindingKind
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions import codes
from rbxcompose.missions.analysis.scope_types import View
from rbxcompose.missions.language.spans import expression_of, inner_span


def check_written(view: View, scalar: ScalarNode, wanted: Type, kind: FindingKind) -> Iterator[Finding]:
    """Yield the findings on a value that must have a type; a wrong type is a finding of the given kind."""
    try:
        if wanted.kind is not TypeKind.TEXT:
            yield from view.typed(expression_of(scalar), wanted, scalar, kind)
            return
        refuse_foreign(scalar.text)
        for slot in parse_template(scalar.text).parts:
            if isinstance(slot, TextSlot):
                part = ScalarNode(slot.value.text, inner_span(scalar, slot.start, slot.end))
                yield from view.typed(slot.value, UNKNOWN, part, kind)
    except ExpressionError as error:
        yield codes.NO_EXPRESSION.at(inner_span(scalar, error.start, error.end), error.message, help=error.help)
