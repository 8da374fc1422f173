"""Reactive lists, lists in a random order, and what is skipped."""

from __future__ import annotations

import pytest

from rbxcompose.base.expressions.parser import parse
from rbxcompose.missions.engine.world import Settings, Watched
from tests.missions.simulated import PLACES, simulate
from tests.missions.test_composites import fails, skills


@pytest.mark.parametrize(("reactive", "outcome"), [("true", "failure"), ("false", "success")])
def test_earlier_conditions_of_a_reactive_sequence_are_asked_again(reactive: str, outcome: str) -> None:
    simulated = simulate(f"do:\n  sequence:\n    - check: not $door\n    - a\n    - b\n  reactive: {reactive}")
    simulated.set("door", False)
    simulated.at(0.5, lambda: simulated.set("door", True))
    assert simulated.advance(5) == outcome
    assert ("0.5 a: halted (0.5 s)" in simulated.told) == (reactive == "true")


def test_what_runs_is_halted_and_starts_again_when_the_condition_comes_back() -> None:
    text = "do:\n  sequence:\n    - wait_for: $door\n    - a\n    - b\n  reactive: true"
    simulated = simulate(text, takes={"b": 2.0})
    for time, is_open in ((0.0, True), (1.5, False), (4.0, True)):
        simulated.at(time, lambda is_open=is_open: simulated.set("door", is_open))  # type: ignore[misc]
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b", "4 a", "5 b"]


def test_a_reactive_fallback_takes_up_an_earlier_condition_that_now_holds() -> None:
    text = "do:\n  fallback:\n    - check: $door\n    - a\n  reactive: true"
    simulated = simulate(text, takes={"a": 9.0})
    simulated.at(1.0, lambda: simulated.set("door", True))
    assert simulated.advance(20) == "success"
    assert simulated.now == 1.0
    assert simulated.running == {}


def test_only_conditions_are_asked_again_and_not_skills() -> None:
    text = "do:\n  sequence:\n    - a\n    - sequence:\n        - check: $battery > 10 %\n    - b\n  reactive: true"
    simulated = simulate(text)
    simulated.set("battery", 0.9)
    simulated.at(1.5, lambda: simulated.set("battery", 0.5))
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b"]


def test_a_list_of_conditions_is_a_condition() -> None:
    text = (
        "do:\n  sequence:\n    - fallback:\n"
        "        - check: $door\n        - check: $battery > 10 %\n    - a\n  reactive: true"
    )
    simulated = simulate(text, takes={"a": 5.0})
    simulated.set("door", False)
    simulated.set("battery", 0.9)
    simulated.at(2.0, lambda: simulated.set("battery", 0.05))
    assert simulated.advance(1.0) == "running"
    assert simulated.engine.reads() == {"battery", "door"}
    assert simulated.advance(20) == "failure"
    assert simulated.now == 2.0


def test_a_condition_that_reads_an_age_is_asked_at_the_rate() -> None:
    text = "rate: 10 Hz\ndo:\n  sequence:\n    - check: age($battery) < 2 s\n    - a\n  reactive: true"
    simulated = simulate(text, takes={"a": 9.0})
    simulated.set("battery", 0.9)
    assert simulated.advance(20) == "failure"
    assert simulated.now == pytest.approx(2.0)


@pytest.mark.parametrize("kind", ["sequence", "fallback"])
def test_a_random_order_is_drawn_again_at_each_start_and_is_the_same_for_the_same_seed(kind: str) -> None:
    text = f"do:\n  repeat: 6\n  do:\n    {kind}: [a, b, c]\n    order: random\n    optional: true"
    orders = []
    for seed in (1, 1, 2):
        failing = {} if kind == "sequence" else dict.fromkeys("abc", fails(*range(9)))
        simulated = simulate(text, settings=Settings(seed=seed), fails=failing)
        assert simulated.advance(40) == "success"
        orders.append([line.split()[1] for line in skills(simulated)])
    first = orders[0]
    assert orders[1] == first != orders[2]
    rounds = ["".join(first[start : start + 3]) for start in range(0, 18, 3)]
    assert {"".join(sorted(round_)) for round_ in rounds} == {"abc"}
    assert len(set(rounds)) > 1


def test_a_random_order_lasts_while_the_list_runs_and_over_an_interrupt() -> None:
    text = "interrupts:\n  open:\n    when: $door\n    do: react\ndo:\n  sequence: [a, b, c]\n  order: random"
    simulated = simulate(text)
    simulated.at(1.5, lambda: simulated.set("door", True))
    assert simulated.advance(20) == "success"
    done = [line.split()[1] for line in skills(simulated)]
    assert sorted(done) == sorted(["a", "b", "c", "react", done[1]])


@pytest.mark.parametrize(
    "node",
    [
        "choose: 3\n  cases: {4: a}",
        "for: x\n  in: [1]\n  if_one_fails: next\n  do:\n    a:\n    skip_if: true",
        "parallel:\n    - a:\n      once: false\n      only_if: false",
        "a:\n  skip_if: true",
        "repeat: 2\n  do:\n    repeat: 0\n    do: a",
    ],
)
def test_what_is_skipped_is_passed_over_by_a_fallback_and_ends_a_mission_in_success(node: str) -> None:
    assert simulate(f"do:\n  {node}").advance(5) == "success"
    indented = node.replace("\n  ", "\n      ")
    simulated = simulate(f"do:\n  fallback:\n    - {indented}\n    - b")
    assert simulated.advance(5) == "success"
    assert skills(simulated) == ["0 b"]


def test_a_mission_with_nothing_to_do_is_a_success_for_who_uses_it() -> None:
    simulated = simulate("do:\n  fallback:\n    - use: nothing\n    - b", {"nothing": "do: {repeat: 0, do: a}"})
    assert simulated.advance(5) == "success"
    assert skills(simulated) == []


@pytest.mark.parametrize(
    "node",
    [
        "sequence: [a, {b: {}, only_if: false}]",
        "sequence: [{b: {}, only_if: false}, a]",
        "for: x\n      in: [1, 2]\n      do: {a: {}, only_if: $x == 1}",
        "repeat: 2\n      do: {a: {}, once: true}",
        "repeat: 2\n      until: $door\n      do: {a: {}, once: true}",
    ],
)
def test_what_did_something_is_not_skipped(node: str) -> None:
    simulated = simulate(f"do:\n  fallback:\n    - {node}\n    - c")
    assert simulated.advance(5) == "success"
    assert skills(simulated) == ["0 a"]


def test_a_fallback_fails_although_its_last_node_was_skipped() -> None:
    simulated = simulate("do: {fallback: [a, {b: {}, only_if: false}]}", fails={"a": fails(1)})
    assert simulated.advance(5) == "failure"


@pytest.mark.parametrize(
    ("condition", "is_polled"),
    [
        ("age($door) < 1 s", True),
        ("distance($seen, dock) < 1 m", True),
        ("$pose == dock", True),
        ("$battery < 50 %", False),
        ("new($door)", False),
    ],
)
def test_conditions_that_change_without_a_message_are_asked_at_the_rate(condition: str, is_polled: bool) -> None:
    assert Watched.of(parse(condition)).is_polled is is_polled


def test_a_distance_is_asked_at_the_rate_of_the_mission() -> None:
    simulated = simulate("rate: 10 Hz\ndo:\n  - wait_for: distance($pose, kitchen) < 20 cm\n  - a")
    simulated.values["pose"] = PLACES["dock"]
    simulated.at(0.43, lambda: simulated.values.update(pose=PLACES["kitchen"]))
    simulated.engine.tick(0.0)
    assert simulated.engine.next_wake() == 0.1
    simulated.advance(10)
    assert len(skills(simulated)) == 1


def test_a_condition_that_was_skipped_is_asked_again_as_well() -> None:
    text = "do:\n  sequence:\n    - check: $door\n      skip_if: $battery > 50 %\n    - a\n  reactive: true"
    simulated = simulate(text, takes={"a": 9.0})
    simulated.set("door", False)
    simulated.set("battery", 0.9)
    simulated.at(2.0, lambda: simulated.set("battery", 0.4))
    assert simulated.advance(1.0) == "running"
    assert simulated.engine.reads() == {"battery", "door"}
    assert simulated.advance(20) == "failure"
    assert simulated.now == 2.0
