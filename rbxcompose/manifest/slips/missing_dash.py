"""A step without a dash, and without a colon, between the items of a list."""

from __future__ import annotations

import re

from rbxcompose.findings import Finding, replacement
from rbxcompose.manifest.parser_error import NOT_YAML, Trouble, indent
from rbxcompose.manifest.slips import NO_COLON, text_slip

_BARE = re.compile(r"(?P<indent> *+)(?P<word>[a-z][a-z0-9_]*)(?P<value>(?: ++[^\s:#]++){1,2})? *")


@text_slip(NO_COLON)
def missing_dash(trouble: Trouble) -> Finding | None:
    """Recognise one to three words in the column of the dashes around them."""
    line = trouble.opening.line - 1
    text = trouble.lines[line]
    found = _BARE.fullmatch(text)
    if found is None or not _is_in_list(trouble, line, len(found["indent"])):
        return None
    word, value = found["word"], (found["value"] or "").strip()
    span = trouble.span(line, len(found["indent"]), len(text.rstrip()))
    meant = f"- {word}: {value}" if value else f"- {word}"
    goes_on = indent(trouble.next_line(line)) > len(found["indent"])
    fix = None if value or goes_on else replacement(span, word, meant)
    return NOT_YAML.at(span, "a dash is missing before this step", help=f"write '{meant}'", fix=fix)


def _is_in_list(trouble: Trouble, line: int, column: int) -> bool:
    """Return whether the nearest line above that is not indented deeper is a list item in this column."""
    above = (trouble.lines[one] for one in trouble.above(line))
    nearest = next((one for one in above if indent(one) <= column), "")
    return indent(nearest) == column and nearest.lstrip().startswith("- ")
