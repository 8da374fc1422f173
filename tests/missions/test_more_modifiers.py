"""`skip_if`, `once`, `cooldown`, `invert`, `as_long_as` and the settings of attempts; and how they stand together."""

from __future__ import annotations

import itertools

import pytest

from tests.missions.simulated import simulate
from tests.missions.test_composites import fails, skills


@pytest.mark.parametrize(("is_open", "done"), [(True, []), (False, ["0 a"])])
def test_skip_if_skips_a_node_whose_condition_holds(is_open: bool, done: list[str]) -> None:
    simulated = simulate("do:\n  a:\n  skip_if: $door")
    simulated.set("door", is_open)
    assert simulated.advance(5) == "success"
    assert skills(simulated) == done


def test_invert_turns_the_result_and_leaves_skipped_alone() -> None:
    assert simulate("do:\n  a:\n  invert: true").advance(5) == "failure"
    assert simulate("do:\n  a:\n  invert: true", fails={"a": fails(1)}).advance(5) == "success"
    simulated = simulate("do:\n  fallback:\n    - a:\n      only_if: false\n      invert: true\n    - b")
    assert simulated.advance(5) == "success"
    assert skills(simulated) == ["0 b"]


def test_optional_stands_outside_of_invert() -> None:
    assert simulate("do:\n  a:\n  invert: true\n  optional: true").advance(5) == "success"


ROUNDS = "do:\n  repeat: 4\n  do:\n    - a:\n      {}\n    - b"


def test_once_is_done_once_whatever_comes_of_it() -> None:
    for failing in (fails(), fails(1)):
        simulated = simulate(ROUNDS.format("once: true\n      optional: true"), fails={"a": failing})
        assert simulated.advance(20) == "success"
        assert simulated.calls == {"a": 1, "b": 4}


def test_a_halt_is_no_end_for_once() -> None:
    text = "do:\n  sequence:\n    - a:\n      once: true\n  timeout: 2 s\n  attempts: 2"
    simulated = simulate(
        "do:\n  sequence:\n    - a:\n      once: true\n  attempt_timeout: 2 s\n  attempts: 2", takes={"a": 5.0}
    )
    simulated.advance(20)
    assert skills(simulated) == ["0 a", "2 a"]
    assert simulate(text, takes={"a": 5.0}).advance(20) == "failure"


def test_once_counts_within_one_run_of_the_mission() -> None:
    used = "do:\n  - repeat: 2\n    do:\n      a:\n      once: true\n  - b"
    simulated = simulate("do: {repeat: 2, do: {use: inner}}", {"inner": used})
    assert simulated.advance(20) == "success"
    assert simulated.calls == {"a": 2, "b": 2}


def test_cooldown_skips_a_node_for_a_time_after_its_end() -> None:
    simulated = simulate(ROUNDS.format("cooldown: 1.5 s"))
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b", "2 b", "3 a", "4 b", "5 b"]


def test_cooldown_reads_its_duration_each_time() -> None:
    text = "data: {rest: 9 s}\n" + ROUNDS.format("cooldown: $rest").replace("- b", "- b\n    - set: {rest: 0 s}")
    simulated = simulate(text)
    simulated.advance(20)
    assert simulated.calls == {"a": 4, "b": 4}


def test_as_long_as_halts_and_fails_when_it_no_longer_holds() -> None:
    simulated = simulate("do:\n  - a:\n    as_long_as: not $door\n    optional: true\n  - b", takes={"a": 5.0})
    simulated.set("door", False)
    simulated.at(2.0, lambda: simulated.set("door", True))
    assert simulated.advance(20) == "success"
    assert simulated.told[:3] == ["0 a", "2 a: halted (2 s): not as long as not $door", "2 b"]


def test_as_long_as_fails_at_once_and_before_the_node_starts() -> None:
    simulated = simulate("do:\n  a:\n  as_long_as: $door")
    assert simulated.advance(20) == "failure"
    assert simulated.calls == {}


def test_a_result_beats_as_long_as_of_the_same_instant_no_more_than_the_order_says() -> None:
    simulated = simulate("do:\n  a:\n  as_long_as: not $door")
    simulated.set("door", False)
    simulated.at(1.0, lambda: simulated.set("door", True))
    assert simulated.advance(20) == "failure"  # it is asked before the node is looked at
    assert simulated.running == {}


def test_attempts_may_have_a_timeout_each_and_a_pause_between_them() -> None:
    text = "do:\n  a:\n  attempts: 3\n  attempt_timeout: 2 s\n  attempt_pause: 1 s"
    simulated = simulate(text, takes={"a": 5.0})
    assert simulated.advance(20) == "failure"
    assert skills(simulated) == ["0 a", "3 a", "6 a"]
    assert simulated.now == 8.0


def test_a_timeout_counts_the_pauses_between_attempts_as_well() -> None:
    text = "do:\n  a:\n  attempts: forever\n  attempt_pause: 1 s\n  timeout: 4.5 s"
    simulated = simulate(text, fails={"a": fails(*range(9))})
    assert simulated.advance(20) == "failure"
    assert skills(simulated) == ["0 a", "2 a", "4 a"]


def test_attempts_end_with_the_first_success() -> None:
    simulated = simulate("do:\n  a:\n  attempts: forever\n  attempt_pause: 1 s", fails={"a": fails(1, 2)})
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "2 a", "4 a"]


def test_why_it_failed_is_that_of_the_last_attempt() -> None:
    simulated = simulate(
        "do:\n  sequence: [a, b]\n  attempts: 2\n  attempt_timeout: 1.5 s", takes={"b": 0.2}, fails={"a": fails(2)}
    )
    simulated.takes = {"a": 1.0, "b": 9.0}
    assert simulated.advance(20) == "failure"
    assert simulated.told[-1] == "2.5 mission test: failure: do.sequence.a.0: no luck"


def test_the_order_of_all_modifiers_in_the_text_does_not_matter() -> None:
    modifiers = ("skip_if: 1 > 2", "once: true", "invert: true", "as_long_as: 1 < 2", "attempts: 2", "save: x")
    told = set()
    for order in itertools.permutations(modifiers, len(modifiers)):
        text = "do:\n  look:\n  " + "\n  ".join(order)
        simulated = simulate(text, fails={"look": fails(1, 2)})
        simulated.advance(10)
        told.add(tuple(simulated.told))
    assert len(told) == 1
