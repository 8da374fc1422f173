"""What a program writes becomes lines of the log: none is lost without being counted."""

from __future__ import annotations

import math
import re
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.levels import Level
from rbxcompose.domains.programs.child import AT_ONCE, LONGEST, PER_SECOND, TELLS, OutputLog

LEFT_OUT = re.compile(r"(one|\d+) lines? w(?:as|ere) left out: it writes too many")
Bursts = st.lists(st.tuples(st.floats(0.0, 30.0), st.integers(0, 500)), max_size=20)


def left_out(text: str) -> int:
    found = LEFT_OUT.fullmatch(text)
    return 0 if found is None else 1 if found[1] == "one" else int(found[1])


@given(bursts=Bursts)
def test_each_line_is_logged_or_counted_and_not_too_many_are_logged(bursts: list[tuple[float, int]]) -> None:
    output, now, written, logged, counted = OutputLog({}), 0.0, 0, 0, 0
    reports = list[float]()
    for pause, number in [*bursts, (math.inf, 0)]:
        now, written = now + pause, written + number
        for _level, text in output.take(["a line"] * number, now):
            logged += text == "a line"
            counted += left_out(text)
            reports += [now] * (left_out(text) > 0)
        assert now == math.inf or logged <= AT_ONCE + now * PER_SECOND
    assert logged + counted == written
    assert all(later - sooner >= TELLS for sooner, later in pairwise(reports))


def test_a_flood_is_told_while_it_lasts() -> None:
    output = OutputLog({})
    told = [text for second in range(30) for _, text in output.take(["a line"] * 1000, float(second))]
    assert sum(left_out(text) > 0 for text in told) == 3


@pytest.mark.parametrize(
    ("line", "level"),
    [
        ("[ERROR] [1717.2] [camera]: no device", Level.ERROR),
        ("Traceback (most recent call last):", Level.ERROR),
        ("ValueError: x", Level.OK),
        ("[WARN] [1717.2] [camera]: slow", Level.WARN),
        ("\x1b[33m[WARN] [camera]: slow\x1b[0m", Level.WARN),
        ("warnings: 0, errors: 0", Level.OK),
        ("WARNING: an Error follows", Level.ERROR),
    ],
)
def test_levels_are_known_by_the_words_of_loggers(line: str, level: Level) -> None:
    assert [found for found, _ in OutputLog({}).take([line], 0.0)] == [level]


def test_patterns_replace_the_usual_words_of_their_level_alone() -> None:
    output = OutputLog({Level.WARN: "^W "})
    lines = ["W hot", "WARN", "ERROR"]
    assert [level for level, _ in output.take(lines, 0.0)] == [Level.WARN, Level.OK, Level.ERROR]


@given(text=st.text(max_size=2000))
def test_whatever_is_written_is_one_printable_line(text: str) -> None:
    for _, logged in OutputLog({}).take([text], 0.0):
        assert len(logged) <= LONGEST
        assert "\x1b" not in logged
        assert "\n" not in logged


def test_blank_lines_are_none() -> None:
    assert list(OutputLog({}).take(["", "  ", "\x1b[0m", "\r"], 0.0)) == []
