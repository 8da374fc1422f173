"""Slips of beginners behind an error of the YAML parser, found in the lines around it."""

from __future__ import annotations

import re
from typing import NamedTuple

from rbxcompose.findings import Edit, Fix, Span, replacement

# The keys of manifests and skills whose value is a text for people, in which a colon may stand.
TEXTS = ("about", "description", "label", "log", "message", "name", "say", "text", "title")
_KEY = r"[a-z][a-z0-9_]*"
_DASHES = re.compile(r" *(- +)*")
_KEY_LINE = re.compile(rf" *(- +)*{_KEY}:( |$)")
_FULL_LINE = re.compile(rf" *{_KEY}: +[^\s#].*")
_BARE = re.compile(rf"(?P<indent> *)(?P<word>{_KEY})(?P<value>(?: +[^\s:#]+){{1,2}})? *")
_IN_LINE = re.compile(rf"(?P<before> *(?:- +)*)(?P<outer>{_KEY}): +(?P<inner>{_KEY}: +\S.*?) *")
_PAIRS = re.compile(rf",\s+(?={_KEY}: )")
_DEEPER = 2


class Slip(NamedTuple):
    """What there is to say of a slip."""

    span: Span
    message: str
    help: str
    fix: Fix | None = None


def key_in_line(lines: list[str], line: int, file: str) -> Slip | None:
    """Return the slip of a key in the line of the key that it belongs below: `next: success: finished`.

    A text for people may begin with a word and a colon; and where the value holds quotes, nobody knows what it is.
    """
    found = _IN_LINE.fullmatch(lines[line])
    if found is None or found["outer"] in TEXTS or set(found["inner"]) & set("'\"#"):
        return None
    outer, inner = found["outer"], found["inner"]
    span = Span(file, line + 1, found.start("inner") + 1, line + 1, found.end("inner") + 1)
    pairs = _PAIRS.split(inner)
    what = " and ".join(f"'{pair}'" for pair in pairs)
    where = "a line of its own" if len(pairs) == 1 else "lines of their own"
    help_text = f"put {what} on {where} below '{outer}:', further right"
    below = _next_line(lines, line)
    goes_on = _column(below) > len(found["before"])
    if not goes_on:
        help_text += "; a text needs quotes"
    column = _column(below) if goes_on else len(found["before"]) + _DEEPER
    place = span._replace(column=len(found["before"]) + len(outer) + 1)
    text = ":" + "".join(f"\n{' ' * column}{pair}" for pair in pairs)
    edit = Edit(place, lines[line][place.column - 1 : place.end_column - 1], text)
    # Only where more keys follow below it, it can be no text.
    fix = Fix((edit,), goes_on and bool(_KEY_LINE.match(below)), f"'{outer}: {inner}' on {len(pairs) + 1} lines")
    return Slip(span, f"two keys stand in one line: '{outer}' and '{pairs[0].partition(':')[0]}'", help_text, fix)


def missing_dash(lines: list[str], line: int, file: str) -> Slip | None:
    """Return the slip of a step without a dash, and without a colon, between the items of a list."""
    found = _BARE.fullmatch(lines[line])
    if found is None or not _is_in_list(lines, line, len(found["indent"])):
        return None
    word, value = found["word"], (found["value"] or "").strip()
    span = Span(file, line + 1, len(found["indent"]) + 1, line + 1, len(lines[line].rstrip()) + 1)
    meant = f"- {word}: {value}" if value else f"- {word}"
    goes_on = _column(_next_line(lines, line)) > len(found["indent"])
    fix = None if value or goes_on else replacement(span, word, meant)
    return Slip(span, "a dash is missing before this step", f"write '{meant}'", fix)


def too_far_left(lines: list[str], line: int, file: str) -> Slip | None:
    """Return the slip of a line that stands further left than its neighbours, the line above the one given here."""
    above = _line_above(lines, line)
    before = _line_above(lines, above) if above is not None else None
    if above is None or before is None or not _FULL_LINE.fullmatch(lines[above]):
        return None
    column = _column(lines[line])
    is_outlier = _column(lines[above]) < column == _key_column(lines[before])
    if not is_outlier or not _KEY_LINE.match(lines[line]):
        return None
    key = lines[above].strip().partition(":")[0]
    start = _column(lines[above])
    span = Span(file, above + 1, start + 1, above + 1, start + len(key) + 1)
    beside = lines[before].lstrip(" -").partition(":")[0].strip()
    columns = column - start
    how_far = f"{columns} {'column' if columns == 1 else 'columns'}"
    return Slip(span, f"'{key}' stands too far left", f"move it {how_far} to the right, into the column of '{beside}'")


def _is_in_list(lines: list[str], line: int, indent: int) -> bool:
    """Tell whether the nearest line above that stands no deeper is the item of a list in this column."""
    above = (lines[one] for one in range(line - 1, -1, -1) if _is_written(lines[one]))
    nearest = next((one for one in above if _column(one) <= indent), "")
    return _column(nearest) == indent and nearest.lstrip().startswith("- ")


def _line_above(lines: list[str], line: int) -> int | None:
    return next((one for one in range(line - 1, -1, -1) if _is_written(lines[one])), None)


def _next_line(lines: list[str], line: int) -> str:
    return next((one for one in lines[line + 1 :] if _is_written(one)), "")


def _is_written(line: str) -> bool:
    return bool(line.strip()) and not line.lstrip().startswith("#")


def _column(line: str) -> int:
    return len(line) - len(line.lstrip(" "))


def _key_column(line: str) -> int:
    found = _DASHES.match(line)
    return found.end() if found else 0
