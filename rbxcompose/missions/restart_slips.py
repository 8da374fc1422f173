"""`restart` with its name in the line of `afterwards`."""

from __future__ import annotations

import re

from rbxcompose.findings import Edit, Finding, Fix
from rbxcompose.manifest.tree import Scalar
from rbxcompose.missions import codes
from rbxcompose.missions.program import RESTART

_IN_LINE = re.compile(rf"{RESTART}:?\s*\s(?P<name>[a-z][a-z0-9_]*)")
_DEEPER = "  "


def restart_in_line(key: Scalar, value: Scalar) -> Finding | None:
    """Return the finding about `restart NAME` behind a key, None for any other text."""
    found = _IN_LINE.fullmatch(value.text) if value.plain else None
    if found is None:
        return None
    meant = f"{RESTART}: {found['name']}"
    message = f"'{RESTART}' and what begins anew stand on a line of their own"
    help_text = f"write '{meant}' on the line below '{key.text}:', further right"
    return codes.WRONG_SHAPE.at(value.span, message, help=help_text, fix=_on_a_line_below(key, value, meant))


def _on_a_line_below(key: Scalar, value: Scalar, meant: str) -> Fix:
    """Return the fix, which applies to a key with nothing before it on its line: within `{}` lines mean nothing."""
    span, indent = key.span, " " * (key.span.column - 1)
    before = span._replace(column=1, end_line=span.line, end_column=span.column)
    place = value.span._replace(line=span.line, column=span.column)
    edit = Edit(place, f"{key.text}: {value.text}", f"{key.text}:\n{indent}{_DEEPER}{meant}")
    return Fix((Edit(before, indent, indent), edit), True, f"'{value.text}' -> '{meant}'")
