"""Cases that are never taken."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.expressions.check import check
from rbxcompose.expressions.tree import Expression, Flag, Number, Text, Word
from rbxcompose.expressions.types import Type, TypeKind
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.language.asked import Asked

WORDS = (TypeKind.TEXT, TypeKind.CHOICE, TypeKind.PLACE)
NUMBERS = (TypeKind.QUANTITY, TypeKind.COUNT)


@mission_check("RBX4154", Severity.WARNING, closed=())
def same_case(mission: Examined) -> Iterator[Finding]:
    """A case that is never taken."""
    for view in mission.views:
        choice = view.node.step.choice
        if choice is None:
            continue
        chosen, _ = check(choice.asked, view.scope)
        seen: dict[object, Asked] = {}
        for asked in choice.cases:
            value, text = _constant(asked.expression), asked.scalar.text
            if value in seen:
                related = [Related(seen[value].scalar.span, "the first one")]
                message = f"the case '{text}' is never taken: an earlier one is equal"
                yield same_case.at(asked.scalar.span, message, related=related)
            elif value is not None:
                seen[value] = asked
                if not _can_be(asked.expression, chosen):
                    message = f"the case '{text}' is never taken: '{choice.asked.text}' is {chosen.detail}"
                    yield same_case.at(asked.scalar.span, message)


def _constant(expression: Expression) -> object:
    """Return the value of a case if it is a literal; a word and a text of the same letters are the same."""
    match expression.tree:
        case Number(value=value) | Text(value=value):
            return value
        case Flag(value=value):
            return str(value)
        case Word(name=name):
            return name
    return None


def _can_be(case: Expression, chosen: Type) -> bool:
    """Return whether a value of the type `chosen` can equal a literal case."""
    if chosen.kind not in (*WORDS, *NUMBERS, TypeKind.FLAG):
        return True
    match case.tree:
        case Number(dimension=dimension):
            return chosen.kind in NUMBERS and dimension == chosen.measure
        case Flag():
            return chosen.kind is TypeKind.FLAG
        case Text(value=word) | Word(name=word):
            return chosen.kind in WORDS and (not chosen.choices or word in chosen.choices)
    return True
