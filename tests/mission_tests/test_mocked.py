"""Answered calls: time is an argument, a pause shifts the end, outcomes go by number."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.manifest.tree import NOWHERE
from rbxcompose.tools.mission_tests.model import Mock
from rbxcompose.tools.mission_tests.runner import Mocked
from rbxcompose.tools.mission_tests.scope import agrees

TIMES = st.floats(0, 100)
LOAD = Mock("load", NOWHERE, 2.0, outcome_at={1: "empty"}, fails_at=frozenset({3}), outcomes={"empty": "failure"})


@given(takes=TIMES, began=TIMES, before=TIMES, pause=TIMES)
def test_a_pause_shifts_the_end_by_its_length(takes: float, began: float, before: float, pause: float) -> None:
    mocked = Mocked({"load": Mock("load", NOWHERE, takes)})
    mocked.start(7, "load", {}, began)
    held = began + min(before, takes)
    assert mocked.pause(7, held)
    assert mocked.next_due() is None
    assert list(mocked.ended(1e9)) == []
    assert mocked.resume(7, held + pause)
    due = mocked.next_due()
    assert due is not None
    assert abs(due - (began + takes + pause)) < 1e-9
    assert [(call.leaf, result.success) for call, result in mocked.ended(due)] == [(7, True)]
    assert mocked.next_due() is None


def test_outcomes_go_by_the_number_of_the_call_and_count_as_declared() -> None:
    mocked = Mocked({"load": LOAD})
    results = []
    for time in range(4):
        mocked.start(1, "load", {}, float(time * 10))
        results += [result for _, result in mocked.ended(time * 10 + 2.0)]
    assert [(result.success, result.outcome) for result in results] == [
        (False, "empty"),
        (True, ""),
        (False, ""),
        (True, ""),
    ]


def test_a_call_that_was_halted_never_ends_and_is_not_counted() -> None:
    mocked = Mocked({"load": LOAD})
    mocked.start(1, "load", {}, 0.0)
    assert mocked.halt(1)
    assert not mocked.halt(1)
    mocked.start(1, "load", {}, 5.0)
    assert [(call.due, result.outcome) for call, result in mocked.ended(9.0)] == [(7.0, "empty")]


def test_calls_end_in_the_order_in_which_they_are_due() -> None:
    mocked = Mocked({"slow": Mock("slow", NOWHERE, 3.0), "quick": Mock("quick", NOWHERE, 1.0)})
    for leaf, name in ((1, "slow"), (2, "quick"), (3, "slow")):
        mocked.start(leaf, name, {}, 0.0)
    assert [call.leaf for call, _ in mocked.ended(5.0)] == [2, 1, 3]


@given(st.recursive(st.none() | st.booleans() | TIMES | st.text(max_size=5), lambda inner: st.lists(inner, max_size=3)))
def test_every_value_agrees_with_itself(value: object) -> None:
    assert agrees(value, value)


def test_only_the_fields_that_were_written_count() -> None:
    assert agrees({"x": 1.0}, {"x": 1.0 + 1e-9, "y": 2.0})
    assert not agrees({"x": 1.0, "z": 0.0}, {"x": 1.0})
    assert not agrees([1.0], [1.0, 2.0])
    assert not agrees(True, 1.0)
