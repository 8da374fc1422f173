"""Where the thing named at a position is defined: a place, a component, a value, the component of a skill, a file."""

from __future__ import annotations

import re

from rbxcompose.findings import Span
from rbxcompose.lsp.document import Document, Spot
from rbxcompose.lsp.names import SKILL, named_by_key
from rbxcompose.lsp.variables import variable_span
from rbxcompose.manifest.files import resolve, shown_name
from rbxcompose.manifest.registry import naming
from rbxcompose.manifest.tree import KeyPath, at, key_span
from rbxcompose.references import COMPONENT, FILE, PLACE, PORT, PREFIXED, RUNNING
from rbxcompose.sections.args import args

_FRONT = re.compile(r"[A-Za-z0-9_.]*+(\s*+\{?\$)?+")  # read backwards from the position
_BACK = re.compile(r"[A-Za-z0-9_.]*")
_SERVING = ("serves_action", "serves", "serves_topic")  # kinds of ports that are skills


def define(document: Document, line: int, column: int) -> Span | None:
    """Return the place that defines what a position (from 0) names, or None."""
    spot = document.at(line, column)
    if spot is None:
        return None
    span = _file(spot) or _named(spot, word_at(spot))
    return _here(spot, span) if span is not None and not span.file else span


def word_at(spot: Spot) -> str:
    """Return the name at a position, with `$` or `${` before it."""
    front, back = _FRONT.match(spot.cursor.before[::-1]), _BACK.match(spot.cursor.after)
    return f"{front[0][::-1] if front else ''}{back[0] if back else ''}"


def _here(spot: Spot, span: Span) -> Span:
    """Return a place of the text with its file."""
    return Span(shown_name(spot.document.path), span.line, span.column, span.end_line, span.end_column)


def _file(spot: Spot) -> Span | None:
    if spot.document.is_mission or spot.cursor.is_key or spot.guide.value(spot.cursor.path).names != FILE:
        return None
    place = Span("", 1, 1, 1, 1)
    found = resolve(spot.cursor.text, spot.document.path, place)
    return Span(shown_name(found), 1, 1, 1, 1) if not hasattr(found, "code") else None


def _named(spot: Spot, word: str) -> Span | None:
    if word.startswith("${"):
        name = word.removeprefix("${").strip()
        return _own(spot, (args.name, name.removeprefix("args."))) if name.startswith("args.") else None
    if word.startswith("$"):
        return variable_span(spot, word.removeprefix("$").partition(".")[0])
    cursor = spot.cursor
    if cursor.is_key:
        kind = named_by_key(cursor.path, is_overlay=False)
        return _skill(spot, word) if spot.document.is_mission else _of_kind(spot, kind, word)
    kind = spot.guide.value(cursor.path).names
    if spot.document.is_mission:
        return _of_kind(spot, PLACE, word) or _skill(spot, word)
    return _of_kind(spot, kind, word)


def _of_kind(spot: Spot, kind: str, word: str) -> Span | None:
    if kind == SKILL:
        return _skill(spot, word)
    _, kind = PREFIXED.get(kind, ("", kind))
    name = word.partition(".")[0] if kind == PORT else word
    paths = ((one.name, *one.at, name) for one in naming(COMPONENT if kind in (PORT, RUNNING) else kind))
    return next((span for path in paths if (span := _own(spot, path))), None)


def _own(spot: Spot, path: KeyPath) -> Span | None:
    """Return the place of an entry: in the text itself, else in the composed robot."""
    if not spot.document.is_mission and at(spot.cursor.root, path) is not None:
        return key_span(spot.cursor.root, path)
    robot = spot.known.robot
    if robot is not None and at(robot.manifest.root, path) is not None:
        return key_span(robot.manifest.root, path)
    return None


def _skill(spot: Spot, word: str) -> Span | None:
    """Return the place of the component that offers a skill."""
    robot = spot.known.robot
    source = robot.skills.get(word) if robot else None
    if robot is None or source is None:
        return None
    ends = (end for end in robot.ends if end.port.kind in _SERVING and end.topic == source.topic)
    return next((robot.component_span(end.instance) for end in ends), None)
