"""What modifiers do, and that their order in the text does not matter."""

from __future__ import annotations

import itertools

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


def test_a_timeout_halts_the_leaf_and_fails_the_node() -> None:
    simulated = simulate("do:\n  a:\n  timeout: 2 s", takes={"a": 5.0})
    assert simulated.advance(10) == "failure"
    assert simulated.told == [
        "0 a",
        "2 a: halted (2 s): timeout of 2 s",
        "2 mission test: failure: do.a: timeout of 2 s",
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
