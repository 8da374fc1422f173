"""Laws of mistakes: one is told at its place and nowhere else, and none hides another one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

from rbxcompose.base.findings import Severity
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import KeyPath, MappingNode, ScalarNode, SequenceNode, TreeNode, children
from tests.soak import Soak

ROOT = Path(__file__).parents[2]
WRONG = "{nonsense: [1]}"  # no value is a map with such a key
FILES = {
    "turtlebot": "robots/turtlebot/robot.yaml",
    "rooms": "robots/rooms/robot.yaml",
    "patrol": "missions/patrol.yaml",
}
ROBOTS = {"turtlebot": "turtlebot", "rooms": "rooms", "patrol": "turtlebot"}
HEADER = ("rbx", "kind", "name", "about", "profiles")
Told = frozenset[tuple[str, int]]  # code and line


@dataclass(frozen=True, slots=True)
class Value:
    """A word in a file: its path, its line, and where its text begins and ends."""

    path: KeyPath
    line: int
    start: int
    end: int


def text_of(name: str) -> str:
    return (ROOT / FILES[name]).read_text(encoding="utf-8")


@cache
def values(name: str) -> tuple[Value, ...]:
    """Return the values of a file that are one word each, but for its header."""
    text = text_of(name)
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    root, _ = read_text(text, name)
    assert isinstance(root, MappingNode)
    return tuple(_values(root, (), starts))


def _values(node: TreeNode, path: KeyPath, starts: list[int]) -> Iterator[Value]:
    if isinstance(node, MappingNode | SequenceNode):
        for key, below in children(node):
            if path or key not in HEADER:
                yield from _values(below, (*path, key), starts)
    elif isinstance(node, ScalarNode) and node.text:
        span = node.span
        start, end = (starts[line - 1] + column - 1 for line, column in (span[1:3], span[3:5]))
        yield Value(path, span.line, start, end)


def told(name: str, wrong: tuple[Value, ...]) -> Told:
    """Return what is told of a file in which these values are wrong."""
    text = text_of(name)
    for value in sorted(wrong, key=lambda each: -each.start):
        text = text[: value.start] + WRONG + text[value.end :]
    robot, file = ROOT / FILES[ROBOTS[name]], ROOT / FILES[name]
    found = compile_robot(str(robot), environment={}, unsaved={file.resolve(): text}).report
    return frozenset(
        (finding.code, finding.span.line if finding.span and finding.span.file.endswith(FILES[name]) else 0)
        for finding in found
        if finding.severity is Severity.ERROR or len(wrong) == 1
    )


@cache
def told_alone(name: str, wrong: Value) -> Told:
    return told(name, (wrong,))


@pytest.fixture
def every(soak: Soak) -> int:
    """Return which values are tried: one of so many."""
    return soak.examples(24, 1)


@pytest.mark.parametrize("name", FILES)
def test_a_wrong_value_is_told_at_its_line_and_nothing_else_is(name: str, every: int) -> None:
    elsewhere = {
        value.path: [(code, line) for code, line in told_alone(name, value) if line != value.line]
        for value in values(name)[::every]
    }
    assert {path: found for path, found in elsewhere.items() if found} == {}


@pytest.mark.parametrize("name", FILES)
def test_a_wrong_value_hides_no_other_one(name: str, every: int) -> None:
    there = values(name)[::every]
    lacking = {}
    for index, value in enumerate(there):
        other = there[(7 * index + len(there) // 2) % len(there)]
        if value.path[:2] != other.path[:2]:
            lacking[value.path, other.path] = (told_alone(name, value) | told_alone(name, other)) - told(
                name, (value, other)
            )
    assert {paths: found for paths, found in lacking.items() if found} == {}
