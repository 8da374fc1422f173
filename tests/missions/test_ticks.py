"""When the engine ticks, sleeps and wakes; pausing; what never waits."""

from __future__ import annotations

import pytest

from rbxcompose.missions.program.outcomes import Result
from tests.missions.simulated import simulate
from tests.missions.test_composites import fails, skills


def test_the_engine_sleeps_until_a_result_when_nothing_else_is_due() -> None:
    simulated = simulate("do: a")
    simulated.engine.tick(0.0)
    assert simulated.engine.next_wake() is None
    assert simulated.engine.reads() == frozenset()


def test_it_wakes_for_values_that_waiting_conditions_and_interrupts_read() -> None:
    simulated = simulate("interrupts:\n  x:\n    when: $battery < 10 %\n    do: b\ndo:\n  - a\n  - wait_for: $door")
    simulated.engine.tick(0.0)
    assert simulated.engine.reads() == {"battery"}
    simulated.advance(2.0)
    assert simulated.engine.reads() == {"battery", "door"}


def test_it_wakes_for_the_nearest_deadline() -> None:
    simulated = simulate("do:\n  sequence:\n    - wait: 3 s\n  timeout: 5 s")
    simulated.engine.tick(1.0)
    assert simulated.engine.next_wake() == 4.0


def test_one_attempt_per_tick_and_a_hundred_ticks_at_one_instant() -> None:
    simulated = simulate("data: {n: 0}\ndo:\n  repeat: forever\n  do:\n    set:\n      n: $n + 1")
    simulated.engine.tick(0.0)
    assert simulated.engine.data["n"] == 100.0
    assert simulated.engine.next_wake() == 0.05
    simulated.engine.tick(0.02)
    assert simulated.engine.data["n"] == 100.0
    simulated.engine.tick(0.05)
    assert simulated.engine.data["n"] == 200.0


def test_the_loop_that_does_not_wait_is_named_once() -> None:
    simulated = simulate("rate: 10 Hz\ndo:\n  repeat: forever\n  do:\n    check: 1 < 2")
    assert simulated.advance(1.0) == "running"
    assert simulated.told == ["0 mission.yaml:3: does not wait: 100 ticks at one instant, slowed down from now on"]


def test_a_failing_leaf_that_is_tried_for_ever_at_once_does_not_hang_the_engine() -> None:
    simulated = simulate("do:\n  check: 1 > 2\n  attempts: forever")
    assert simulated.advance(0.3) == "running"


def test_timers_stand_still_while_the_mission_is_paused() -> None:
    simulated = simulate("do:\n  - wait: 3 s\n  - a")
    simulated.at(1.0, lambda: simulated.engine.pause(1.0))
    simulated.at(6.0, lambda: simulated.engine.resume(6.0))
    simulated.advance(20.0)
    assert skills(simulated) == ["8 a"]


def test_a_pause_halts_what_claims_a_part_of_the_robot_and_the_resume_asks_for_it_again() -> None:
    simulated = simulate("do: [lift, b]", takes={"lift": 4.0})
    simulated.at(1.0, lambda: simulated.engine.pause(1.0))
    simulated.at(6.0, lambda: simulated.engine.resume(6.0))
    assert simulated.advance(20.0) == "success"
    assert simulated.told[:3] == ["0 lift", "1 lift: halted (1 s)", "6 lift"]


@pytest.mark.parametrize("resumed", [3.0, 6.0])
def test_what_claims_nothing_goes_on_during_a_pause_and_its_result_waits(resumed: float) -> None:
    simulated = simulate("do: [a, b]", takes={"a": 4.0})
    simulated.at(1.0, lambda: simulated.engine.pause(1.0))
    simulated.at(resumed, lambda: simulated.engine.resume(resumed))
    assert simulated.advance(20.0) == "success"
    assert simulated.calls == {"a": 1, "b": 1}
    assert f"{max(resumed, 4.0):g} b" in simulated.told


def test_a_call_goes_on_during_a_pause() -> None:
    simulated = simulate("do:\n  - call: reset\n  - a")
    simulated.at(0.5, lambda: simulated.engine.pause(0.5))
    simulated.at(6.0, lambda: simulated.engine.resume(6.0))
    assert simulated.advance(20.0) == "success"
    assert simulated.calls == {"reset": 1, "a": 1}


def test_what_may_not_be_repeated_has_failed_after_a_pause() -> None:
    simulated = simulate("do:\n  fallback: [press, b]", takes={"press": 4.0})
    simulated.at(1.0, lambda: simulated.engine.pause(1.0))
    simulated.at(6.0, lambda: simulated.engine.resume(6.0))
    assert simulated.advance(20.0) == "success"
    assert simulated.told[:3] == ["0 press", "1 press: halted (1 s)", "6 b"]
    assert simulated.calls == {"press": 1, "b": 1}


def test_a_mission_tells_why_it_failed_after_a_pause() -> None:
    simulated = simulate("do: press")
    simulated.at(0.5, lambda: simulated.engine.pause(0.5))
    simulated.at(1.0, lambda: simulated.engine.resume(1.0))
    assert simulated.advance(20.0) == "failure"
    assert "it was stopped, and may not be started again" in simulated.told[-1]


def test_a_pause_leaves_the_modifiers_of_a_leaf_where_they_were() -> None:
    simulated = simulate("do:\n  lift:\n  timeout: 5 s\n  attempts: 2", takes={"lift": 4.5})
    simulated.at(1.0, lambda: simulated.engine.pause(1.0))
    simulated.at(6.0, lambda: simulated.engine.resume(6.0))
    assert simulated.advance(20.0) == "failure"
    assert simulated.now == 10.0


def test_a_paused_mission_does_nothing_and_reads_nothing() -> None:
    simulated = simulate("do:\n  - wait_for: $door\n  - a")
    simulated.engine.tick(0.0)
    simulated.engine.pause(0.0)
    assert (simulated.engine.next_wake(), simulated.engine.reads()) == (None, frozenset())
    simulated.set("door", True)
    simulated.engine.tick(1.0)
    assert simulated.calls == {}


def test_a_pause_within_a_reaction_goes_on_within_it() -> None:
    text = "interrupts:\n  low:\n    when: $battery < 50 %\n    do: [b, recharge]\ndo: a"
    simulated = simulate(text, takes={"a": 9.0})
    simulated.set("battery", 1.0)
    simulated.at(1.0, lambda: simulated.set("battery", 0.1))
    simulated.at(2.5, lambda: simulated.engine.pause(2.5))
    simulated.at(4.0, lambda: simulated.engine.resume(4.0))
    assert simulated.advance(40.0) == "success"
    assert skills(simulated) == ["0 a", "1 b", "2 recharge", "4 recharge", "5 a"]


def test_an_abort_halts_what_runs_and_ends_the_mission() -> None:
    simulated = simulate("do: [a, b]", takes={"a": 5.0})
    simulated.engine.tick(0.0)
    simulated.engine.abort(1.0)
    assert simulated.running == {}
    assert simulated.told[-1] == "0 mission test: halted"
    assert simulated.engine.tick(2.0) == simulated.engine.status


def test_a_result_for_a_leaf_that_does_not_run_is_no_result() -> None:
    simulated = simulate("do: [a, b]")
    simulated.engine.tick(0.0)
    simulated.engine.ended(2, Result(False, "late"))
    simulated.engine.tick(0.5)
    assert skills(simulated) == ["0 a"]


def test_a_skill_that_ends_while_it_is_started_counts_at_the_same_instant() -> None:
    simulated = simulate("do: [a, b]", takes={"a": 0.0, "b": 0.0})
    start = simulated.start

    def start_and_end(leaf: int, skill: str, arguments: object, /) -> None:
        start(leaf, skill, {})
        simulated.finish(leaf)

    simulated.start = start_and_end  # type: ignore[method-assign]
    simulated.engine.tick(0.0)
    assert simulated.told[-1] == "0 mission test: success"


def test_results_are_told_in_the_order_in_which_they_came_and_before_what_follows() -> None:
    simulated = simulate("do: [a, b]", fails={"b": fails(1)})
    simulated.advance(5.0)
    assert simulated.told == [
        "0 a",
        "1 a: success (1 s)",
        "1 b",
        "2 b: failure (1 s): no luck",
        "2 mission test: failure: mission.yaml:1: no luck",
    ]


def test_a_result_of_the_instant_of_a_pause_counts() -> None:
    simulated = simulate("do: [a, b]")
    simulated.at(1.0, lambda: simulated.engine.pause(1.0))
    simulated.at(5.0, lambda: simulated.engine.resume(5.0))
    assert simulated.advance(20.0) == "success"
    assert skills(simulated) == ["0 a", "5 b"]


@pytest.mark.parametrize(
    "text",
    [
        "interrupts:\n  old:\n    when: age($door) > 0.75 s\n    afterwards: end\ndo: a",
        "do:\n  a:\n  as_long_as: age($door) <= 0.75 s\n  optional: true",
    ],
)
def test_conditions_of_interrupts_and_modifiers_are_asked_at_the_rate(text: str) -> None:
    simulated = simulate(f"rate: 10 Hz\n{text}", takes={"a": 9.0})
    simulated.set("door", True)
    assert simulated.advance(20) == "success"
    assert simulated.now == pytest.approx(0.8)
