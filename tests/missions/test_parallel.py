"""Several nodes at the same time: what decides, what is halted, what the outcome is."""

from __future__ import annotations

import itertools

import pytest

from rbxcompose.missions.engine.events import Transition
from tests.loops import for_all
from tests.missions.simulated import Simulated, simulate
from tests.missions.test_composites import fails, skills


def parallel(options: str = "", **settings: object) -> Simulated:
    """Return a parallel of a (1 s), b (2 s) and c (3 s)."""
    lines = "".join(f"  {line}\n" for line in options.splitlines())
    text = f"do:\n  parallel:\n    one: a\n    two: b\n    three: c\n{lines}"
    return simulate(text, takes={"a": 1.0, "b": 2.0, "c": 3.0}, **settings)


def test_all_begin_at_once_and_it_succeeds_when_all_have() -> None:
    simulated = parallel()
    assert simulated.advance(10) == "success"
    assert skills(simulated) == ["0 a", "0 b", "0 c"]
    assert simulated.now == 3.0


@for_all(
    "options, failing, outcome, at",
    [
        ("", "b", "failure", 2.0),
        ("succeed_when: any", "", "success", 1.0),
        ("succeed_when: any", "a", "failure", 1.0),
        ("succeed_when: any\nfail_when: all", "a", "success", 2.0),
        ("succeed_when: any\nfail_when: all", "abc", "failure", 3.0),
        ("succeed_when: 2", "", "success", 2.0),
        ("succeed_when: 2\nfail_when: 2", "a", "success", 3.0),
        ("succeed_when: 2\nfail_when: all", "ab", "failure", 2.0),  # two can no longer succeed
        ("fail_when: 2", "a", "failure", 1.0),  # neither can all
        ("ends_with: two", "a", "success", 2.0),
        ("ends_with: two", "b", "failure", 2.0),
        ("ends_with: two\nwait_for_all: true", "b", "failure", 3.0),
        ("succeed_when: any\nwait_for_all: true", "", "success", 3.0),
        ("wait_for_all: true", "a", "failure", 3.0),
    ],
)
def test_what_decides_and_when(options: str, failing: str, outcome: str, at: float) -> None:
    simulated = parallel(options, fails=dict.fromkeys(failing, fails(1)))
    assert simulated.advance(10) == outcome
    assert simulated.now == at
    assert simulated.running == {}


def test_the_story_tells_how_each_named_branch_ended() -> None:
    simulated = parallel("ends_with: two", fails={"a": fails(1)})
    simulated.advance(10)
    assert [line for line in simulated.told if "branch" in line] == [
        "1 branch one: failure",
        "2 branch two: success",
        "2 branch three: halted",
    ]


def test_a_branch_without_a_skill_is_told_and_one_with_a_node_that_has_a_name_is_told_once() -> None:
    text = """
        do:
          parallel:
            watch:
              wait_for: $door
            drive:
              a:
              name: driving
            talk:
              log: On my way
          ends_with: drive
    """
    simulated = simulate(text, takes={"a": 2.0})
    simulated.set("door", False)
    simulated.at(1.0, lambda: simulated.set("door", True))
    simulated.advance(10)
    assert [line for line in simulated.told if "branch" in line or "driving" in line] == [
        "0 driving begins",
        "0 branch talk: success",
        "1 branch watch: success",
        "2 driving: success",
    ]


def test_a_number_may_come_from_the_data() -> None:
    simulated = simulate("data: {few: 1}\ndo:\n  parallel: [a, b]\n  succeed_when: $few", takes={"b": 9.0})
    assert simulated.advance(20) == "success"
    assert simulated.now == 1.0


def test_exactly_the_branches_that_run_are_halted() -> None:
    simulated = parallel("succeed_when: 2")
    simulated.advance(10)
    assert [line for line in simulated.told if "halted" in line] == ["2 c: halted (2 s)", "2 branch three: halted"]


def test_failure_beats_success_of_the_same_instant() -> None:
    text = "do:\n  parallel: [a, b]\n  succeed_when: any"
    assert simulate(text, fails={"b": fails(1)}).advance(10) == "failure"


def test_all_branches_are_ticked_before_it_is_judged_whatever_their_order() -> None:
    told = set()
    for order in itertools.permutations(("- a", "- b", "- check: $door")):
        steps = "\n    ".join(order)
        simulated = simulate(f"do:\n  parallel:\n    {steps}")
        simulated.set("door", False)
        told.add((simulated.advance(10), tuple(sorted(skills(simulated)))))
    assert told == {("failure", ("0 a", "0 b"))}


def test_a_branch_that_has_ended_is_not_done_again() -> None:
    simulated = simulate("do:\n  parallel:\n    - a\n    - wait: 5 s", takes={"a": 1.0})
    assert simulated.advance(10) == "success"
    assert simulated.calls == {"a": 1}


@pytest.mark.parametrize("options", ["succeed_when: any", "succeed_when: all", "fail_when: all"])
def test_skipped_branches_are_left_out_of_the_count(options: str) -> None:
    text = f"do:\n  parallel:\n    - a\n    - b:\n      only_if: false\n  {options}"
    assert simulate(text).advance(10) == "success"
    assert simulate(text, fails={"a": fails(1)}).advance(10) == "failure"


def test_all_skipped_is_skipped() -> None:
    text = "do:\n  fallback:\n    - parallel:\n        - a:\n          only_if: false\n    - b"
    simulated = simulate(text)
    assert simulated.advance(10) == "success"
    assert skills(simulated) == ["0 b"]


def test_an_interrupt_cuts_all_leaves_and_all_begin_again() -> None:
    text = """
    interrupts:
      low:
        when: $battery < 50 %
        do: recharge
    do:
      parallel: [a, b, {wait: 4 s}]
    """
    simulated = simulate(text, takes={"a": 3.0, "b": 1.0})
    simulated.set("battery", 1.0)
    simulated.at(2.0, lambda: simulated.set("battery", 0.1))
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "0 b", "2 recharge", "3 a"]
    assert simulated.now == 6.0


OUTCOMES = """
machine:
  start: both
  states:
    both:
      do:
        parallel:
          work: look
          monitor:
            wait_for: $door
        succeed_when: any
        fail_when: all
        outcomes:
          opened: $monitor == success
          nobody: $work == empty
          broken: $work == failure
          seen: $work == success and $monitor == halted
          odd: otherwise
      next: {opened: end_opened, nobody: end_nobody, broken: end_broken, seen: finished, odd: failed}
  ends: {end_opened: success, end_nobody: failure, end_broken: failure}
"""


@pytest.mark.parametrize(
    ("outcome", "opens", "failing", "end"),
    [("", False, False, "success"), ("person", False, False, "success"), ("", True, False, "end_opened")],
)
def test_the_first_condition_over_the_results_that_holds_is_the_outcome(
    outcome: str, opens: bool, failing: bool, end: str
) -> None:
    simulated = simulate(OUTCOMES, outcomes={"look": [outcome]}, fails={"look": fails(1)} if failing else {})
    if opens:
        simulated.at(0.5, lambda: simulated.set("door", True))
    simulated.advance(10)
    assert simulated.ended == end


def test_an_outcome_of_its_own_equals_itself_and_what_it_counts_as() -> None:
    with_any = OUTCOMES.replace("fail_when: all", "fail_when: any")
    nobody = simulate(with_any, outcomes={"look": ["empty"]})
    assert nobody.advance(10) == "failure"
    assert nobody.ended == "end_nobody"
    without = with_any.replace("          nobody: $work == empty\n", "").replace("nobody: end_nobody, ", "")
    broken = simulate(without.replace("end_nobody: failure, ", ""), outcomes={"look": ["empty"]})
    broken.advance(10)
    assert broken.ended == "end_broken"


def test_otherwise_is_the_outcome_when_nothing_else_is() -> None:
    text = OUTCOMES.replace("$work == failure", "$work == skipped").replace("fail_when: all", "fail_when: any")
    simulated = simulate(text, fails={"look": fails(1)})
    assert simulated.advance(10) == "failure"
    assert simulated.ended == "failure"


STATE = """
machine:
  start: s
  states:
    s:
      do:
        parallel:
          work: {}
          other:
            b:
            only_if: false
        {}
      next: {}
  ends: {{met: success}}
"""


def test_a_branch_that_was_skipped_is_so_for_the_outcomes() -> None:
    options = "outcomes: {here: $other == skipped and $other != halted, odd: otherwise}"
    simulated = simulate(STATE.format("a", options, "{here: met, odd: failed}"))
    simulated.advance(5)
    assert simulated.ended == "met"


@pytest.mark.parametrize(
    ("options", "leads", "end"),
    [
        ("ends_with: work", "{person: met, success: failed, failure: failed}", "met"),
        ("succeed_when: any", "{success: finished, failure: failed}", "success"),
    ],
)
def test_the_outcome_of_the_branch_it_ends_with_is_its_own(options: str, leads: str, end: str) -> None:
    simulated = simulate(STATE.format("look", options, leads), outcomes={"look": ["person"]})
    assert simulated.advance(5) == "success"
    assert simulated.ended == end
    (transition,) = [event for _, event in simulated.events if isinstance(event, Transition)]
    assert transition.outcome == ("person" if end == "met" else "success")


def test_the_failure_of_a_branch_that_does_not_count_is_not_the_reason() -> None:
    text = "do:\n  parallel:\n    one: b\n    two: {check: false}\n  ends_with: one"
    simulated = simulate(text, fails={"b": fails(1)})
    assert simulated.advance(5) == "failure"
    assert simulated.told[-1] == "1 mission test: failure: mission.yaml:3: no luck"
