"""What modifiers do, and that their order in the text does not matter."""

from __future__ import annotations

import itertools

import pytest

from tests.missions.simulated import simulate
from tests.missions.test_composites import fails, skills


def test_only_if_skips_a_node_whose_condition_does_not_hold() -> None:
    simulated = simulate("do:\n  - a:\n    only_if: $door\n  - b")
    assert simulated.advance(10) == "success"
    assert skills(simulated) == ["0 b"]


def test_optional_counts_a_failure_as_success() -> None:
    simulated = simulate("do:\n  - a:\n    optional: true\n  - b", fails={"a": fails(1)})
    assert simulated.advance(10) == "success"
    assert skills(simulated) == ["0 a", "1 b"]


OPTIONAL = "do:\n  - a:\n    optional: true\n  - b:\n    optional: true\n  - c"


@pytest.mark.parametrize(
    ("failing", "words"),
    [("a b", "success: all 2 optional steps failed"), ("a", "success"), ("b", "success"), ("", "success")],
)
def test_a_mission_whose_optional_steps_all_failed_says_so_at_its_end(failing: str, words: str) -> None:
    simulated = simulate(OPTIONAL, fails={name: fails(1) for name in failing.split()})
    assert simulated.advance(10) == "success"
    assert simulated.told[-1] == f"3 mission test: {words}"


def test_an_optional_step_that_was_skipped_or_is_not_optional_after_all_is_no_reason_for_doubt() -> None:
    skipped = "  - b:\n    optional: true\n    only_if: 1 > 2"
    text = f"do:\n  - a:\n    optional: true\n{skipped}\n  - c:\n    optional: false"
    simulated = simulate(text, fails={"a": fails(1)})
    assert simulated.advance(10) == "success"
    assert simulated.told[-1] == "2 mission test: success: its only optional step failed"


def test_an_optional_step_of_a_loop_that_succeeded_once_is_no_reason_for_doubt() -> None:
    simulated = simulate("do:\n  repeat: 2\n  do:\n    - a:\n      optional: true", fails={"a": fails(1)})
    assert simulated.advance(10) == "success"
    assert simulated.told[-1] == "2 mission test: success"


def test_a_timeout_halts_the_leaf_and_fails_the_node() -> None:
    simulated = simulate("do:\n  a:\n  timeout: 2 s", takes={"a": 5.0})
    assert simulated.advance(10) == "failure"
    assert simulated.told == [
        "0 a",
        "2 a: halted (2 s): timeout of 2 s",
        "2 mission test: failure: mission.yaml:2: timeout of 2 s",
    ]
    assert simulated.running == {}


def test_a_result_beats_a_deadline_of_the_same_instant() -> None:
    assert simulate("do:\n  a:\n  timeout: 2 s", takes={"a": 2.0}).advance(10) == "success"
    assert simulate("do:\n  wait: 2 s\n  timeout: 2 s").advance(10) == "success"


def test_a_timeout_covers_all_attempts_together() -> None:
    simulated = simulate("do:\n  a:\n  attempts: forever\n  timeout: 3.5 s", fails={"a": fails(*range(9))})
    assert simulated.advance(10) == "failure"
    assert skills(simulated) == ["0 a", "1 a", "2 a", "3 a"]


def test_attempts_try_again_until_one_succeeds() -> None:
    for number, outcome in ((3, "success"), (2, "failure")):
        simulated = simulate(f"do:\n  a:\n  attempts: {number}", fails={"a": fails(1, 2)})
        assert simulated.advance(10) == outcome
        assert simulated.calls == {"a": number}


def test_the_order_of_modifiers_in_the_text_does_not_matter() -> None:
    modifiers = ("only_if: 2 > 1", "optional: true", "timeout: 2.5 s", "attempts: forever")
    told = set()
    for order in itertools.permutations(modifiers):
        simulated = simulate("do:\n  a:\n  " + "\n  ".join(order), fails={"a": fails(1, 2, 3)})
        assert simulated.advance(10) == "success"
        told.add(tuple(simulated.told))
    assert len(told) == 1


def test_a_modifier_of_a_list_holds_for_all_of_it() -> None:
    simulated = simulate("do:\n  sequence: [a, b]\n  attempts: 2", fails={"b": fails(1)})
    assert simulated.advance(10) == "success"
    assert skills(simulated) == ["0 a", "1 b", "2 a", "3 b"]


def test_a_skipped_node_is_not_tried_again() -> None:
    simulated = simulate("do:\n  sequence:\n    - a:\n      only_if: false\n  attempts: forever\n")
    assert simulated.advance(1) == "success"
