"""A colon without a space after it: `name:one`."""

from __future__ import annotations

import re

from rbxcompose.findings import Finding, replacement
from rbxcompose.manifest.parser_error import NOT_YAML, Trouble, behind_dashes
from rbxcompose.manifest.slips import COLON, NO_COLON, text_slip
from rbxcompose.manifest.slips.key_in_line import key_in_line
from rbxcompose.manifest.slips.missing_dash import missing_dash

_TIGHT = re.compile(r"[a-z][a-z0-9_]*:(?!//)(?=\S)")


@text_slip(COLON, NO_COLON, after=(key_in_line, missing_dash))
def tight_colon(trouble: Trouble) -> Finding | None:
    """Recognise a key that was read as text: in the line above, or where the parser expected a colon."""
    if trouble.value_column and COLON in trouble.problem:
        return None
    is_above = COLON in trouble.problem
    line = trouble.line - 1 if is_above else trouble.opening.line - 1
    text = trouble.lines[line] if line >= 0 else ""
    column = behind_dashes(text) if is_above else trouble.opening.column - 1
    found = _TIGHT.match(text, column)
    if found is None:
        return None
    span, message = trouble.span(line, column, found.end()), "a space is missing after this colon"
    return NOT_YAML.at(span, message, help="write 'key: value'", fix=replacement(span, found[0], f"{found[0]} "))
