"""Hooks and `save`: when they act, what they see, and what is kept."""

from __future__ import annotations

import pytest

from rbxcompose.missions.engine.events import Logged
from tests.missions.simulated import Simulated, simulate
from tests.missions.test_composites import fails, skills

HOOKS = """
data: {{n: 0}}
do:
  {node}
  on_start: {{log: start}}
  on_success: {{log: success}}
  on_failure: {{log: failure}}
  on_halt: {{log: halt}}
"""


def hooked(node: str, **settings: object) -> Simulated:
    """Return a mission of one node with all hooks."""
    return simulate(HOOKS.format(node=node.replace("\n", "\n  ")), **settings)


def logged(simulated: Simulated) -> list[str]:
    """Return what was logged, with the times."""
    return [f"{time:g} {event.text}" for time, event in simulated.events if isinstance(event, Logged)]


@pytest.mark.parametrize(
    ("node", "settings", "told"),
    [
        ("a:", {}, ["0 start", "1 success"]),
        ("a:", {"fails": {"a": fails(1)}}, ["0 start", "1 failure"]),
        ("a:\nattempts: 3", {"fails": {"a": fails(1, 2)}}, ["0 start", "3 success"]),  # once, not per attempt
        ("a:\noptional: true", {"fails": {"a": fails(1)}}, ["0 start", "1 failure"]),  # before `optional`
        ("a:\ninvert: true", {}, ["0 start", "1 success"]),  # before `invert`
        ("a:\ntimeout: 0.5 s", {}, ["0 start", "0.5 failure"]),  # what is below is halted, this one fails
        ("a:\nonly_if: false", {}, []),  # it does not start
    ],
)
def test_hooks_act_once_and_see_the_result_before_it_is_turned(
    node: str, settings: dict[str, object], told: list[str]
) -> None:
    simulated = hooked(node, **settings)
    simulated.advance(10)
    assert logged(simulated) == told


def test_a_halt_has_a_hook_of_its_own() -> None:
    text = "do:\n  sequence:\n    - a:\n      on_halt: {log: stopped}\n  timeout: 0.5 s"
    simulated = simulate(text)
    simulated.advance(10)
    assert logged(simulated) == ["0.5 stopped"]


def test_an_interrupt_halts_the_leaf_and_what_was_interrupted_starts_again() -> None:
    text = "interrupts:\n  open:\n    when: $door\ndo:\n  a:\n  on_start: {log: start}\n  on_halt: {log: halt}"
    simulated = simulate(text)
    simulated.at(0.5, lambda: simulated.set("door", True))
    simulated.advance(10)
    assert logged(simulated) == ["0 start", "0.5 halt", "0.5 start"]


def test_all_right_sides_are_computed_before_anything_is_set() -> None:
    text = "data: {x: 1, y: 2}\ndo:\n  a:\n  on_success:\n    set: {x: $y, y: $x}"
    simulated = simulate(text)
    simulated.advance(5)
    assert simulated.engine.data == {"x": 2, "y": 1}


def test_a_hook_whose_value_does_not_exist_fails_the_node() -> None:
    simulated = simulate("data: {n: 0}\ndo:\n  a:\n  on_success:\n    set: {n: 1 / $n}\n    log: not told")
    assert simulated.advance(5) == "failure"
    assert logged(simulated) == []


def test_a_hook_publishes() -> None:
    text = "do:\n  a:\n  on_start:\n    publish: greetings\n    message: Off I go"
    simulated = simulate(text)
    simulated.advance(5)
    assert simulated.published == [(0.0, "greetings", {"data": "Off I go"})]


def test_what_a_skill_found_is_kept_before_the_hooks_and_also_after_a_failure() -> None:
    text = "do:\n  look:\n  save: seen\n  on_failure:\n    log: $seen.people people\n  optional: true"
    simulated = simulate(text, tells={"look": {"people": 3}}, fails={"look": fails(1)})
    assert simulated.advance(5) == "success"
    assert simulated.engine.data["seen"] == {"people": 3}
    assert logged(simulated) == ["1 3 people"]


def test_what_was_not_kept_yet_has_not_arrived() -> None:
    text = "do:\n  - if: $seen.people > 1\n    then: b\n    else: c\n  - look:\n    save: seen"
    simulated = simulate(text, tells={"look": {"people": 3}})
    simulated.advance(5)
    assert skills(simulated)[0] == "0 c"


def test_the_answer_of_a_call_is_kept() -> None:
    text = "do:\n  - call: light\n    request: {data: true}\n    save: answer\n  - log: $answer.message"
    simulated = simulate(text, tells={"light": {"message": "it is on"}})
    assert simulated.advance(5) == "success"
    assert logged(simulated) == ["1 it is on"]


def test_a_single_value_is_the_only_field_of_a_request() -> None:
    simulated = simulate("do:\n  call: light\n  request: true")
    assert simulated.advance(5) == "success"
    assert simulated.calls == {"light": 1}


def test_the_outputs_of_a_mission_are_kept() -> None:
    used = "inputs:\n  by: {type: number, default: 1}\ndata: {n: 40}\noutputs:\n  sum: $n + $by\n  seen: $door\ndo: a"
    text = "do:\n  - use: adding\n    with: {by: 2}\n    save: got\n  - log: $got.sum"
    simulated = simulate(text, {"adding": used})
    assert simulated.advance(5) == "success"
    assert simulated.engine.data["got"] == {"sum": 42}  # the door is not known: that output is left out


def test_a_sub_mission_sees_of_its_caller_only_what_it_is_given() -> None:
    used = "inputs:\n  n: {type: number}\noutputs: {n: $n}\ndo: {log: $n}"
    simulated = simulate("data: {n: 1, m: 5}\ndo: {use: one, with: {n: $m + 2}}", {"one": used})
    simulated.advance(5)
    assert logged(simulated) == ["0 7"]
    with pytest.raises(AssertionError, match=r"no .*'m'|'\$m'|RBX4104"):
        simulate("data: {m: 5}\ndo: {use: one}", {"one": "do: {log: $m}"})


def test_each_use_has_data_of_its_own_and_begins_with_fresh_ones() -> None:
    used = "data: {n: 0}\noutputs: {n: $n}\ndo: {set: {n: $n + 1}}"
    simulated = simulate("do:\n  - repeat: 3\n    do:\n      use: one\n      save: x\n  - log: $x.n", {"one": used})
    simulated.advance(5)
    assert logged(simulated) == ["0 1"]


def test_a_text_may_be_given_the_name_of_a_place() -> None:
    text = "data: {room: dock}\ndo: [{set: {room: kitchen}}, {go_to: $room}, {choose: $room, cases: {kitchen: a}}]"
    simulated = simulate(text)
    assert simulated.advance(5) == "success"
    assert simulated.calls == {"go_to": 1, "a": 1}


@pytest.mark.parametrize(
    ("node", "settings", "kept"),
    [
        ("use: one", {}, {"n": 1}),
        ("call: light\n    request: true", {"tells": {"light": {"message": "no"}}, "fails": {"light": fails(1)}}, None),
    ],
)
def test_it_is_kept_also_after_a_failure(node: str, settings: dict[str, object], kept: object) -> None:
    used = "data: {n: 0}\noutputs: {n: $n}\ndo: [{set: {n: 1}}, {check: false}]"
    simulated = simulate(f"do:\n  - {node}\n    save: got\n    optional: true", {"one": used}, **settings)
    assert simulated.advance(5) == "success"
    assert simulated.engine.data["got"] == (kept or {"message": "no"})


def test_an_input_that_is_not_given_has_its_default() -> None:
    used = "inputs:\n  n: {type: number, default: 3}\n  to: {type: place, default: dock}\n"
    used += "do: [{log: $n}, {check: $to == dock}]"
    simulated = simulate("do: {use: one}", {"one": used})
    assert simulated.advance(5) == "success"
    assert logged(simulated) == ["0 3"]


@pytest.mark.parametrize(
    ("option", "level"), [("", "info"), ("\n  level: warn", "warn"), ("\n  level: error", "error")]
)
def test_a_log_has_a_level(option: str, level: str) -> None:
    simulated = simulate(f"do:\n  log: hi{option}")
    simulated.advance(1)
    assert [event.level for _, event in simulated.events if isinstance(event, Logged)] == [level]
