"""Dashes without a space after them: `-name: one`."""

from __future__ import annotations

import re

from rbxcompose.findings import Edit, Finding, Fix
from rbxcompose.manifest.parser_error import NOT_YAML, Trouble, indent
from rbxcompose.manifest.slips import ANY, text_slip

_TIGHT = re.compile(r"( *)-([a-z][a-z0-9_]*)(?=: |:? *$)")


@text_slip(ANY)
def tight_dashes(trouble: Trouble) -> Finding | None:
    """Recognise them in the column where the parser failed."""
    near = {line for line in (trouble.line, trouble.opening.line - 1) if line < len(trouble.lines)}
    indents = {len(found[1]) for line in near if (found := _TIGHT.match(trouble.lines[line]))}
    if not indents or "block scalar" in trouble.context:
        return None
    edits = [
        Edit(trouble.span(line, len(found[1]), found.end()), f"-{found[2]}", f"- {found[2]}")
        for line in _siblings(trouble, indents.pop())
        if (found := _TIGHT.match(trouble.lines[line]))
    ]
    first = edits[0]
    fix = Fix(tuple(edits), True, f"'{first.old}' -> '{first.text}'")
    message = "a space is missing after this dash"
    return NOT_YAML.at(first.span, message, help=f"write '{first.text}'", fix=fix)


def _siblings(trouble: Trouble, column: int) -> list[int]:
    """Return the lines around the error that begin in a column, up to any line that begins before it."""
    first = last = min(trouble.line, len(trouble.lines) - 1)
    while first > 0 and not _leaves(trouble.lines[first - 1], column):
        first -= 1
    while last + 1 < len(trouble.lines) and not _leaves(trouble.lines[last + 1], column):
        last += 1
    return [line for line in range(first, last + 1) if indent(trouble.lines[line]) == column]


def _leaves(line: str, column: int) -> bool:
    return bool(line.strip()) and indent(line) < column
