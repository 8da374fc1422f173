"""The diagnostics of a robot as text for people, and as data for JSON."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rbxcompose.diagnostics.requests import DiagnosticsTree, LevelChange, TreeLine
from rbxcompose.levels import Level
from rbxcompose.printable import fitted, plain
from rbxcompose.typed_json import to_data

_RESET, _FAINT = "\x1b[0m", "\x1b[2m"
_COLOURS = {Level.OK: "\x1b[32m", Level.WARN: "\x1b[33m", Level.ERROR: "\x1b[1;31m", Level.STALE: "\x1b[35m"}
_STEP = "  "
_WIDEST = 40  # columns of a name; longer ones move their message to the right
_LONGEST = 1000  # characters of a message


def tree_lines(
    robot: str, tree: DiagnosticsTree, *, values: bool = False, colour: bool = False, width: int = 0
) -> Iterator[str]:
    """Yield the robot with its level and the cause, then a line for each group and part; `width` 0 cuts nothing."""
    names = [f"{_STEP * (one.depth + 1)}{plain(one.name)}" for one in tree.lines]
    column = max((len(name) for name in (robot, *names) if len(name) <= _WIDEST), default=0)
    yield _row(robot, tree.level, tree.cause, column, colour, width)
    for name, line in zip(names, tree.lines, strict=True):
        message = "" if line.is_group and line.message == line.level.name else line.message
        yield _row(name, line.level, message, column, colour, width)
        if values and not line.is_group:
            yield from _values(line, colour, width)
    notes = [f"{tree.left_out:,} more are on /diagnostics_agg"] if tree.left_out else []
    notes += [f"{tree.dropped:,} statuses were refused; the log says why"] if tree.dropped else []
    for text in notes:
        yield fitted(text, width) if width else text


def _row(name: str, level: Level, message: str, column: int, colour: bool, width: int) -> str:
    text = f"{name:<{column}}  {level.name:<5}  {plain(message, _LONGEST)}".rstrip()
    text = fitted(text, width) if width else text
    if not colour:
        return text
    start = len(f"{name:<{column}}  ")
    word = text[start : start + 5]
    return f"{text[:start]}{_COLOURS[level]}{word}{_RESET}{text[start + 5 :]}"


def _values(line: TreeLine, colour: bool, width: int) -> Iterator[str]:
    pairs = [*((("hardware_id", line.hardware_id),) if line.hardware_id else ()), *line.values]
    keys = max((len(plain(key)) for key, _ in pairs), default=0)
    for key, value in pairs:
        text = f"{_STEP * (line.depth + 2)}{plain(key):<{keys}}  {plain(value, _LONGEST)}"
        text = fitted(text, width) if width else text
        yield f"{_FAINT}{text}{_RESET}" if colour else text


def change_line(change: LevelChange, colour: bool) -> str:
    """Return a change as a line: `   12.30  /power  OK -> WARN  battery: Medium battery`."""
    old, new = (f"{_COLOURS[one]}{one.name}{_RESET}" if colour else one.name for one in (change.old, change.new))
    cause = "" if change.cause == change.new.name else plain(change.cause, _LONGEST)
    return f"{change.time:8.2f}  {plain(change.path)}  {old} -> {new}  {cause}".rstrip()


def told_change(change: LevelChange) -> dict[str, Any]:
    """Return a change as data for JSON; levels are words."""
    return {**to_data(change), "old": change.old.name.lower(), "new": change.new.name.lower()}


def told_tree(tree: DiagnosticsTree) -> dict[str, Any]:
    """Return the tree as data for JSON: levels are words, values a map."""
    lines = [{**to_data(line), "level": line.level.name.lower(), "values": dict(line.values)} for line in tree.lines]
    return {**to_data(tree), "level": tree.level.name.lower(), "lines": lines}
