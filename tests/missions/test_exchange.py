"""A mission that runs is exchanged for a changed one: what runs goes on, or the change is refused."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from random import Random
from typing import Any

import pytest
from hypothesis import assume, event, given
from hypothesis import strategies as st

from rbxcompose.missions.engine.engine import Engine
from rbxcompose.missions.engine.exchange import exchange
from rbxcompose.missions.engine.interventions import NotPossible, SetBreakpoints
from rbxcompose.missions.engine.snapshot import save
from rbxcompose.missions.engine.task import Leaf
from rbxcompose.missions.program.outcomes import RUNNING
from rbxcompose.missions.program.program import Program
from tests.loops import for_all
from tests.missions.random_missions import CASES, NODES, Case
from tests.missions.simulated import Simulated, program_of, robot_with, simulate
from tests.missions.test_composites import skills
from tests.missions.test_keeping import logged

QUARTERS = st.integers(1, 24).map(lambda quarters: quarters / 4)


def exchanged(simulated: Simulated, program: Program) -> tuple[str, ...]:
    """Exchange the program of a simulated mission; return the notes."""
    old = simulated.engine
    new = Engine(program, simulated.robot, dict(old.inputs), simulated, simulated.settings)
    done = exchange(old, new)
    for leaf in done.halted:
        old.stop_request(leaf, "the mission was changed", simulated.now)
    simulated.running = {done.requests[leaf]: entry for leaf, entry in simulated.running.items()}
    simulated.held = {done.requests[leaf]: entry for leaf, entry in simulated.held.items()}
    simulated.engine, simulated.program = new, program
    return done.notes


def asked(simulated: Simulated) -> set[int]:
    """Return the leaves that wait for a result that has not arrived."""
    leaves = {task.number for task in simulated.engine.tasks if isinstance(task, Leaf) and task.is_asked}
    return leaves - {leaf for leaf, _ in simulated.engine.arrived}


def with_spans_moved(program: Program) -> Program:
    """Return the same mission, as if lines had been put above it."""

    def moved(node: object) -> object:
        span = node.span  # type: ignore[attr-defined]
        return replace(node, span=span._replace(line=span.line + 1000, end_line=span.end_line + 1000))  # type: ignore[type-var]

    return replace(program, nodes=tuple(map(moved, program.nodes)))  # type: ignore[arg-type]


def moved_back(text: str) -> str:
    return re.sub(r"yaml:1(\d{3})", lambda match: f"yaml:{int(match[1])}", text)


@given(CASES, QUARTERS)
def test_a_mission_that_is_exchanged_for_itself_goes_on_as_if_nothing_had_been(case: Case, at: float) -> None:
    whole, cut = case.simulated(), case.simulated()
    whole.advance(30)
    cut.advance(at)
    if cut.engine.status == RUNNING:
        before = json.dumps(save(cut.engine))
        assert exchanged(cut, with_spans_moved(case.program())) == ()
        assert moved_back(json.dumps(save(cut.engine))) == before
        assert asked(cut) == {*cut.running, *cut.held}
    cut.advance(30)
    assert [moved_back(line) for line in cut.told] == whole.told


def edited(node: Any, chance: Random) -> Any:
    """Return a node with one more step, one less, or one that says something else, somewhere in it."""
    match node:
        case {"sequence": list(steps), **more} if chance.random() < 0.7:
            return {"sequence": edited(steps, chance), **more}
        case [*steps] if steps:
            at, what = chance.randrange(len(steps)), chance.random()
            if what < 0.3:
                return [*steps[:at], {"wait": "0.25 s"}, *steps[at:]]
            if what < 0.5 and len(steps) > 1:
                return [*steps[:at], *steps[at + 1 :]]
            return [*steps[:at], edited(steps[at], chance), *steps[at + 1 :]]
        case {"parallel": list(branches), **more}:
            return {"parallel": [*branches, {"wait": "0.25 s"}], **more}
        case {"do": do, **more} if "machine" not in more:
            return {**more, "do": edited(do, chance)}
        case {"wait": _, **more}:
            return {"wait": "0.5 s", **more}
    return {"sequence": chance.choice(([node, "c"], ["c", node]))}


@given(CASES, st.randoms(use_true_random=False), QUARTERS)
def test_after_an_edit_what_runs_goes_on_or_the_edit_is_refused(case: Case, chance: Random, at: float) -> None:
    simulated = case.simulated()
    simulated.advance(at)
    assume(simulated.engine.status == RUNNING)
    before = json.dumps(save(simulated.engine)), dict(simulated.running)
    try:
        exchanged(simulated, replace(case, body=edited(case.body, chance)).program())
        event("exchanged")
    except NotPossible as error:
        event(re.sub(r"'.*'", "", str(error)).split(": ")[-1])
        assert (json.dumps(save(simulated.engine)), simulated.running) == before
    assert asked(simulated) == {*simulated.running, *simulated.held}
    simulated.advance(30)
    engine = simulated.engine
    waits = bool(simulated.running or simulated.held or engine.next_wake() or engine.reads() or engine.is_paused)
    assert waits or engine.status != RUNNING


@given(CASES, NODES, QUARTERS)
def test_any_other_mission_takes_over_without_losing_a_request_or_is_refused(
    case: Case, body: object, at: float
) -> None:
    simulated = case.simulated()
    simulated.advance(at)
    assume(simulated.engine.status == RUNNING)
    before = json.dumps(save(simulated.engine)), dict(simulated.running)
    try:
        exchanged(simulated, replace(case, body=body).program())
    except NotPossible:
        assert (json.dumps(save(simulated.engine)), simulated.running) == before
    assert asked(simulated) == {*simulated.running, *simulated.held}
    simulated.advance(30)


def changed(before: str, after: str, at: float, **settings: Any) -> tuple[Simulated, tuple[str, ...]]:
    """Return a simulated mission that was changed at a time, after its end, and the notes."""
    simulated = simulate(before, **settings)
    simulated.advance(at)
    notes = exchanged(simulated, program_of(after))
    simulated.advance(20)
    return simulated, notes


def refused(before: str, after: str, at: float) -> str:
    """Return why a change is refused; the mission then ends as if nothing had been."""
    simulated, whole = simulate(before), simulate(before)
    simulated.advance(at)
    with pytest.raises(NotPossible) as caught:
        exchanged(simulated, program_of(after))
    simulated.advance(20)
    whole.advance(20)
    assert simulated.told == whole.told
    return str(caught.value)


@for_all(
    "before, after, at, started",
    [
        ("[a, b, c]", "[a, b, d, c]", 1.5, ["0 a", "1 b", "2 d", "3 c"]),
        ("[a, b, c]", "[d, a, b, c]", 1.5, ["0 a", "1 b", "2 c"]),  # what is before it does not run any more
        ("[a, b, c]", "[b, c]", 1.5, ["0 a", "1 b", "2 c"]),
        ("[a, b, c]", "[a, b]", 1.5, ["0 a", "1 b"]),
        ("[a, b, c]", "[c, b, a]", 1.5, ["0 a", "1 b", "2 a"]),  # it has been moved
        ("[a, b, c]", "[a, [b, d], c]", 1.5, ["0 a", "1 b", "2 d", "3 c"]),  # it has been put into a list
        ("[a, [b, d], c]", "[a, b, c]", 1.5, ["0 a", "1 b", "2 c"]),  # it was left of one
        ("{a: }", "[a, b]", 0.5, ["0 a", "1 b"]),
        ("[a, b]", "{b: }", 1.5, ["0 a", "1 b"]),
        ("{parallel: [a, b]}", "{parallel: [a, b, c]}", 0.5, ["0 a", "0 b", "0.5 c"]),
        ("{parallel: {x: [a, c], y: [b]}}", "{parallel: {y: [b], x: [a, d]}}", 0.5, ["0 a", "0 b", "1 d"]),
        ("{repeat: 2, do: [a, b]}", "{repeat: 2, do: [a, c]}", 0.5, ["0 a", "1 c", "2 a", "3 c"]),
        ("{if: 1 < 2, then: [a, b]}", "{if: 1 > 2, then: c, else: [a, b]}", 0.5, ["0 a", "1 b"]),  # chosen already
        ("[a, b]", "{fallback: [a, b]}", 0.5, ["0 a"]),
        ("{sequence: [a, b], optional: true}", "{sequence: [a, c]}", 0.5, ["0 a", "1 c"]),
    ],
)
def test_what_runs_goes_on_where_it_is(before: str, after: str, at: float, started: list[str]) -> None:
    simulated, _ = changed(f"do: {before}", f"do: {after}", at)
    assert (simulated.ended, skills(simulated)) == ("success", started)


def test_a_leaf_that_runs_and_says_something_else_begins_again() -> None:
    simulated, notes = changed("do: [a, {wait: 5 s}, b]", "do: [a, {wait: 1 s}, b]", 2.5)
    assert skills(simulated) == ["0 a", "3.5 b"]
    assert notes == ("mission.yaml:1: 'wait 1 s' runs and has changed: it begins again",)


def test_a_request_of_a_leaf_that_begins_again_is_stopped() -> None:
    simulated, notes = changed("do: [{go_to: dock}, a]", "do: [{go_to: kitchen}, a]", 0.5)
    assert skills(simulated) == ["0 go_to dock", "0.5 go_to kitchen", "1.5 a"]
    assert "0.5 go_to dock: halted (0.5 s): the mission was changed" in simulated.told
    assert notes == ("mission.yaml:1: 'go_to kitchen' runs and has changed: it begins again",)


def test_a_state_goes_on_by_its_name_and_leaves_by_its_new_transition() -> None:
    text = """
    do:
      machine:
        start: one
        states:
          one: {{do: a, next: {{success: {to}, failure: failed}}}}
          two: {{do: b, next: {{success: finished, failure: failed}}}}
          {more}
    """
    more = "three: {do: c, next: {success: finished, failure: failed}}"
    simulated, _ = changed(text.format(to="two", more=""), text.format(to="three", more=more), 0.5)
    assert skills(simulated) == ["0 a", "1 c"]


def test_data_keep_their_values_unless_they_have_another_type() -> None:
    before = "data: {n: 1, word: hi, gone: 3}\ndo: [{set: {n: 5}}, a, {log: $n $word}]"
    after = "data: {n: 2, word: 7, new: 8}\ndo: [{set: {n: 5}}, a, {log: $n $word $new}]"
    simulated, notes = changed(before, after, 0.5)
    assert logged(simulated) == ["1 5 7 8"]
    assert notes == ("'word' has another type: it begins with 7",)


def test_an_interrupt_is_new_another_one_keeps_that_it_has_acted() -> None:
    before = "interrupts:\n  open: {when: $door, do: react}\ndo: [a, a, a]"
    after = "interrupts:\n  low: {when: $battery < 50 %, do: second}\n  open: {when: $door, do: react}\ndo: [a, a, b]"
    simulated = simulate(before)
    simulated.set("door", True)
    simulated.set("battery", 1.0)
    simulated.advance(1.5)
    exchanged(simulated, program_of(after))
    simulated.at(2.5, lambda: simulated.set("battery", 0.25))
    simulated.advance(20)
    assert skills(simulated) == ["0 react", "1 a", "2 a", "2.5 second", "3.5 a", "4.5 b"]


def test_missions_that_it_uses_go_on_with_it() -> None:
    used = "inputs:\n  by: {type: number, default: 1}\ndo: [a, b, {log: $by, level: warn}]"
    simulated = simulate("do: [{use: inner, with: {by: 2}}, c]", {"inner": used})
    simulated.advance(1.5)
    robot = robot_with({"inner": "inputs:\n  by: {type: number, default: 1}\ndo: [a, b, {log: $by}]"})
    simulated.robot = robot
    exchanged(simulated, program_of("do: [{use: inner, with: {by: 2}}, d]", robot))
    simulated.advance(20)
    assert skills(simulated) == ["0 a", "1 b", "2 d"]
    assert logged(simulated)[-1] == "2 2"


@pytest.mark.parametrize(
    ("before", "after", "at", "why"),
    [
        ("do: [a, b]", "do: [a, c]", 1.5, "mission.yaml:1: 'b' runs, and would be gone or elsewhere"),
        ("do: [a, {pour: }]", "do: [a, {pour: , timeout: 9 s}]", 1.5, "'pour' runs, would change, and may not be star"),
        (
            "do: {sequence: [a]}",
            "do: {sequence: [a], timeout: 9 s}",
            0.5,
            "'timeout' cannot be added to it before it s",
        ),
        ("do: a", "do: {sequence: [a], timeout: 9 s}", 0.5, "'sequence' would be around what runs: its options count"),
        (
            "data: {list: [a, b]}\ndo: {for: x, in: $list, do: {run: $x}}",
            "data: {list: [c]}\ndo: {for: x, in: $list, do: {run: $x}}",
            0.5,
            "runs, and would be gone",
        ),
    ],
)
def test_what_cannot_go_on_is_refused_with_its_place(before: str, after: str, at: float, why: str) -> None:
    assert why in refused(before, after, at)


def test_an_interrupt_that_acts_cannot_go_away() -> None:
    simulated = simulate("interrupts:\n  open: {when: $door}\n  low: {when: $battery < 50 %, do: [a, b]}\ndo: c")
    simulated.set("battery", 0.25)
    simulated.advance(0.5)
    with pytest.raises(NotPossible, match="'sequence' runs, and would be gone"):
        exchanged(simulated, program_of("do: c"))


def test_a_mission_that_is_stopped_at_a_breakpoint_stays_there() -> None:
    simulated = simulate("do: [a, b, c]")
    simulated.engine.intervene(SetBreakpoints((2,)), 0.0)
    simulated.advance(1.5)
    assert simulated.engine.stops == [2]
    exchanged(simulated, program_of("do: [d, a, b, c]"))
    assert simulated.engine.stops == [3]
    simulated.engine.pause(1.5)
    simulated.engine.resume(2.5)
    simulated.now = 2.5
    simulated.advance(20)
    assert skills(simulated) == ["0 a", "2.5 b", "3.5 c"]


def test_a_random_order_goes_on_and_new_steps_come_last() -> None:
    before = "do: {sequence: [a, b, c, d], order: random}"
    whole = simulate(before)
    whole.advance(20)
    simulated, _ = changed(before, "do: {sequence: [first, a, b, c, d], order: random}", 1.5)
    assert skills(simulated) == [*skills(whole), "4 first"]


def test_a_mission_that_is_paused_stays_paused_with_the_time_left() -> None:
    simulated = simulate("do: [{wait: 4 s}, a]")
    simulated.advance(1.0)
    simulated.engine.pause(1.0)
    exchanged(simulated, program_of("do: [{wait: 4 s}, b]"))
    assert simulated.engine.is_paused
    simulated.engine.resume(10.0)
    simulated.now = 10.0
    simulated.advance(20)
    assert skills(simulated) == ["13 b"]
