"""A line indented less than its neighbours."""

from __future__ import annotations

import re

from rbxcompose.findings import Finding
from rbxcompose.manifest.parser_error import NOT_YAML, Trouble, behind_dashes, indent
from rbxcompose.manifest.slips import COLON, NO_DASH, NO_KEY, text_slip
from rbxcompose.manifest.slips.step_without_colon import step_without_colon

_KEY_LINE = re.compile(r" *+(- ++)*[a-z][a-z0-9_]*:( |$)")
_FULL_LINE = re.compile(r" *+[a-z][a-z0-9_]*: ++[^\s#].*")


@text_slip(COLON, NO_KEY, NO_DASH, after=(step_without_colon,))
def too_far_left(trouble: Trouble) -> Finding | None:
    """Recognise it by the line below it: that of the error, or the next one."""
    if (COLON in trouble.problem and trouble.value_column) or (NO_KEY in trouble.problem and trouble.is_behind_quote):
        return None
    lines = trouble.lines
    below = next((one for one in range(trouble.line + 1, len(lines)) if lines[one].strip()), None)
    found = (_outlier(trouble, line) for line in (trouble.line, below) if line is not None)
    return next((finding for finding in found if finding), None)


def _outlier(trouble: Trouble, line: int) -> Finding | None:
    """Return the finding about the line above one that is in the column of the line before that."""
    lines = trouble.lines
    above = next(trouble.above(line), None)
    before = next(trouble.above(above), None) if above is not None else None
    if above is None or before is None or not _FULL_LINE.fullmatch(lines[above]):
        return None
    start, column = indent(lines[above]), indent(lines[line])
    if not (start < column == behind_dashes(lines[before]) and _KEY_LINE.match(lines[line])):
        return None
    key = lines[above].strip().partition(":")[0]
    beside = lines[before].lstrip(" -").partition(":")[0].strip()
    how_far = f"{column - start} {'column' if column - start == 1 else 'columns'}"
    help_text = f"move it {how_far} to the right, into the column of '{beside}'"
    return NOT_YAML.at(trouble.span(above, start, start + len(key)), f"'{key}' is too far left", help=help_text)
