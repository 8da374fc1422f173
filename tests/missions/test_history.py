"""Histories: where a node starts again after it was halted, and when that is forgotten."""

from __future__ import annotations

import pytest

from rbxcompose.missions.program.outcomes import NAMES
from tests.missions.simulated import Simulated, simulate
from tests.missions.test_composites import fails, skills

TOUR = """
data: {{x: 0}}
machine:
  start: tour
  states:
    tour:
      do:
        parallel:
          work:
            {work}
          monitor:
            wait_for: $battery < 50 %
        succeed_when: any
        outcomes: {{done: $work == success, low: $monitor == success, lost: otherwise}}
      next: {{done: finished, low: dock, lost: {lost}}}
    dock:
      do: recharge
      next: {{success: tour, failure: failed}}
"""


def tour(
    work: str, *, at: float = 1.5, lost: str = "failed", used: dict[str, str] | None = None, **settings: object
) -> Simulated:
    """Return a robot whose work is halted when the battery is low, and begins again after `recharge`."""
    text = TOUR.format(work=work.strip().replace("\n", "\n            "), lost=lost)
    simulated = simulate(text, used, **settings)
    simulated.set("battery", 1.0)
    simulated.at(at, lambda: simulated.set("battery", 0.4))
    return simulated


@pytest.mark.parametrize(("history", "after"), [("none", ["2.5 a", "3.5 b"]), ("last", ["2.5 b"]), ("deep", ["2.5 b"])])
def test_a_sequence_starts_again_at_the_child_in_which_it_was_halted(history: str, after: list[str]) -> None:
    simulated = tour(f"sequence: [a, b]\nhistory: {history}")
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b", "1.5 recharge", *after]


def shown(simulated: Simulated, *skills: str) -> list[str]:
    """Return the statuses of the nodes of these skills, in the order of the text."""
    engine = simulated.engine
    return [NAMES[engine.statuses[node.number]] for node in engine.program.nodes if node.skill in skills]


def test_a_new_attempt_shows_no_results_of_the_last_one() -> None:
    simulated = simulate("do: {sequence: [a, {sequence: [b, c]}, d], attempts: 2}", fails={"c": fails(1)})
    simulated.advance(2.5)
    assert shown(simulated, "a", "b", "c", "d") == ["success", "success", "running", "idle"]
    simulated.advance(3.5)  # c has failed
    assert shown(simulated, "a", "b", "c", "d") == ["running", "idle", "idle", "idle"]


def test_an_interrupt_that_acts_again_shows_no_results_of_last_time() -> None:
    simulated = simulate("do: hold\ninterrupts: {opened: {when: $door, do: [a, b]}}", takes={"hold": 30.0})
    for time, is_open in ((1.0, True), (4.0, False), (5.0, True)):
        simulated.at(time, lambda is_open=is_open: simulated.set("door", is_open))  # type: ignore[misc]
    simulated.advance(4.5)
    assert shown(simulated, "a", "b") == ["success", "success"]
    simulated.advance(5.5)
    assert shown(simulated, "a", "b") == ["running", "idle"]


def test_what_starts_again_where_it_was_halted_shows_what_it_had_done() -> None:
    work = "{sequence: [a, b], history: last, optional: true}"
    simulated = simulate(f"do: {{sequence: [wait_for: $door, {work}], reactive: true}}")
    for time, is_open in ((0.0, True), (1.5, False), (2.0, True)):
        simulated.at(time, lambda is_open=is_open: simulated.set("door", is_open))  # type: ignore[misc]
    simulated.advance(2.5)
    assert skills(simulated) == ["0 a", "1 b", "2 b"]
    assert shown(simulated, "a", "b") == ["success", "running"]


def test_a_fallback_starts_again_at_the_child_in_which_it_was_halted() -> None:
    simulated = tour("fallback: [a, b]\nhistory: last", fails={"a": fails(1)})
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b", "1.5 recharge", "2.5 b"]


def test_a_reactive_sequence_keeps_its_place_if_its_conditions_still_hold() -> None:
    work = "sequence:\n  - check: $door\n  - a\n  - b\nreactive: true\nhistory: last"
    for closes, after in ((False, ["2.5 b"]), (True, [])):
        simulated = tour(work)
        simulated.set("door", True)
        if closes:
            simulated.at(2.0, lambda one=simulated: one.set("door", False))  # type: ignore[misc]
        simulated.advance(20)
        assert skills(simulated) == ["0 a", "1 b", "1.5 recharge", *after]


MACHINE = """
machine:
  history: {}
  start: one
  states:
    one:
      do: a
      next: {{success: two, failure: failed}}
    two:
      do: [b, c]
      next: {{success: finished, failure: failed}}
"""


@pytest.mark.parametrize(
    ("history", "again"), [("none", ["3.5 a", "4.5 b", "5.5 c"]), ("last", ["3.5 b", "4.5 c"]), ("deep", ["3.5 c"])]
)
def test_a_machine_starts_again_in_its_state_and_a_deep_one_also_inside_of_it(history: str, again: list[str]) -> None:
    simulated = tour(MACHINE.format(history), at=2.5)
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b", "2 c", "2.5 recharge", *again]


def test_a_state_that_history_brings_back_is_entered_again() -> None:
    text = MACHINE.format("last").replace("do: [b, c]", "do: [b, c]\n      on_enter: {set: {x: $x + 1}}")
    simulated = tour(text, at=2.5)
    simulated.advance(20)
    assert simulated.engine.data["x"] == 2


def test_a_sequence_that_failed_starts_again_at_the_child_that_failed() -> None:
    text = "do:\n  sequence: [a, b, c]\n  history: last\n  attempts: 2"
    simulated = simulate(text, fails={"b": fails(1)})
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b", "2 b", "3 c"]


def test_a_fallback_that_failed_begins_at_its_first_child() -> None:
    text = "do:\n  fallback: [a, b]\n  history: last\n  attempts: 2"
    simulated = simulate(text, fails={"a": fails(1), "b": fails(1)})
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b", "2 a"]


def test_a_place_is_forgotten_when_the_node_ends_otherwise() -> None:
    text = "do:\n  repeat: 2\n  do:\n    sequence: [a, b]\n    history: deep"
    simulated = simulate(text)
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b", "2 a", "3 b"]


def test_a_place_is_forgotten_at_each_new_item_of_a_loop_around_it() -> None:
    text = """
    do:
      for: x
      in: [1, 2]
      if_one_fails: next
      do:
        sequence: [a, b]
        history: last
      """
    simulated = simulate(text, fails={"b": fails(1)})
    assert simulated.advance(20) == "failure"
    assert skills(simulated) == ["0 a", "1 b", "2 a", "3 b"]


@pytest.mark.parametrize(
    ("history", "again"), [("last", ["2.5 a", "3.5 b", "4.5 a", "5.5 b"]), ("deep", ["2.5 b", "3.5 a", "4.5 b"])]
)
def test_a_deep_one_keeps_the_rounds_of_loops(history: str, again: list[str]) -> None:
    work = f"sequence:\n  - repeat: 2\n    do: [a, b]\nhistory: {history}"
    simulated = tour(work)
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b", "1.5 recharge", *again]


def test_a_deep_one_keeps_the_item_of_a_loop_and_what_is_left() -> None:
    work = "sequence:\n  - for: word\n    in: [1, 2, 3]\n    do:\n      say: $word\nhistory: deep"
    simulated = tour(work)
    assert simulated.advance(20) == "success"
    assert [line for line in skills(simulated) if "say" in line] == ["0 say 1", "1 say 2", "2.5 say 2", "3.5 say 3"]


def test_a_deep_one_keeps_what_was_chosen() -> None:
    work = "sequence:\n  - if: $door\n    then: [a, b]\n    else: c\nhistory: deep"
    simulated = tour(work)
    simulated.set("door", True)
    simulated.at(2.0, lambda: simulated.set("door", False))
    simulated.advance(20)
    assert skills(simulated) == ["0 a", "1 b", "1.5 recharge", "2.5 b"]


def test_a_deep_one_keeps_which_branches_have_ended() -> None:
    work = "sequence:\n  - parallel: [a, b]\nhistory: deep"
    simulated = tour(work, takes={"b": 3.0})
    simulated.advance(20)
    assert skills(simulated) == ["0 a", "0 b", "1.5 recharge", "2.5 b"]


COUNTING = "data: {n: 0}\noutputs: {n: $n}\ndo:\n  - set: {n: $n + 1}\n  - a\n  - b\n"


@pytest.mark.parametrize(
    ("options", "history", "again", "count"),
    [
        ("", "none", ["2.5 a", "3.5 b"], 1),
        ("", "deep", ["2.5 b"], 1),
        ("", "last", ["2.5 b"], 0),
        ("last", "last", ["2.5 b"], 0),
    ],
)
def test_a_use_keeps_its_place_and_a_deep_one_also_its_data(
    options: str, history: str, again: list[str], count: int
) -> None:
    used = COUNTING
    if options:
        steps = "  sequence:\n    - set: {n: $n + 1}\n    - a\n    - b\n  history: last\n"
        used = f"data: {{n: 0}}\noutputs: {{n: $n}}\ndo:\n{steps}"
    simulated = tour(f"use: counting\nhistory: {history}\nsave: got", used={"counting": used})
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b", "1.5 recharge", *again]
    assert simulated.engine.data["got"] == {"n": count}


def test_restarting_by_name_forgets_the_place() -> None:
    text = """
    interrupts:
      open:
        when: $door
        afterwards: {restart: tour}
    do:
      sequence: [a, b]
      history: last
      name: tour
    """
    simulated = simulate(text)
    simulated.at(1.5, lambda: simulated.set("door", True))
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b", "1.5 a", "2.5 b"]


def test_what_is_inside_of_what_is_restarted_keeps_its_own_history() -> None:
    text = """
    interrupts:
      open:
        when: $door
        afterwards: {restart: room}
    do:
      for: room
      in: [1]
      do:
        - c
        - sequence: [a, b]
          history: last
    """
    simulated = simulate(text)
    simulated.at(2.5, lambda: simulated.set("door", True))
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 c", "1 a", "2 b", "2.5 c", "3.5 b"]


def test_restarting_the_whole_forgets_the_places() -> None:
    text = "interrupts:\n  open:\n    when: $door\n    afterwards: restart\ndo:\n  sequence: [a, b]\n  history: deep"
    simulated = simulate(text)
    simulated.at(1.5, lambda: simulated.set("door", True))
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b", "1.5 a", "2.5 b"]


@pytest.mark.parametrize("around", ["sequence", "machine"])
def test_what_was_not_gone_back_to_is_forgotten_with_the_node_around_it(around: str) -> None:
    """The inner list keeps its place by `deep`, but is skipped when it would take it up: it then begins afresh."""
    inner = "{sequence: [a, b], skip_if: $door}"
    step = f"sequence:\n        - {inner}\n      history: deep"
    state = f"machine:\n        history: deep\n        start: s\n        states: {{s: {{do: {inner}, next: finished}}}}"
    state = state.replace("next: finished", "next: {success: finished, failure: failed}")
    work = f"repeat: 2\ndo:\n    - {step if around == 'sequence' else state}\n    - c"
    simulated = tour(work)
    simulated.set("door", False)
    simulated.at(2.0, lambda: simulated.set("door", True))
    simulated.at(3.0, lambda: simulated.set("door", False))
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b", "1.5 recharge", "2.5 c", "3.5 a", "4.5 b", "5.5 c"]


def test_a_reactive_list_that_failed_keeps_the_place_of_its_condition_only() -> None:
    work = "sequence:\n  - check: not $door\n  - [a, b]\nreactive: true\nhistory: deep"
    simulated = tour(work, lost="tour")
    simulated.set("door", False)
    simulated.at(2.0, lambda: simulated.set("door", True))
    simulated.at(2.5, lambda: simulated.set("battery", 1.0))
    simulated.at(4.0, lambda: simulated.set("door", False))
    assert simulated.advance(20) == "success"
    first, *_, last, end = skills(simulated)
    assert (first, last.split()[1], end.split()[1]) == ("0 a", "a", "b")
