"""Machines: transitions, ends, what is done on entering and leaving."""

from __future__ import annotations

import pytest

from rbxcompose.missions.engine.events import Logged, Transition
from rbxcompose.missions.engine.world import Settings
from tests.missions.simulated import Simulated, simulate
from tests.missions.test_composites import fails, skills

ROUND = """
machine:
  start: out
  states:
    out:
      do: a
      next:
        success: back
        failure: help
    help:
      do: c
      next:
        success: out
        failure: failed
    back:
      do: b
      next:
        success: finished
        failure: failed
"""


def ways(simulated: Simulated) -> list[str]:
    """Return the transitions that were made."""
    events = (event for _, event in simulated.events)
    return [f"{event.state}-{event.outcome}-{event.to}" for event in events if isinstance(event, Transition)]


def logged(simulated: Simulated) -> list[str]:
    """Return what was logged, with the times."""
    return [f"{time:g} {event.text}" for time, event in simulated.events if isinstance(event, Logged)]


def test_how_a_state_ends_decides_which_is_next() -> None:
    simulated = simulate(ROUND, fails={"a": fails(1)})
    assert simulated.advance(20) == "success"
    assert ways(simulated) == ["out-failure-help", "help-success-out", "out-success-back", "back-success-finished"]
    assert skills(simulated) == ["0 a", "1 c", "2 a", "3 b"]


def test_the_ends_that_always_exist_are_success_and_failure_from_outside() -> None:
    assert simulate(ROUND).advance(20) == "success"
    simulated = simulate(ROUND, fails={"b": fails(1)})
    assert simulated.advance(20) == "failure"
    assert simulated.ended == "failure"


def test_an_end_of_its_own_keeps_its_name_and_counts_as_it_says() -> None:
    text = ROUND.replace("failure: failed", "failure: lost") + "  ends: {lost: failure}\n"
    simulated = simulate(text, fails={"b": fails(1)})
    assert simulated.advance(20) == "failure"
    assert simulated.ended == "lost"
    assert simulated.told[-1].endswith("mission test: failure: ended in lost: mission.yaml:16: no luck")


@pytest.mark.parametrize("counts_as", ["success", "failure"])
def test_the_name_of_an_end_is_in_the_story(counts_as: str) -> None:
    states = "  states:\n    one:\n      do:\n        log: hi\n      next: nobody"
    text = "machine:\n  start: one\n  ends: {nobody: %s}\n" + states
    simulated = simulate(text % counts_as)
    assert simulated.advance(20) == counts_as
    assert simulated.told[-1] == f"0 mission test: {counts_as}: ended in nobody"


INNER = """
machine:
  start: seek
  states:
    seek:
      machine:
        start: turn
        states:
          turn:
            do: look
            next: {person: met, success: turn, failure: finished}
        ends: {met: success}
      next: {met: greet, success: finished}
    greet:
      do:
        log: hello
      next: finished
"""


def test_an_end_of_a_machine_within_a_state_is_an_outcome_of_that_state() -> None:
    simulated = simulate(INNER, outcomes={"look": ["", "person"]})
    assert simulated.advance(20) == "success"
    assert ways(simulated) == ["turn-success-turn", "turn-person-met", "seek-met-greet", "greet-success-finished"]


def test_an_outcome_without_a_transition_takes_that_of_what_it_counts_as() -> None:
    simulated = simulate(INNER, outcomes={"look": ["empty"]})
    assert simulated.advance(20) == "success"
    assert ways(simulated) == ["turn-empty-finished", "seek-success-finished"]


def test_the_outcome_of_a_list_is_that_of_the_child_that_ended_it() -> None:
    for body, outcomes, taken in (
        ("[a, look]", ["person"], "person"),
        ("[look, a]", ["person"], "success"),
        ("[look, a]", ["empty"], "empty"),
        ("{fallback: [look, a]}", ["empty"], "success"),
        ("{fallback: [look, a]}", ["person"], "person"),
    ):
        text = (
            "machine:\n  start: s\n  states:\n"
            f"    s:\n      do: {body}\n      next: {{success: finished, failure: failed}}"
        )
        simulated = simulate(text, outcomes={"look": outcomes})
        simulated.advance(20)
        assert [event.outcome for _, event in simulated.events if isinstance(event, Transition)] == [taken]


def test_an_outcome_that_the_skill_did_not_declare_is_a_reported_failure() -> None:
    simulated = simulate(INNER, outcomes={"look": ["ghost"]})
    simulated.advance(20)
    assert ways(simulated)[0] == "turn-failure-finished"
    assert any("an outcome that it does not declare: 'ghost'" in line for line in simulated.told)


def test_a_skipped_body_is_a_success() -> None:
    text = (
        "machine:\n  start: s\n  states:\n    s:\n"
        "      do:\n        a:\n        only_if: false\n      next: {success: finished, failure: failed}"
    )
    simulated = simulate(text)
    assert simulated.advance(5) == "success"
    assert ways(simulated) == ["s-success-finished"]


def test_one_transition_per_tick_so_that_states_that_never_wait_are_slowed_down_and_named() -> None:
    text = """
    data: {n: 0}
    machine:
      start: one
      states:
        one:
          do: {set: {n: $n + 1}}
          next: two
        two:
          do: {log: x}
          next: one
    """
    simulated = simulate(text)
    simulated.engine.tick(0.0)
    assert simulated.engine.data["n"] == 50
    assert simulated.told[-1].startswith("0 do.machine: does not wait") or "does not wait" in simulated.told[-1]


HOOKED = """
interrupts:
  low:
    when: $battery < 50 %
    do: recharge
  open:
    when: $door
    do: react
    afterwards: {restart: out}
do:
  machine:
    start: out
    states:
      out:
        do: a
        on_enter: {log: in}
        on_exit: {log: gone}
        next: {success: finished, failure: failed}
  timeout: 5 s
"""


def hooked(**settings: object) -> Simulated:
    simulated = simulate(HOOKED, **settings)
    simulated.set("battery", 1.0)
    return simulated


def test_entering_and_leaving_are_told_once() -> None:
    simulated = hooked()
    simulated.advance(20)
    assert logged(simulated) == ["0 in", "1 gone"]


def test_leaving_counts_also_when_something_in_the_mission_halts_the_state() -> None:
    simulated = hooked(takes={"a": 9.0})
    assert simulated.advance(20) == "failure"
    assert logged(simulated) == ["0 in", "5 gone"]


def test_an_interrupt_halts_leaves_and_not_states() -> None:
    simulated = hooked(takes={"a": 2.0})
    simulated.at(1.0, lambda: simulated.set("battery", 0.1))
    simulated.advance(20)
    assert logged(simulated) == ["0 in", "4 gone"]


def test_a_state_that_is_restarted_by_name_is_left_and_entered() -> None:
    simulated = hooked(takes={"a": 2.0})
    simulated.at(1.0, lambda: simulated.set("door", True))
    simulated.advance(20)
    assert logged(simulated) == ["0 in", "2 gone", "2 in", "4 gone"]


def test_a_mission_that_is_ended_from_outside_leaves_nothing() -> None:
    simulated = hooked(takes={"a": 2.0})
    simulated.advance(1.0)
    simulated.engine.abort(1.0)
    assert logged(simulated) == ["0 in"]


@pytest.mark.parametrize("moment", ["on_enter", "on_exit"])
def test_what_goes_wrong_on_entering_or_leaving_fails_the_state(moment: str) -> None:
    text = f"""
    data: {{n: 0}}
    machine:
      start: s
      states:
        s:
          do: a
          {moment}:
            log: told
            set: {{n: 1 / $n}}
          next: {{success: finished, failure: failed}}
    """
    simulated = simulate(text)
    assert simulated.advance(5) == "failure"
    assert logged(simulated) == []
    assert ways(simulated) == ["s-failure-failed"]


def test_modifiers_of_a_state_are_around_its_body() -> None:
    text = (
        "machine:\n  start: s\n  states:\n    s:\n"
        "      do: [a, b]\n      attempts: 2\n      timeout: 9 s\n      next: {success: finished, failure: failed}"
    )
    simulated = simulate(text, fails={"b": fails(1)})
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b", "2 a", "3 b"]


def test_a_body_that_never_ends_needs_no_next() -> None:
    text = "machine:\n  start: s\n  states:\n    s:\n      do: {repeat: forever, do: [{wait: 1 s}]}"
    assert simulate(text).advance(5) == "running"


def test_a_machine_stands_anywhere_in_a_tree() -> None:
    inner = "\n".join(f"    {line}" for line in ROUND.strip().splitlines())
    simulated = simulate(f"do:\n  - first\n  -\n{inner}\n  - second")
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 first", "1 a", "2 b", "3 second"]


def test_it_may_be_told_in_which_state_to_begin_the_first_time() -> None:
    simulated = simulate(ROUND, settings=Settings(start_at={0: "back"}))
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 b"]


def test_a_failure_that_does_not_count_has_no_outcome_of_its_own() -> None:
    text = (
        "machine:\n  start: s\n  states:\n    s: {do: look, optional: true, next: {success: finished, person: failed}}"
    )
    simulated = simulate(text, outcomes={"look": ["empty"]})
    assert simulated.advance(5) == "success"
    assert ways(simulated) == ["s-success-finished"]


ENTERED = """
machine:
  start: s
  states:
    s:
      do: a
      on_enter: {{log: in}}
      on_exit: {{log: out}}
      {}
      next: {{success: finished, failure: failed}}
"""


@pytest.mark.parametrize(
    ("modifier", "told"),
    [("attempts: 2", ["0 in", "2 out"]), ("timeout: 0.5 s", ["0 in", "0.5 out"]), ("skip_if: true", ["0 in", "0 out"])],
)
def test_a_state_is_entered_and_left_once_around_all_its_modifiers(modifier: str, told: list[str]) -> None:
    simulated = simulate(ENTERED.format(modifier), fails={"a": fails(1)})
    simulated.advance(5)
    assert logged(simulated) == told
