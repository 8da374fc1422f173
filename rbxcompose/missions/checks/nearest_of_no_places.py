"""Loops that begin with the nearest of things that are nowhere."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from rbxcompose.expressions.check import check
from rbxcompose.expressions.tree import Expression, Text, Variable
from rbxcompose.expressions.types import Type, TypeKind
from rbxcompose.expressions.values import Value
from rbxcompose.findings import Finding, Related, suggest
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.effects import replaced
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.analysis.scope_types import View
from rbxcompose.missions.engine.condition_watches import POSE
from rbxcompose.references import PLACE

_MAY_BE = (TypeKind.PLACE, TypeKind.POSE, TypeKind.TEXT, TypeKind.UNKNOWN)  # a text may name a place


@mission_check("RBX4182")
def nearest_of_no_places(mission: Examined) -> Iterator[Finding]:
    """A loop takes the nearest item first, and an item is no place."""
    for view in mission.views:
        items = view.node.step.items
        if items is None or POSE not in view.node.step.reads:
            continue
        listed = (items,) if isinstance(items, Expression) else items
        for item, asked in zip(listed, view.node.asked, strict=False):
            found, _ = check(item, view.scope)
            if isinstance(items, Expression):
                yield from _in_list(view, items, found)
            elif found.kind not in _MAY_BE:
                yield nearest_of_no_places.at(asked.scalar.span, f"{_ASKED}, and this is {found.phrase}", help=_HELP)
            elif isinstance(item.tree, Text) and not _is_place(view, item.tree.value):
                message, help_text = _told(view, item.tree.value)
                yield nearest_of_no_places.at(asked.scalar.span, message, help=help_text)


_ASKED = "'order: nearest' needs places"
_HELP = "write 'order: written', or a list of places"


def _in_list(view: View, items: Expression, found: Type) -> Iterator[Finding]:
    """Yield the finding on a list that an expression gives: by its type, or by what is known of it."""
    span, data = view.node.asked[0].scalar.span, view.program.data
    if found.kind is TypeKind.LIST and found.entry.kind not in _MAY_BE:
        yield nearest_of_no_places.at(span, f"{_ASKED}, and each item is {found.entry.phrase}", help=_HELP)
    elif isinstance(items.tree, Variable) and (name := items.tree.name) in data.keys() - replaced(view.program):
        value: Value = data[name].value
        words = [one for one in value if isinstance(one, str)] if isinstance(value, list | tuple | Mapping) else []
        for word in words:
            if not _is_place(view, word):
                message, help_text = _told(view, word)
                related = [Related(data[name].span, "its items")]
                yield nearest_of_no_places.at(span, message, help=help_text, related=related)
                return


def _is_place(view: View, word: str) -> bool:
    return word in view.robot.places or view.robot.may_have(PLACE, word)


def _told(view: View, word: str) -> tuple[str, str]:
    help_text = suggest(word, view.robot.places, "places")
    return f"{_ASKED}, and '{word}' is none", f"{_HELP}; {help_text}".removesuffix("; ")
