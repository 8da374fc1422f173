"""`skip_if`, `once`, `cooldown`, `invert`, `as_long_as` and the settings of attempts; and how they stand together."""

from __future__ import annotations

import itertools

import pytest

from tests.missions.simulated import simulate
from tests.missions.test_composites import fails, skills
from tests.soak import Soak


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
    assert simulated.told[-1] == "2.5 mission test: failure: mission.yaml:2: no luck"


def test_the_order_of_all_modifiers_in_the_text_does_not_matter(soak: Soak) -> None:
    modifiers = ("skip_if: 1 > 2", "once: true", "invert: true", "as_long_as: 1 < 2", "attempts: 2", "save: x")
    told = set()
    for order in itertools.islice(itertools.permutations(modifiers), 0, None, soak.examples(7, 1)):
        text = "do:\n  look:\n  " + "\n  ".join(order)
        simulated = simulate(text, fails={"look": fails(1, 2)})
        simulated.advance(10)
        told.add(tuple(simulated.told))
    assert len(told) == 1


@pytest.mark.parametrize(("modifier", "is_open"), [("only_if", True), ("skip_if", False)])
def test_whether_a_node_starts_is_asked_once_and_not_while_it_runs(modifier: str, is_open: bool) -> None:
    simulated = simulate(f"do:\n  sequence: [a, b]\n  {modifier}: $door")
    simulated.set("door", is_open)
    simulated.at(0.5, lambda: simulated.set("door", not is_open))
    assert simulated.advance(5) == "success"
    assert skills(simulated) == ["0 a", "1 b"]


@pytest.mark.parametrize("modifier", ["once: false", "optional: false", "invert: false"])
def test_a_flag_that_is_false_changes_nothing(modifier: str) -> None:
    simulated = simulate(f"do:\n  repeat: 2\n  do:\n    a:\n    {modifier}", fails={"a": fails(2)})
    assert simulated.advance(5) == "failure"
    assert simulated.calls == {"a": 2}


@pytest.mark.parametrize("modifier", ["once: true", "cooldown: 9 s"])
def test_what_was_skipped_inside_has_not_ended_for_once_and_cooldown(modifier: str) -> None:
    text = "do:\n  repeat: 2\n  do:\n    - if: $door\n      then: a\n      {}\n    - b"
    simulated = simulate(text.format(modifier))
    simulated.set("door", False)
    simulated.at(0.5, lambda: simulated.set("door", True))
    assert simulated.advance(9) == "success"
    assert skills(simulated) == ["0 b", "1 a", "2 b"]


def test_a_halt_is_no_end_for_a_cooldown_either() -> None:
    text = "do:\n  sequence:\n    - a:\n      cooldown: 9 s\n  attempt_timeout: 2 s\n  attempts: 2"
    simulated = simulate(text, takes={"a": 5.0})
    simulated.advance(20)
    assert skills(simulated) == ["0 a", "2 a"]


def test_cooldown_counts_within_one_run_of_the_mission() -> None:
    simulated = simulate("do: {repeat: 2, do: {use: inner}}", {"inner": "do: [{a: {}, cooldown: 9 s}, b]"})
    assert simulated.advance(20) == "success"
    assert simulated.calls == {"a": 2, "b": 2}


HEARD = """
interrupts:
  low:
    when: $battery < 50 %
    do: recharge
do:
  repeat: 2
  do:
    - a:
      cooldown: 4 s
    - b
"""


@pytest.mark.parametrize(("cooldown", "calls"), [("4 s", 2), ("14 s", 1)])
def test_the_time_of_an_interrupt_counts_for_a_cooldown(cooldown: str, calls: int) -> None:
    simulated = simulate(HEARD.replace("4 s", cooldown), takes={"recharge": 10.0})
    simulated.set("battery", 1.0)
    simulated.at(1.5, lambda: simulated.set("battery", 0.4))
    assert simulated.advance(40) == "success"
    assert simulated.calls["a"] == calls


def test_a_cooldown_stands_still_while_the_mission_is_paused() -> None:
    simulated = simulate(HEARD)
    simulated.set("battery", 1.0)
    simulated.at(1.5, lambda: simulated.engine.pause(1.5))
    simulated.at(11.5, lambda: simulated.engine.resume(11.5))
    assert simulated.advance(40) == "success"
    assert skills(simulated) == ["0 a", "1 b", "11.5 b"]


def test_a_cooldown_in_a_reaction_that_was_cut_lasts_as_long_as_it_says() -> None:
    text = """
    interrupts:
      open:
        when: $door
        do: {wait: 8 s}
      low:
        when: $battery < 50 %
        do:
          - a:
            cooldown: 5 s
          - b
    do: {wait: 60 s}
    """
    simulated = simulate(text)
    for time, name, value in (
        (1.0, "battery", 0.4),
        (1.5, "door", True),
        (12.0, "battery", 1.0),
        (13.0, "battery", 0.4),
    ):
        simulated.at(time, lambda name=name, value=value: simulated.set(name, value))  # type: ignore[misc]
    simulated.advance(40)
    assert skills(simulated) == ["1 a", "9.5 a", "10.5 b", "13 b"]


@pytest.mark.parametrize("modifier", ["optional", "invert"])
def test_what_was_skipped_inside_stays_so_whatever_turns_results(modifier: str) -> None:
    simulated = simulate(f"do:\n  fallback:\n    - if: 1 > 2\n      then: a\n      {modifier}: true\n    - b")
    assert simulated.advance(5) == "success"
    assert skills(simulated) == ["0 b"]


def test_what_as_long_as_cuts_is_not_tried_again() -> None:
    simulated = simulate("do:\n  a:\n  attempts: forever\n  as_long_as: not $door", takes={"a": 5.0})
    simulated.set("door", False)
    simulated.at(2.0, lambda: simulated.set("door", True))
    simulated.at(2.5, lambda: simulated.set("door", False))
    assert simulated.advance(20) == "failure"
    assert simulated.now == 2.0


@pytest.mark.parametrize("leaf", ["a", "{wait: 2 s}"])
def test_a_result_beats_the_deadline_of_an_attempt_at_the_same_instant(leaf: str) -> None:
    simulated = simulate(f"do:\n  sequence: [{leaf}]\n  attempts: 2\n  attempt_timeout: 2 s", takes={"a": 2.0})
    assert simulated.advance(20) == "success"
    assert simulated.now == 2.0
