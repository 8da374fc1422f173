"""Judging takes work in proportion to what is expected and what happened, and tells of a few of many problems."""

from __future__ import annotations

import pytest

from rbxcompose.base.findings import Span
from rbxcompose.tools.mission_tests import judge as judging
from rbxcompose.tools.mission_tests.judge import MOST_MISSING, judge
from rbxcompose.tools.mission_tests.model import Expectations, ExpectedStep
from rbxcompose.tools.mission_tests.record import Done, TrialRecord
from rbxcompose.tools.mission_tests.scope import agrees

SPAN = Span("a.test.yaml", 1, 1, 1, 2)


def record(count: int) -> TrialRecord:
    made = TrialRecord("m")
    made.steps = [Done("go_to", f"go_to {n}", {"to": float(n)}, float(n), n) for n in range(count)]
    return made


def expected(numbers: range) -> Expectations:
    steps = (ExpectedStep("go_to", SPAN, {"to": float(n)}, text=f"go_to {n}") for n in numbers)
    return Expectations(steps=tuple(steps), outcome="")


@pytest.fixture
def compared(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Counts how often a step that was expected is compared with one that ran."""
    count = [0]

    def counted(one: object, other: object) -> bool:
        count[0] += 1
        return agrees(one, other)

    monkeypatch.setattr(judging, "agrees", counted)
    return count


def test_what_went_as_expected_is_compared_once(compared: list[int]) -> None:
    assert judge(expected(range(2000)), record(2000), {}) == []
    assert compared[0] <= 2 * 2000


def test_many_missing_steps_are_counted_and_compared_no_further_than_a_limit(
    compared: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    problems = judge(expected(range(1000, 1200)), record(100), {})
    assert len(problems) == MOST_MISSING + 1
    assert problems[-1].message == "150 more of the expected steps are missing"
    compared[0] = 0
    monkeypatch.setattr(judging, "MOST_COMPARED", 10_000)
    problems = judge(expected(range(9000, 18_000)), record(2000), {})
    assert problems[-1].message == "there is too much to compare: not all that is expected was"
    assert compared[0] < 10_000 + 2 * MOST_MISSING * 2000
