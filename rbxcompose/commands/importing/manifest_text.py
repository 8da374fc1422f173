"""The text of a manifest with a comment behind each line, that says where its values came from."""

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from decimal import Decimal
from pathlib import PurePath

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Span
from rbxcompose.base.printable import escaped, plain
from rbxcompose.base.units import UNITS, format_quantity, to_si
from rbxcompose.manifest.shapes import exact

WIDEST = 110  # columns before the comments of a section; a longer line has its own a little further to the right
_WORD = re.compile(r"[A-Za-z_/][\w./-]*", re.ASCII)
_OTHER_VALUES = frozenset({"true", "false", "null"})


@dataclass(frozen=True, slots=True)
class Row:
    """A line of a manifest and the comment behind it; without a text, a comment of its own."""

    text: str
    comment: str = ""


def header(program: str, files: Iterable[str], kind: str, name: str) -> str:
    """Return the first lines of a manifest, with the files of a program that it was made from."""
    made_from = ", ".join(plain(file) for file in files)
    return f"# Made by `rbxcompose import {program}` from {made_from}.\nrbx: 1\nkind: {kind}\nname: {name}\n"


def row(depth: int, text: str, comment: str = "") -> Row:
    """Return a line some levels deep."""
    return Row(f"{'  ' * depth}{text}", comment)


def section(rows: Iterable[Row]) -> str:
    """Return lines with their comments below each other."""
    lines = list(rows)
    commented = [len(line.text) for line in lines if line.comment and line.text.strip()]
    column = max((length for length in commented if length <= WIDEST), default=0)
    return "".join(f"{_line(line, column)}\n" for line in lines)


def _line(one: Row, column: int) -> str:
    if not one.comment:
        return one.text
    return f"{one.text.ljust(column)}  # {one.comment}" if one.text.strip() else f"{one.text}# {one.comment}"


def place(span: Span) -> str:
    """Return a place as a comment has it: the name of its file, and the line."""
    return f"{plain(PurePath(span.file).name, 60)}:{span.line}"


def places(spans: Mapping[str, Span]) -> str:
    """Return keys with their places: `rate (arm.yaml:3), sim (arm.yaml:7)`."""
    return ", ".join(f"{plain(key, 60)} ({place(span)})" for key, span in spans.items())


def flow(entries: Mapping[str, str]) -> str:
    """Return a map in one line."""
    return f"{{{', '.join(f'{key}: {value}' for key, value in entries.items())}}}"


def flow_list(items: Sequence[str]) -> str:
    """Return a list in one line."""
    return f"[{', '.join(items)}]"


def word(text: str) -> str:
    """Return a text of another program as a value, with dollars doubled."""
    return key(text.replace("$", "$$"))


def key(text: str) -> str:
    """Return a text of another program as a key, in quotes where needed."""
    if _WORD.fullmatch(text) and text.lower() not in _OTHER_VALUES:
        return text
    return escaped(json.dumps(text, ensure_ascii=False))


def flag(is_so: bool) -> str:
    """Return a flag."""
    return "true" if is_so else "false"


def number(value: float) -> str:
    """Return a number that reads back as itself, without a point where it is whole."""
    return str(int(value)) if value.is_integer() else repr(value)


def quantity(value: float, unit: str) -> str:
    """Return a number that a file gives in this unit."""
    return f"{number(value)} {unit}"


def length(value: float) -> str:
    """Return a length [m] as a person would write it: short ones in millimetres."""
    for text in _lengths(value):
        if to_si(text, UNITS["m"].dimension) == value:
            return text
    return exact(value, UNITS["m"].dimension)


def _lengths(value: float) -> Iterator[str]:
    if abs(value) < 1:
        yield f"{Decimal(repr(value)).scaleb(3).normalize():f} mm"
    yield quantity(value, "m")


def angle(value: float) -> str:
    """Return an angle that a file gives in radians."""
    return quantity(value, "rad") if value else "0 deg"


def degrees_shown(value: float) -> str:
    """Return an angle [rad] for people, rounded."""
    return format_quantity(value, UNITS["deg"].dimension)
