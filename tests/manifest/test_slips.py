"""Slips in the lines of a manifest: what to do is said, and done by a fix where only one thing can be meant."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import pytest

from rbxcompose.base.config import Config, Length
from rbxcompose.base.findings import Finding, Report, apply_fixes, safe_fixes
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.manifest.validate import validate
from rbxcompose.testing.manifests import check_text
from tests.loops import for_all

FILE = "robot.yaml"
ROBOT = "kind: Robot\nname: one\ncomponents:\n  base:\n    type: diff_drive_sim\n"


class Lists(Config):
    words: tuple[str, ...] = ()
    limits: list[Length] = []
    anything: tuple[Any, ...] = ()
    pair: tuple[int, int] = (0, 0)


def told(text: str) -> Finding:
    node, findings = read_text(text, FILE)
    report = Report(findings)
    if isinstance(node, MappingNode):
        validate(Lists, node, ("test",), report)
    (finding,) = report
    return finding


def cured(text: str) -> str:
    return apply_fixes(safe_fixes([told(text)], {FILE: text}), {FILE: text}).texts.get(FILE, text)


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ("words: window", "words: [window]"),
        ("words: table, window", "words: [table, window]"),
        ("words: (table, window)", "words: [table, window]"),
        ("limits: 1 m, 20 cm", "limits: [1 m, 20 cm]"),
        ("anything: dock", "anything: [dock]"),
    ],
)
def test_a_list_without_brackets_gets_them(wrong: str, right: str) -> None:
    assert told(wrong).help == f"a list needs brackets: write '{right.partition(': ')[2]}'"
    assert cured(wrong) == right


@pytest.mark.parametrize(
    "wrong", ["limits: far", "pair: 3", "words: 'a, b'", "words: {a: b}", "words: a; b", "words: ()"]
)
def test_what_brackets_would_not_cure_gets_none(wrong: str) -> None:
    assert "brackets" not in told(wrong).help
    assert cured(wrong) == wrong


@pytest.mark.parametrize(
    "text", ["base: type: drive", "a:\n  - base: type: drive\n", "next: success: finished, failure: b"]
)
def test_a_key_in_the_line_of_another_belongs_below_it(text: str) -> None:
    assert told(text).message.startswith("two keys are on one line")
    assert cured(text) == text  # it may be a text all the same


@pytest.mark.parametrize("text", ["about: note: it is slow", "log: note: it is slow", "base: Note: slow"])
def test_a_text_with_a_colon_gets_its_quotes(text: str) -> None:
    key, _, value = text.partition(": ")
    assert cured(text) == f'{key}: "{value}"'


def test_where_more_keys_follow_below_it_the_first_one_joins_them() -> None:
    assert cured("a:\n  - base: type: x\n      speed: 1\n") == "a:\n  - base:\n      type: x\n      speed: 1\n"


@pytest.mark.parametrize(
    ("text", "line", "columns"),
    [
        ("a:\n    b: 1\n  c: 2\n    d: 3\n", 3, "2 columns"),
        ("a:\n   b: 1\n  c: [2]\n   d: 3\n", 3, "1 column"),
        ("a:\n  - b: 1\n  # what follows is c\n  c: two words\n\n    d: 3\n", 4, "2 columns"),
    ],
)
def test_a_line_further_left_than_its_neighbours_is_the_one_that_is_told(text: str, line: int, columns: str) -> None:
    finding = told(text)
    assert finding.span
    assert (finding.span.line, finding.message) == (line, "'c' is too far left")
    assert finding.help == f"move it {columns} to the right, into the column of 'b'"


def test_a_line_that_is_too_deep_for_all_above_it_is_told_itself() -> None:
    finding = told("a: 1\nb: 2\n   c: 3\n")
    assert finding.span
    assert finding.span.line == 3


@pytest.mark.parametrize(
    ("text", "right"),
    [
        ("a:\n  - b: 1\n  word\n  - c\n", "  - word"),
        ("a:\n  - b:\n      c: 1\n\n  word\n", "  - word"),
        ("- b\nword\n- c\n", "- word"),
    ],
)
def test_a_word_between_the_items_of_a_list_gets_its_dash(text: str, right: str) -> None:
    assert told(text).message == "a dash is missing before this step"
    assert right in cured(text).split("\n")


@pytest.mark.parametrize(
    "text", ["a:\n  b: 1\n  word\n", "a:\n  - b: 1\n word\n", "a:\n  - b: 1\n  these are many words\n"]
)
def test_other_lines_without_a_colon_are_told_as_before(text: str) -> None:
    assert told(text).message != "a dash is missing before this step"


@pytest.mark.parametrize("above", ["", "# a robot\n", "\n"])
def test_the_first_line_is_written_where_it_is_missing(above: str, tmp_path: Path) -> None:
    checked = check_text(above + ROBOT, tmp_path)
    (finding,) = checked.compilation.report
    assert finding.help == "write 'rbx: 1' in the first line: the version of the language"
    sources = checked.compilation.sources
    (text,) = apply_fixes(safe_fixes([finding], sources), sources).texts.values()
    assert text == f"{above}rbx: 1\n{ROBOT}"
    assert not check_text(text, tmp_path).compilation.report.has_errors


def test_the_first_line_has_no_place_within_brackets(tmp_path: Path) -> None:
    report = check_text("{kind: Robot, name: one}\n", tmp_path).compilation.report
    assert [finding.fix for finding in report if "'rbx'" in finding.message] == [None]


MANY = 60_000


@for_all(
    "text",
    [
        f"a: b: c{' ' * MANY}d # e",
        f"a: {'b: ' * (MANY // 3)}",
        f"{' ' * MANY}a: b: c",
        f"a b{' ' * MANY}:c\n  d: e\n",
        f"{'- ' * 60}a: b{' ' * MANY}: c\n",
        f"words: a{' ' * MANY}!",
        f"words: {'a, ' * (MANY // 3)}!",
        f"words: {'a ' * (MANY // 2)}",
    ],
)
def test_a_long_text_that_is_nearly_a_slip_takes_no_longer_than_its_length(text: str) -> None:
    begun = time.process_time()
    told(text)
    assert time.process_time() - begun < 1  # quadratic patterns take minutes
