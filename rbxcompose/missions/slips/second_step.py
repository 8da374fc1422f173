"""A second step beside the first one, without its own dash."""

from __future__ import annotations

from rbxcompose.findings import Edit, Finding, Fix
from rbxcompose.manifest.tree import MappingNode, TreeNode
from rbxcompose.missions import codes
from rbxcompose.missions.language.grammar import GrammarPlace, Takes, Words
from rbxcompose.missions.slips import slip
from rbxcompose.missions.slips.keys_outside_their_machine import keys_outside_their_machine
from rbxcompose.missions.slips.misspelt_kind import misspelt_kind
from rbxcompose.missions.slips.tight_dashes import tight_dashes
from rbxcompose.missions.slips.unknown_settings import unknown_in, unknown_settings
from rbxcompose.slips import Repair

_DASH = "- "


@slip(Takes.STEP, after=(tight_dashes, misspelt_kind, keys_outside_their_machine), before=(unknown_settings,))
def second_step(place: GrammarPlace, node: TreeNode) -> Repair[TreeNode] | None:
    """Recognise keys that are steps of their own; only the first one is read here."""
    if not isinstance(node, MappingNode) or len(place.words.own(node)) < 2:
        return None
    kind = place.words.kind_of(node)
    slots = place.words.kinds.get(kind, {})
    unknown = unknown_in(node, place.words)
    steps = [key for key in place.words.own(node) if key not in unknown and (key not in slots or key == kind)]
    if len(steps) < 2:
        return None
    findings = tuple(_missing_dash(node, steps[0], second, place.words) for second in steps[1:])
    gone = set(steps) - {kind or steps[0]}
    return Repair(MappingNode({key: one for key, one in node.entries.items() if key not in gone}, node.span), findings)


def _missing_dash(step: MappingNode, first: str, second: str, words: Words) -> Finding:
    message = f"'{second}' is a second step beside '{first}', without a dash of its own"
    help_text = f"write '- {second}: ...' as its own step"
    fix = _dash_before(step, second, words) if words.is_step(second) else None
    return codes.TWO_STEPS.at(step.entries[second].key.span, message, label="put a dash here", help=help_text, fix=fix)


def _dash_before(step: MappingNode, key: str, words: Words) -> Fix | None:
    """Return the fix that turns a key of a list item into the next item, unless a later key may belong to either."""
    first, second = next(iter(step.entries.values())).key.span, step.entries[key].key.span
    if first.column != second.column or second.line == first.line:
        return None
    for behind in reversed(step.entries):
        if behind == key:
            break
        if behind in words.modifiers or words.is_option(behind):
            return None
    guard, dash = (
        span._replace(column=span.column - 2, end_line=span.line, end_column=span.column) for span in (first, second)
    )
    return Fix((Edit(guard, _DASH, _DASH), Edit(dash, " " * len(_DASH), _DASH)), True, f"'{key}' -> '- {key}'")
