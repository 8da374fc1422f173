"""A key in the line of the key that it belongs below: `next: success: finished`."""

from __future__ import annotations

import re

from rbxcompose.findings import Edit, Finding, Fix
from rbxcompose.manifest.parser_error import NOT_YAML, Trouble, indent
from rbxcompose.manifest.slips import COLON, text_slip

# Keys of manifests and skills whose value is a text for people, which may contain a colon.
TEXTS = ("about", "description", "label", "log", "message", "name", "say", "text", "title")
_KEY = r"[a-z][a-z0-9_]*"
_KEY_LINE = re.compile(rf" *+(- ++)*{_KEY}:( |$)")
_IN_LINE = re.compile(rf"(?P<before> *+(?:- ++)*)(?P<outer>{_KEY}): ++(?P<inner>{_KEY}: ++\S.*)")
_PAIRS = re.compile(rf",\s++(?={_KEY}: )")
_DEEPER = 2


@text_slip(COLON)
def key_in_line(trouble: Trouble) -> Finding | None:
    """Recognise two keys on one line.

    A text for people may begin with a word and a colon; and if the value contains quotes, its meaning is unclear.
    """
    found = _IN_LINE.fullmatch(trouble.line_text.rstrip(" ")) if trouble.value_column else None
    if found is None or found["outer"] in TEXTS or set(found["inner"]) & set("'\"#"):
        return None
    outer, inner = found["outer"], found["inner"]
    pairs = _PAIRS.split(inner)
    what = " and ".join(f"'{pair}'" for pair in pairs)
    where = "a line of its own" if len(pairs) == 1 else "lines of their own"
    help_text = f"put {what} on {where} below '{outer}:', further right"
    below, start = trouble.next_line(trouble.line), len(found["before"])
    goes_on = indent(below) > start
    if not goes_on:
        help_text += "; a text needs quotes"
    column = indent(below) if goes_on else start + _DEEPER
    place = trouble.span(trouble.line, start + len(outer), found.end("inner"))
    text = ":" + "".join(f"\n{' ' * column}{pair}" for pair in pairs)
    edit = Edit(place, found[0][start + len(outer) :], text)
    # Only if more keys follow below it, it cannot be text.
    fix = Fix((edit,), goes_on and bool(_KEY_LINE.match(below)), f"'{outer}: {inner}' on {len(pairs) + 1} lines")
    message = f"two keys are on one line: '{outer}' and '{pairs[0].partition(':')[0]}'"
    return NOT_YAML.at(place._replace(column=found.start("inner") + 1), message, help=help_text, fix=fix)
