"""A step without a colon, with settings below it."""

from __future__ import annotations

import re

from rbxcompose.findings import Finding, Related, replacement
from rbxcompose.manifest.parser_error import NOT_YAML, Trouble, indent
from rbxcompose.manifest.slips import COLON, text_slip
from rbxcompose.manifest.slips.tight_colon import tight_colon

_STEP = re.compile(r"(?P<before> *+(- ++)*)(?P<word>[a-z][a-z0-9_]*)(?P<value> ++[^\s:#][^:#]*)?")


@text_slip(COLON, after=(tight_colon,))
def step_without_colon(trouble: Trouble) -> Finding | None:
    """Recognise a word, perhaps with a value, directly above a line indented below it."""
    line = trouble.line - 1
    step = _STEP.fullmatch(trouble.lines[line].rstrip(" ")) if line >= 0 and not trouble.value_column else None
    if not step or indent(trouble.line_text) < len(step["before"]):
        return None
    word, value = step["word"], (step["value"] or "").strip()
    span = trouble.span(line, step.start("word"), step.end("word"))
    fix = replacement(span, word, f"{word}:", is_safe=not value)  # a word with a value may also be a text
    message = "a step with settings below it needs a colon"
    help_text = f"write '{word}: {value}'" if value else f"write '{word}:'"
    below = (Related(trouble.here, "this is below it"),)
    return NOT_YAML.at(span, message, label="put a colon here", help=help_text, related=below, fix=fix)
