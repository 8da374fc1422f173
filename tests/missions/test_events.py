"""Values that are events: what came before a node began does not count for it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from rbxcompose.base.expressions.types import FLAG, TYPES
from tests.missions.simulated import ROBOT, Simulated, program_of
from tests.missions.test_composites import skills

EVENTS = replace(
    ROBOT, values={**ROBOT.values, "confirmed": FLAG, "code": TYPES["text"]}, events=frozenset({"confirmed", "code"})
)


def simulated(text: str) -> Simulated:
    return Simulated(program_of(text, EVENTS), robot=EVENTS)


def test_an_old_event_does_not_end_a_wait() -> None:
    robot = simulated("do:\n  - a\n  - wait_for: $confirmed\n  - b")
    robot.at(0.5, lambda: robot.set("confirmed", True))
    robot.at(31.0, lambda: robot.set("confirmed", True))
    robot.advance(40)
    assert skills(robot) == ["0 a", "31 b"]


def test_only_an_event_that_says_yes_ends_a_wait_for_it() -> None:
    robot = simulated("do:\n  - wait_for: $confirmed\n  - b")
    robot.at(1.0, lambda: robot.set("confirmed", False))
    robot.at(2.0, lambda: robot.set("confirmed", True))
    robot.advance(40)
    assert skills(robot) == ["2 b"]


def test_each_wait_needs_an_event_of_its_own() -> None:
    robot = simulated("do:\n  repeat: 2\n  do:\n    - wait_for: $confirmed\n    - a")
    robot.at(1.0, lambda: robot.set("confirmed", True))
    robot.at(5.0, lambda: robot.set("confirmed", True))
    robot.advance(40)
    assert skills(robot) == ["1 a", "5 a"]


@pytest.mark.parametrize("before", [False, True])
def test_a_flag_is_false_until_it_comes(before: bool) -> None:
    robot = simulated("do:\n  a:\n  as_long_as: not $confirmed\n  optional: true")
    if before:
        robot.set("confirmed", True)
    robot.at(0.5, lambda: robot.set("confirmed", True))
    robot.advance(40)
    assert robot.told[:2] == ["0 a", "0.5 a: halted (0.5 s): not as long as not $confirmed"]


def test_what_is_no_flag_has_no_value_until_it_comes() -> None:
    robot = simulated("do:\n  - wait_for: $code != 'stop'\n  - a")
    robot.set("code", "left")
    robot.at(2.0, lambda: robot.set("code", "go"))
    robot.advance(40)
    assert skills(robot) == ["2 a"]


def test_an_interrupt_acts_on_events_since_it_last_acted() -> None:
    text = "interrupts:\n  help:\n    when: $confirmed\n    do: react\ndo:\n  repeat: 5\n  do: a"
    robot = simulated(text)
    robot.set("confirmed", True)
    robot.at(1.5, lambda: robot.set("confirmed", True))
    robot.advance(40)
    assert [line for line in skills(robot) if "react" in line] == ["1.5 react"]


def test_what_is_not_a_condition_reads_the_last_event() -> None:
    robot = simulated(
        "data: {heard: ''}\ndo:\n  - wait_for: $code != ''\n  - set: {heard: $code}\n  - log: it is $code"
    )
    robot.at(1.0, lambda: robot.set("code", "go"))
    assert robot.advance(40) == "success"
    assert robot.engine.data["heard"] == "go"
    assert robot.told[0] == "1 it is go"
