"""Breakpoints, steps, forced results, changed data and jumps, on an engine in virtual time."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rbxcompose.missions.engine.debugger import Probed
from rbxcompose.missions.engine.events import Intervened, MissionEnded, Stopped
from rbxcompose.missions.engine.interventions import (
    INTERVENTIONS,
    ChangeData,
    ForceResult,
    Intervention,
    JumpToState,
    NotPossible,
    SetBreakpoints,
    TakeStep,
    find,
)
from rbxcompose.missions.program.outcomes import FAILURE, IDLE, RUNNING
from rbxcompose.missions.program.program import Program
from rbxcompose.testing import compile_mission
from tests.missions.random_missions import CASES, Case
from tests.missions.simulated import ROBOT, Simulated, program_of, simulate

END = 8.125  # [s], between two instants at which something may be due

PATROL = """
data:
  rounds: 0
interrupts:
  low:
    when: $battery < 20 %
    do: recharge
machine:
  start: away
  states:
    away:
      do:
        - go_to: corner_1
        - set: {rounds: $rounds + 1}
      next:
        success: home
        failure: failed
    home:
      do:
        name: go_home
        go_to: dock
      next:
        success: finished
        failure: away
"""


def breakpoints(program: Program, *wheres: str) -> SetBreakpoints:
    spots = [spot for where in wheres for spot in find(program, where)]
    ends = tuple((spot.node, spot.outcome) for spot in spots if spot.outcome is not None)
    return SetBreakpoints(tuple(spot.node for spot in spots if spot.outcome is None), ends)


def run(simulated: Simulated, until: float, lasts: float = 0.0, at_stop: Callable[[], None] = lambda: None) -> None:
    """Let a mission run as its shell does: paused for a while wherever it is stopped."""
    end = until
    while simulated.engine.status in (IDLE, RUNNING):
        advance(simulated, end)
        if not simulated.engine.stops:
            return
        simulated.engine.pause(simulated.now)
        at_stop()
        simulated.now += lasts
        end += lasts
        simulated.engine.resume(simulated.now)


def advance(simulated: Simulated, until: float) -> None:
    """Run on to the next stop, or to a time."""
    tick, engine = simulated.engine.tick, simulated.engine

    def tick_and_look(now: float) -> int:
        status = tick(now)
        if engine.stops:
            raise StopIteration
        return status

    engine.tick = tick_and_look  # type: ignore[method-assign]
    try:
        simulated.advance(until)
    except StopIteration:
        pass
    finally:
        del engine.tick


def stops(simulated: Simulated) -> list[str]:
    return [
        f"{time:g} {event.text}{event.after and ': '}{event.after}"
        for time, event in simulated.events
        if isinstance(event, Stopped)
    ]


def test_a_breakpoint_stops_the_mission_before_its_node_begins_and_nothing_else_is_touched() -> None:
    simulated = simulate(PATROL)
    program = simulated.engine.program
    simulated.engine.intervene(breakpoints(program, "go_home"), 0.0)
    assert [task.number for task in simulated.engine.tasks if isinstance(task, Probed)] == [
        find(program, "go_home")[0].node
    ]
    advance(simulated, 20.0)
    assert (stops(simulated), simulated.running) == (["1 go_home"], {})
    simulated.engine.pause(1.0)
    assert (simulated.engine.next_wake(), simulated.engine.tick(5.0)) == (None, RUNNING)
    simulated.now = 5.0
    simulated.engine.resume(5.0)
    simulated.advance(20.0)
    assert simulated.told[-3:] == ["6 ", "6 home: success, on to finished", "6 mission test: success"]


def test_cleared_breakpoints_leave_no_trace() -> None:
    simulated = simulate(PATROL)
    simulated.engine.intervene(breakpoints(simulated.engine.program, "go_home", "away->home"), 0.0)
    simulated.engine.intervene(SetBreakpoints(), 0.0)
    assert not simulated.engine.probes
    assert not any(isinstance(task, Probed) for task in simulated.engine.tasks)
    assert simulated.advance(20.0) == "success"
    assert stops(simulated) == []


def test_a_breakpoint_on_a_transition_stops_between_two_states() -> None:
    simulated = simulate(PATROL)
    simulated.engine.intervene(breakpoints(simulated.engine.program, "away->home"), 0.0)
    run(simulated, 20.0, 3.0)
    assert stops(simulated) == ["1 away: success, on to home"]
    assert "4 away: success, on to home" in simulated.told


def test_a_held_transition_can_be_forced_to_lead_elsewhere() -> None:
    simulated = simulate(PATROL)
    engine = simulated.engine
    engine.intervene(breakpoints(engine.program, "away->home"), 0.0)
    state = find(engine.program, "away")[0].node
    run(simulated, 20.0, at_stop=lambda: engine.intervene(ForceResult(state, succeeds=False), simulated.now))
    assert simulated.told[-2:] == [
        "1 away: failure, on to failed",
        "1 mission test: failure: mission.yaml:11: ended by hand",
    ]


def test_a_step_leads_from_leaf_to_leaf_and_from_transition_to_transition() -> None:
    simulated = simulate(PATROL)
    simulated.engine.tick(0.0)
    simulated.engine.intervene(TakeStep(), 0.0)
    run(simulated, 20.0, at_stop=lambda: simulated.engine.intervene(TakeStep(), simulated.now))
    assert [line.split(" ", 1)[1] for line in stops(simulated)] == [
        "set rounds = $rounds + 1",
        "away: success, on to home",
        "go_home",
        "home: success, on to finished",
    ]
    assert simulated.ended == "success"


def test_after_a_step_the_mission_runs_freely() -> None:
    simulated = simulate("do: [a, b, c, d]")
    simulated.engine.tick(0.0)
    simulated.engine.intervene(TakeStep(), 0.0)
    run(simulated, 20.0)
    assert (stops(simulated), simulated.ended) == (["1 b"], "success")


@pytest.mark.parametrize(
    ("text", "where", "found"),
    [
        ("do: {parallel: {one: [a, b], two: [c, d]}}", "mission.yaml:1", ["0 parallel"]),
        ("do:\n  parallel:\n    one:\n      - a\n      - b\n    two: c\n", "mission.yaml:5", ["1 b"]),
        ("do:\n  repeat: 3\n  do:\n    name: round\n    a:\n", "round", ["0 round", "1 round", "2 round"]),
        ("do:\n  for: step\n  in: [1, 2]\n  do:\n    - a\n    - b\n", "mission.yaml:6", ["1 b", "3 b"]),
        ("interrupts:\n  open:\n    when: $door\n    do:\n      - react\ndo: a\n", "mission.yaml:5", ["0.5 react"]),
        (
            "do:\n  - a\n  - {attempts: 2, name: again, sequence: [b, {check: false}], optional: true}\n",
            "again",
            ["1 again"],
        ),
    ],
)
def test_breakpoints_stop_in_branches_loops_reactions_and_around_modifiers(
    text: str, where: str, found: list[str]
) -> None:
    simulated = simulate(text)
    simulated.at(0.5, lambda: simulated.set("door", True))
    simulated.engine.intervene(breakpoints(simulated.engine.program, where), 0.0)
    run(simulated, 20.0)
    assert stops(simulated) == found
    assert simulated.ended == "success"


USED = "do:\n  - a\n  - b\n"


def test_a_breakpoint_in_a_mission_that_is_used_twice_stops_in_each_use() -> None:
    used, _ = compile_mission(USED, ROBOT, file="missions/inner.yaml")
    assert used is not None
    robot = replace(ROBOT, missions={"inner": used})
    simulated = Simulated(program_of("do:\n  - use: inner\n  - use: inner\n", robot), robot=robot)
    spots = find(simulated.engine.program, "inner.yaml:3")
    assert len(spots) == 2
    simulated.engine.intervene(SetBreakpoints(tuple(spot.node for spot in spots)), 0.0)
    run(simulated, 20.0)
    assert stops(simulated) == ["1 b", "3 b"]


def test_a_reactive_condition_stops_only_when_it_is_evaluated_for_the_first_time() -> None:
    text = "do:\n  reactive: true\n  sequence:\n    - {name: full, check: $battery > 50 %}\n    - a\n"
    simulated = simulate(text)
    simulated.set("battery", 0.9)
    simulated.engine.intervene(breakpoints(simulated.engine.program, "full"), 0.0)
    simulated.at(0.5, lambda: simulated.set("battery", 0.8))
    run(simulated, 20.0)
    assert (stops(simulated), simulated.calls, simulated.ended) == (["0 full"], {"a": 1}, "success")


def test_time_stands_still_at_a_breakpoint_for_what_runs_beside_it() -> None:
    text = "do:\n  parallel:\n    - {sequence: [{wait: 1 s}, {name: here, log: hi}]}\n    - {wait: 3 s, timeout: 4 s}\n"
    simulated = simulate(text)
    simulated.engine.intervene(breakpoints(simulated.engine.program, "here"), 0.0)
    run(simulated, 20.0, 10.0)
    assert simulated.told[-1] == "13 mission test: success"


def test_a_held_node_that_is_halted_has_never_begun() -> None:
    text = """
    do:
      parallel:
        one: {sequence: [{name: here, a: , on_start: {log: in}, on_halt: {log: out}}]}
        two: {wait: 1 s}
      succeed_when: any
    """
    simulated = simulate(text)
    engine = simulated.engine
    engine.intervene(breakpoints(engine.program, "here"), 0.0)
    two = next(node.number for node in engine.program.nodes if node.step.word == "wait")
    engine.tick(0.0)
    engine.pause(0.0)
    engine.intervene(ForceResult(two, succeeds=True), 0.0)
    engine.stops.clear()
    engine.is_paused = False  # as if the branch beside it had ended in the same tick
    simulated.told.clear()
    here = find(engine.program, "here")[0].node
    engine.tasks[engine.index_of(engine.main.mission.root)].halt()  # type: ignore[arg-type]
    assert [line for line in simulated.told if "in" in line.split() or "out" in line.split()] == []
    assert engine.statuses[here] == IDLE


def test_force_halts_what_runs_and_ends_the_node_with_its_modifiers() -> None:
    text = """
    do:
      - name: tour
        sequence: [{go_to: corner_1, on_halt: {log: cut}}, b]
        attempts: 3
        optional: true
      - c
    """
    simulated = simulate(text)
    engine = simulated.engine
    engine.tick(0.0)
    engine.intervene(ForceResult(find(engine.program, "tour")[0].node, succeeds=True), 0.25)
    assert simulated.running == {}
    simulated.now = 0.25
    assert simulated.advance(20.0) == "success"
    assert simulated.told == [
        "0 tour begins",
        "0 go_to corner_1",
        "0 by hand: mission.yaml:4, tour ends in success; the run cannot be reproduced without this",
        "0 go_to corner_1: halted (0.2 s): ended by hand",
        "0 cut",
        "0.25 tour: success",
        "0.25 c",
        "1.25 c: success (1 s)",
        "1.25 mission test: success",
    ]


def test_a_paused_skill_can_be_forced_to_an_outcome_of_its_own() -> None:
    text = """
    machine:
      start: search
      states:
        search:
          do: look
          next: {person: finished, success: failed, failure: failed}
    """
    simulated = simulate(text)
    engine = simulated.engine
    engine.tick(0.0)
    engine.pause(0.0)
    leaf = next(node.number for node in engine.program.nodes if node.skill)
    engine.intervene(ForceResult(leaf, succeeds=True, outcome="person"), 1.0)
    engine.resume(2.0)
    engine.tick(2.0)
    assert simulated.told[-2:] == ["0 search: person, on to finished", "0 mission test: success"]


def test_data_that_are_set_are_seen_by_what_follows() -> None:
    simulated = simulate(PATROL)
    simulated.engine.tick(0.0)
    simulated.engine.intervene(ChangeData("rounds", 7.0), 0.0)
    simulated.advance(20.0)
    assert simulated.engine.data["rounds"] == 8.0
    assert any(isinstance(event, Intervened) and event.text == "rounds = 7" for _, event in simulated.events)


def test_a_jump_leaves_the_state_and_enters_the_other_one() -> None:
    simulated = simulate(PATROL)
    engine = simulated.engine
    engine.tick(0.0)
    machine = next(node.number for node in engine.program.nodes if node.step.states)
    engine.intervene(JumpToState(machine, "home"), 0.5)
    simulated.now = 0.5
    assert simulated.advance(20.0) == "success"
    assert [line for line in simulated.told if "state" in line or "go_to" in line] == [
        "0 state away",
        "0 go_to corner_1",
        "0 by hand: mission.yaml:8, jump to state home; the run cannot be reproduced without this",
        "0 go_to corner_1: halted (0.5 s): ended by hand",
        "0.5 state home",
        "0.5 go_to dock",
        "1.5 go_to dock: success (1 s)",
    ]


@pytest.mark.parametrize(
    ("intervention", "reason"),
    [
        (ForceResult(99, succeeds=True), "the node does not run"),
        (ForceResult(5, succeeds=True), "the node does not run"),
        (JumpToState(0, "nowhere"), "has no state 'nowhere'"),
        (JumpToState(1, "away"), "has no state 'away'"),
        (ChangeData("laps", 1.0), "the mission has no data 'laps'"),
        (SetBreakpoints((99,)), "the mission has no such node"),
    ],
)
def test_what_cannot_be_done_is_refused_and_the_mission_goes_on(intervention: Intervention, reason: str) -> None:
    simulated, plain = simulate(PATROL), simulate(PATROL)
    simulated.engine.tick(0.0)
    with pytest.raises(NotPossible, match=reason):
        simulated.engine.intervene(intervention, 0.0)
    assert (simulated.advance(20.0), simulated.told) == (plain.advance(20.0), plain.told)


@pytest.mark.parametrize(
    ("where", "reason"),
    [
        ("go_hone", "there is no 'go_hone'; did you mean 'go_home'?"),
        ("mission.yaml:15", "nothing begins in line 15 of 'mission.yaml'; lines near it are 13, 14, 16"),
        ("other.yaml:3", "there is no node of a mission in 'other.yaml'; its files: mission.yaml"),
        (
            "away->nowhere",
            "there is no 'away->nowhere'; transitions: away->home, away->failed, home->away, home->finished",
        ),
        ("77", "there is no node 77; the last one is"),
        ("", "there is no ''"),
    ],
)
def test_a_place_that_does_not_exist_is_refused_with_those_near_it(where: str, reason: str) -> None:
    with pytest.raises(NotPossible) as raised:
        find(simulate(PATROL).engine.program, where)
    assert reason.casefold() in str(raised.value).casefold()


def test_a_name_of_two_places_is_refused_with_both() -> None:
    state = "{start: away, states: {away: {do: a, next: {success: finished, failure: failed}}}}"
    program = simulate(f"do:\n  - machine: {state}\n  - machine: {state}\n").engine.program
    with pytest.raises(NotPossible, match=r"'away' may be mission.yaml:2 or mission.yaml:3"):
        find(program, "away")


INTERVENTIONS_MADE: Sequence[Intervention] = (
    SetBreakpoints((1, 2), ((3, "success"),)),
    TakeStep(),
    ForceResult(3, succeeds=False, outcome="lost"),
    ChangeData("n", 2.0),
    JumpToState(1, "home"),
)


@pytest.mark.parametrize("made", INTERVENTIONS_MADE, ids=lambda made: type(made).__name__)
def test_an_intervention_can_be_written_and_read(made: Intervention) -> None:
    assert INTERVENTIONS.from_data(json.loads(json.dumps(INTERVENTIONS.to_data(made)))) == made


def plainly(simulated: Simulated) -> list[tuple[float, object]]:
    return [(time, event) for time, event in simulated.events if not isinstance(event, Stopped)]


@given(CASES, st.frozensets(st.integers(0, 30), max_size=6))
def test_breakpoints_that_are_left_at_once_do_not_change_a_mission(case: Case, nodes: frozenset[int]) -> None:
    case, plain = steady(case)
    stopped = case.simulated()
    count = len(stopped.engine.statuses)
    stopped.engine.intervene(SetBreakpoints(tuple(node for node in nodes if node < count)), 0.0)
    run(stopped, END)
    assert plainly(stopped) == plainly(plain)


@given(CASES)
def test_a_mission_that_is_stepped_through_ends_as_any_other(case: Case) -> None:
    case, plain = steady(case)
    stepped = case.simulated()
    stepped.advance(0.0)
    assume(stepped.engine.status == RUNNING)
    stepped.engine.intervene(TakeStep(), 0.0)
    run(stepped, END, at_stop=lambda: stepped.engine.intervene(TakeStep(), stepped.now))
    assert plainly(stepped) == plainly(plain)


@given(CASES, st.lists(st.tuples(st.integers(0, 30), st.integers(0, 30), st.booleans()), max_size=6))
def test_forced_results_and_jumps_leave_a_mission_whole(case: Case, forced: list[tuple[int, int, bool]]) -> None:
    simulated = case.simulated()
    engine = simulated.engine
    for quarters, number, succeeds in forced:
        advance(simulated, quarters / 4 + 0.1)
        if engine.status != RUNNING:
            break
        live = sorted(engine.debugger.live())
        node = engine.program.nodes[live[number % len(live)]] if live else engine.program.nodes[0]
        states = node.step.states
        try:
            wanted = JumpToState(node.number, states.names[number % len(states.names)]) if states else None
            engine.intervene(wanted or ForceResult(node.number, succeeds), simulated.now)
        except NotPossible:
            assert not live or states
    simulated.advance(END + 10)
    engine.abort(simulated.now)
    assert (simulated.running, simulated.held) == ({}, {})
    assert RUNNING not in engine.statuses
    assert isinstance(simulated.events[-1][1], MissionEnded)


def steady(case: Case) -> tuple[Case, Simulated]:
    """Return a mission that breakpoints do not change, and how it runs without any.

    It has no skills that a pause stops, no pauses, no branches that a stop may put in another order, and is not slowed
    down by the number of its ticks.
    """
    text = json.dumps([case.body, case.reaction]).replace('"recharge"', '"c"').replace('"hold"', '"d"')
    assume("parallel" not in text)
    body, reaction = json.loads(text)
    changes = [change for change in case.changes if change[1] != "pause"]
    case = Case(body, reaction, case.afterwards, changes, case.failing, case.outcomes)
    plain = case.simulated()
    plain.advance(END)
    assume("does not wait" not in "".join(plain.told))
    return case, plain


def test_a_failure_by_hand_is_the_reason_that_the_mission_gives() -> None:
    simulated = simulate("do: [a, b]")
    simulated.engine.tick(0.0)
    simulated.engine.intervene(ForceResult(1, succeeds=False), 0.0)
    assert simulated.engine.tick(0.0) == FAILURE
    assert simulated.told[-1] == "0 mission test: failure: mission.yaml:1: ended by hand"
