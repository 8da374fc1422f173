"""Keys that stand beside a step and are none of its settings: another language's word, a setting, or a second step."""

from __future__ import annotations

import re
from collections.abc import Iterable

from rbxcompose.findings import Edit, Finding, Fix
from rbxcompose.manifest.scalars import plain_value
from rbxcompose.manifest.tree import Mapping, Node, Scalar
from rbxcompose.missions import codes
from rbxcompose.missions.other_words import SETTINGS
from rbxcompose.units import UnitError, parse_quantity

STEPS = ("wait",)  # of our words, those that are a step
TIGHT_DASH = re.compile(r"-(?=[a-z][a-z0-9_]*$)")
INDENTATION = "  "
SETTINGS_HELP = "settings of a step"


def is_setting(node: Node) -> bool:
    """Tell whether a value looks like that of a setting: a number, a flag, a quantity or something with `$`."""
    if not isinstance(node, Scalar) or not node.plain or not node.text:
        return False
    if not isinstance(plain_value(node), str) or "$" in node.text:
        return True
    try:
        parse_quantity(node.text)
    except UnitError:
        return False
    return True


def unknown_setting(mapping: Mapping, key: str, beside: str, settings: Iterable[str]) -> Finding:
    """Return the finding about a key that is no setting, with the one that was meant."""
    span, known = mapping.entries[key].key.span, list(settings)
    message = f"unknown key '{key}' beside {beside}"
    ours = SETTINGS.get(key, "")
    if ours in STEPS:
        value = mapping.entries[key].value
        told = value.text if isinstance(value, Scalar) and value.text else "..."
        return codes.UNKNOWN_KEY.at(span, message, help=f"a pause is a step of its own: '- {ours}: {told}'")
    if ours in known:
        return codes.UNKNOWN_KEY.at(span, message, help=f"did you mean '{ours}'?")
    return codes.UNKNOWN_KEY.misspelt(span, message, key, known, SETTINGS_HELP, taken=mapping.entries)


def tight_dashes(mapping: Mapping) -> list[Finding]:
    """Return a finding for each key that begins with a dash, as steps do of which the dash has no space behind it."""
    tight = [entry.key for key, entry in mapping.entries.items() if TIGHT_DASH.match(key)]
    is_list = len(tight) == len(mapping.entries)  # else something stands there that is no item of a list
    message = "a space is missing behind this dash"
    return [
        codes.WRONG_SHAPE.at(key.span, message, help=f"write '- {key.text[1:]}'", fix=_spaced(key) if is_list else None)
        for key in tight
    ]


def _spaced(key: Scalar) -> Fix:
    """Return the fix that puts a space behind a dash; it applies to a line of its own only."""
    span = key.span
    before = span._replace(column=span.column - len(INDENTATION), end_line=span.line, end_column=span.column)
    meant = f"- {key.text[1:]}"
    edits = Edit(before, INDENTATION, INDENTATION), Edit(span, key.text, meant)
    return Fix(edits, True, f"'{key.text}' -> '{meant}'")
