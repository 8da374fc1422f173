"""What people write below `set` who know `name = value` from elsewhere, and what they meant."""

from __future__ import annotations

import re

from rbxcompose.findings import Finding, replacement
from rbxcompose.manifest.tree import Entry, Mapping, Scalar
from rbxcompose.missions import codes
from rbxcompose.missions.spans import inner_span

_WRITTEN = re.compile(
    r"\$?(?P<name>[a-z][a-z0-9_]*)(?P<sign>\s*(?::=|[+-]=|=(?!=))\s*|:)(?P<value>[^\s=].*)", re.DOTALL
)
EXAMPLE = "'name: value'"


def read_line(key: Scalar, written: Scalar) -> tuple[Mapping | None, Finding]:
    """Return what a text below `set` was meant to be, None if that is not clear; and the finding about it."""
    found = _WRITTEN.fullmatch(written.text) if written.plain else None
    if found is None:
        message = f"'{key.text}' needs names and their values"
        help_text = f"write {EXAMPLE} on the line below '{key.text}:', further right"
        return None, codes.WRONG_SHAPE.at(key.span, message, help=help_text)
    name, sign, value = found["name"], found["sign"].strip(), found["value"]
    if sign in ("+=", "-="):
        value = f"${name} {sign[0]} {value}" if value.split() == [value] else f"${name} {sign[0]} ({value})"
    is_one_line = written.span.line == written.span.end_line
    if not is_one_line:
        message = f"below '{key.text}', each name stands on a line of its own, with a colon behind it"
        return None, codes.WRONG_SHAPE.at(written.span, message, help=f"write {EXAMPLE}, such as '{name}: 1'")
    meant = f"{name}: {value}"
    message = "a space is missing behind the colon" if sign == ":" else f"'{key.text}' takes a colon, not '{sign}'"
    is_below = written.span.line > key.span.line
    where = "" if is_below else f" on the line below '{key.text}:', further right"
    fix = replacement(written.span, written.text, meant) if is_below else None
    finding = codes.WRONG_SHAPE.at(written.span, message, help=f"write '{meant}'{where}", fix=fix)
    right = Scalar(value, inner_span(written, len(written.text) - len(found["value"]), len(written.text)))
    entry = Entry(Scalar(name, inner_span(written, found.start("name"), found.end("name"))), right)
    return Mapping({name: entry}, written.span), finding
