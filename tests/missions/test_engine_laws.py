"""Laws of the engine for random missions of all kinds and modifiers."""

from __future__ import annotations

import copy
import itertools
import json
import re

from hypothesis import assume, given
from hypothesis import strategies as st

from rbxcompose.missions.engine.events import SkillEnded, SkillStarted
from rbxcompose.missions.engine.snapshot import carry_on, restore, save
from rbxcompose.missions.engine.world import Settings
from rbxcompose.missions.program.outcomes import IDLE, RUNNING
from tests.missions.random_missions import CASES, FAILING, NODES, Case, Node, schedule
from tests.missions.simulated import Simulated, simulate
from tests.missions.test_composites import skills

END = 8.125  # [s], between two instants at which something may be due
FAULT = re.compile(r"\b[A-Z]\w*(Error|Exception): ")
LATER = st.integers(0, 32).map(lambda quarters: quarters / 4 + 0.125)


class Watching:
    """An observer that knows which nodes run."""

    def __init__(self) -> None:
        self.running: set[int] = set()

    def started(self, number: int, /) -> None:
        """A node starts only if it does not run."""
        assert number not in self.running
        self.running.add(number)

    def ended(self, number: int, status: int, outcome: str, /) -> None:
        """A node ends only if it runs."""
        self.running.remove(number)


def check_leaves(simulated: Simulated) -> None:
    """See that every leaf that started has ended, or was halted, exactly once."""
    running: set[int] = set()
    for _, event in simulated.events:
        if isinstance(event, SkillStarted):
            assert event.leaf not in running
            running.add(event.leaf)
        elif isinstance(event, SkillEnded):
            running.remove(event.leaf)
    assert not running


@given(CASES)
def test_every_node_that_starts_ends_or_is_halted_exactly_once_and_nothing_raises(case: Case) -> None:
    watching = Watching()
    simulated = case.simulated(Settings(observer=watching))
    simulated.advance(END)
    simulated.engine.abort(simulated.now)
    assert (simulated.running, simulated.held, watching.running) == ({}, {}, set())
    assert simulated.engine.status not in (IDLE, RUNNING)
    assert RUNNING not in simulated.engine.statuses
    assert not [line for line in simulated.told if FAULT.search(line)]
    check_leaves(simulated)


@given(CASES)
def test_the_same_mission_with_the_same_events_tells_the_same_story(case: Case) -> None:
    first, second = case.simulated(), case.simulated(Settings(observer=Watching()))  # who looks on changes nothing
    assert (first.advance(END), first.told) == (second.advance(END), second.told)


@given(CASES, LATER)
def test_a_mission_that_is_saved_and_restored_goes_on_as_if_nothing_had_been(case: Case, at: float) -> None:
    first = case.simulated()
    first.advance(at)
    second = case.simulated()
    second.engine.tick(0.0)  # whatever state it is in, restoring replaces it
    restore(second.engine, json.loads(json.dumps(save(first.engine))))
    assert save(second.engine) == save(first.engine)
    for name in ("values", "counts", "arrived", "running", "held", "calls"):
        setattr(second, name, dict(getattr(first, name)))
    second.now, second.changes, second.story = first.now, [], copy.deepcopy(first.story)
    schedule(second, [change for change in case.changes if change[0] > first.now])
    told = len(first.told)
    second.told.clear()
    assert second.advance(END) == first.advance(END)
    assert second.told == first.told[told:]


@given(CASES, st.lists(st.integers(0, 80), max_size=10))
def test_ticks_at_which_nothing_is_due_change_nothing(case: Case, extra: list[int]) -> None:
    plain, disturbed = case.simulated(), case.simulated()
    for tenths in extra:
        disturbed.at(tenths / 10 + 0.037, lambda: None)
    assert (disturbed.advance(END), disturbed.told) == (plain.advance(END), plain.told)


LASTING = st.sampled_from(("hold", {"wait": "0.75 s"}, {"log": "hi"}, {"set": {"n": "$n + 1"}}))


def _lasting(nodes: st.SearchStrategy[Node]) -> st.SearchStrategy[Node]:
    some = st.lists(nodes, min_size=1, max_size=3)
    return st.one_of(
        some.map(lambda steps: {"sequence": steps}),
        some.map(lambda steps: {"parallel": steps}),
        some.map(lambda steps: {"sequence": steps, "timeout": "2 s", "optional": True}),
        nodes.map(lambda do: {"repeat": 2, "every": "1.75 s", "do": do}),
        nodes.map(lambda do: {"sequence": [do, {"check": "false"}], "attempts": 2, "attempt_pause": "0.5 s"}),
    )


@given(st.recursive(LASTING, _lasting, max_leaves=6), LATER, st.integers(1, 40))
def test_a_pause_stops_everything_and_shifts_what_follows(body: Node, at: float, quarters: int) -> None:
    case, lasts = Case(body, "react", "continue"), quarters / 4
    plain, paused = case.simulated(), case.simulated()
    plain.advance(40.0)
    paused.advance(at)
    told = len(paused.told)
    paused.engine.pause(at)
    if paused.engine.status == RUNNING:
        assert paused.running == {}
        assert (paused.engine.next_wake(), paused.engine.reads()) == (None, frozenset())
        paused.now += lasts
        paused.engine.resume(paused.now)
        paused.advance(40.0 + lasts)
    expected = [time + lasts for time, _ in plain.events[told:]]
    assert [time for time, _ in paused.events[told:]] == expected
    assert [type(event) for _, event in paused.events] == [type(event) for _, event in plain.events]


BRANCHES = st.lists(
    st.sampled_from(("a", "b", "c", "[a, d]", "[d, {check: false}]", "{wait: 1 s}", "{check: true, only_if: false}")),
    min_size=2,
    max_size=3,
)


@given(BRANCHES, st.sampled_from(("all", "any", "1", "2")), st.sampled_from(("any", "all", "1", "2")), FAILING)
def test_the_order_of_branches_never_changes_the_result(
    branches: list[str], succeed_when: str, fail_when: str, failing: frozenset[int]
) -> None:
    found = set()
    for order in itertools.permutations(branches):
        steps = "".join(f"    - {item}\n" for item in order)
        text = f"do:\n  parallel:\n{steps}  succeed_when: {succeed_when}\n  fail_when: {fail_when}\n"
        simulated = simulate(text, takes={"b": 2.0, "c": 0.5}, fails={"b": failing, "c": failing})
        found.add((simulated.advance(20), simulated.now, tuple(sorted(skills(simulated)))))
    assert len(found) == 1


@given(NODES)
def test_random_missions_are_of_all_sorts(node: Node) -> None:
    assert Case(node, node, "continue").program().nodes


def in_another_process(case: Case, first: Simulated, now: float) -> Simulated:
    """Return a mission restored from a snapshot at another time, with nothing under way and no messages so far."""
    second = case.simulated()
    restore(second.engine, json.loads(json.dumps(save(first.engine))))
    carry_on(second.engine)
    assert second.running == {}
    second.now, second.changes = now, []
    second.engine.resume(now)
    return second


TIMED = st.sampled_from(({"wait": "0.75 s"}, {"log": "hi"}, {"set": {"n": "$n + 1"}}))


@given(st.recursive(TIMED, _lasting, max_leaves=6), LATER, st.integers(0, 400))
def test_a_mission_restored_in_another_process_goes_on_with_the_time_left(body: Node, at: float, later: int) -> None:
    case = Case(body, "react", "continue")
    plain, first = case.simulated(), case.simulated()
    plain.advance(40.0)
    first.advance(at)
    assume(first.engine.status == RUNNING and not first.running)
    now = later / 4
    second = in_another_process(case, first, now)
    second.advance(now + 40.0)
    told = len(first.told)
    passed = now - first.engine.now  # since the latest tick, which is the last that a snapshot knows
    assert [(round(time - passed, 6), type(event)) for time, event in second.events] == [
        (round(time, 6), type(event)) for time, event in plain.events[told:]
    ]


def _patient(nodes: st.SearchStrategy[Node]) -> st.SearchStrategy[Node]:
    some = st.lists(nodes, min_size=1, max_size=3)
    return st.one_of(
        some.map(lambda steps: {"sequence": steps, "history": "deep"}),
        some.map(lambda steps: {"parallel": steps}),
        nodes.map(lambda do: {"repeat": 2, "do": do}),
        nodes.map(lambda do: {"for": "item", "in": [1, 2], "do": do}),
        nodes.map(lambda do: {"sequence": [do, {"check": "false"}], "attempts": 2, "optional": True}),
        nodes.map(
            lambda do: {
                "machine": {
                    "start": "one",
                    "states": {
                        "one": {"do": do, "next": {"success": "two", "failure": "failed"}},
                        "two": {"do": "b", "next": {"success": "finished", "failure": "failed"}},
                    },
                }
            }
        ),
    )


PATIENT = st.sampled_from(("a", "hold", "recharge", {"call": "reset"}, {"wait": "0.75 s"}, {"set": {"n": "$n + 1"}}))


@given(st.recursive(PATIENT, _patient, max_leaves=6), LATER, st.integers(0, 400))
def test_a_mission_restored_in_another_process_ends_as_one_that_was_not_cut(body: Node, at: float, later: int) -> None:
    case = Case(body, "react", "continue")
    plain, first = case.simulated(), case.simulated()
    plain.advance(200.0)
    first.advance(at)
    assume(first.engine.status == RUNNING)
    second = in_another_process(case, first, later / 4)
    second.advance(later / 4 + 200.0)
    assert (second.engine.status, second.engine.data) == (plain.engine.status, plain.engine.data)
