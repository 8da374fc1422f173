"""Each law of safety finds what breaks it, and nothing else."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import pytest

from rbxcompose.bus.actions import GoalState
from rbxcompose.testing import check_file
from tests.simulated_faults.safety import (
    ROBOT,
    ActionClaim,
    Base,
    Laws,
    ObservedEvent,
    Ordered,
    SentVelocity,
    Switch,
    SwitchInput,
    ToldGoals,
    laws_of,
    violations,
)

PATROL = Path(__file__).parents[2] / "robots/turtlebot/robot.yaml"
BASE = Base("/cmd", "/odom", "world", timeout=0.5, cycle=0.02, deceleration=(1.0, 3.0))
MUX = Switch("/cmd", "robot", {"/high": SwitchInput(9, 0.5), "/low": SwitchInput(1, 0.5)})
CLAIMS = {
    "/go": ActionClaim("base", "robot"),
    "/charge": ActionClaim("base", "robot"),
    "/say": ActionClaim("voice", "robot"),
}
FAST = (0.3, 0.0)
REST = (0.0, 0.0)


def laws_broken(laws: Laws, story: Sequence[ObservedEvent]) -> list[tuple[float, str]]:
    return [(violation.time, violation.law) for violation in violations(laws, story)]


def moving(*events: ObservedEvent) -> list[tuple[float, str]]:
    return laws_broken(Laws(bases=[BASE]), events)


def switching(*events: ObservedEvent, is_lossless: bool = False) -> list[tuple[float, str]]:
    return laws_broken(Laws(switches=[MUX], is_lossless=is_lossless), events)


def carrying(*events: ObservedEvent) -> list[tuple[float, str]]:
    return laws_broken(Laws(claims=CLAIMS, longest_goal=60.0), events)


# Unwarranted motion


def test_a_base_that_moves_without_any_command_is_not_safe() -> None:
    assert moving(SentVelocity(1.0, "/odom", FAST)) == [(1.0, "unwarranted motion")]


@pytest.mark.parametrize(("time", "speed", "is_safe"), [
    (0.54, 0.3, True), (0.60, 0.3, False), (0.60, 0.24, True),
    (0.74, 0.1, True), (0.85, 0.01, False), (0.85, 0.0, True),
])  # fmt: skip
def test_after_its_deadline_a_base_brakes_as_hard_as_it_can(time: float, speed: float, is_safe: bool) -> None:
    found = moving(
        SentVelocity(0.0, "/cmd", FAST), SentVelocity(0.1, "/odom", FAST), SentVelocity(time, "/odom", (speed, 0.0))
    )
    assert found == ([] if is_safe else [(time, "unwarranted motion")])


def test_a_command_that_is_no_number_warrants_nothing() -> None:
    assert moving(SentVelocity(0.0, "/cmd", (math.nan, 0.0)), SentVelocity(0.1, "/odom", FAST))


def test_a_stop_ends_every_command_until_a_release_and_a_new_one() -> None:
    stopped: list[ObservedEvent] = [
        SentVelocity(0.0, "/cmd", FAST),
        SentVelocity(0.05, "/odom", FAST),
        Ordered(0.1, "world", "stop"),
    ]
    late: list[ObservedEvent] = [SentVelocity(0.5, "/cmd", FAST), SentVelocity(0.6, "/odom", FAST)]
    assert moving(*stopped, *late) == [(0.6, "unwarranted motion")]
    released: list[ObservedEvent] = [*stopped, SentVelocity(0.6, "/odom", REST), Ordered(1.0, "world", "release")]
    assert moving(*released, SentVelocity(1.1, "/odom", FAST)) == [(1.1, "unwarranted motion")]
    assert moving(*released, SentVelocity(1.1, "/cmd", FAST), SentVelocity(1.2, "/odom", FAST)) == []


# Muxes


def test_a_mux_that_lets_something_through_while_it_is_stopped_is_not_safe() -> None:
    spoken = [SentVelocity(0.9, "/low", FAST), SentVelocity(0.9, "/cmd", FAST)]
    assert switching(Ordered(0.1, "robot", "stop"), *spoken) == [(0.9, "unheeded stop")]
    wanted = [Ordered(0.1, ROBOT, "stop"), Ordered(0.1, "robot", "stop"), Ordered(0.2, "robot", "begin")]
    assert switching(*wanted, *spoken) == [(0.9, "unheeded stop")]
    assert switching(Ordered(0.1, "robot", "stop"), Ordered(0.2, "robot", "release"), *spoken) == []
    assert switching(Ordered(0.1, "robot", "brake"), Ordered(0.2, "robot", "release"), *spoken)


def test_a_mux_that_invents_is_not_safe() -> None:
    assert switching(SentVelocity(0.1, "/low", FAST), SentVelocity(0.1, "/cmd", (0.31, 0.0))) == [
        (0.1, "second winner")
    ]


def test_of_two_inputs_the_higher_wins_until_it_was_silent_for_its_timeout() -> None:
    won = [SentVelocity(0.0, "/high", FAST), SentVelocity(0.0, "/cmd", FAST)]
    low = (0.1, 0.0)
    assert switching(*won, SentVelocity(0.4, "/low", low), SentVelocity(0.4, "/cmd", low)) == [(0.4, "second winner")]
    assert switching(*won, SentVelocity(0.6, "/low", low), SentVelocity(0.6, "/cmd", low)) == []


def test_where_nothing_is_lost_the_higher_input_counts_once_it_has_spoken() -> None:
    events = [
        SentVelocity(0.0, "/high", FAST),
        SentVelocity(0.1, "/low", (0.1, 0.0)),
        SentVelocity(0.1, "/cmd", (0.1, 0.0)),
    ]
    assert switching(*events) == []
    assert switching(*events, is_lossless=True) == [(0.1, "second winner")]


def test_an_input_that_talks_on_after_a_stop_need_not_count() -> None:
    talks = [SentVelocity(time, "/high", FAST) for time in (0.0, 0.2, 0.4)]
    low = [SentVelocity(0.5, "/low", (0.1, 0.0)), SentVelocity(0.5, "/cmd", (0.1, 0.0))]
    stopped = [Ordered(0.1, "robot", "stop"), Ordered(0.15, "robot", "release")]
    assert switching(talks[0], *stopped, *talks[1:], *low, is_lossless=True) == []


# Goals


def goal(time: float, action: str, state: GoalState, id_: bytes = b"1") -> ToldGoals:
    return ToldGoals(time, action, {id_: state})


def test_two_goals_may_not_have_the_same_part() -> None:
    first = goal(0.0, "/go", GoalState.EXECUTING)
    assert carrying(first, goal(1.0, "/charge", GoalState.EXECUTING))[0] == (1.0, "shared claim")
    assert carrying(first, goal(1.0, "/say", GoalState.EXECUTING)) == []
    assert carrying(goal(0.0, "/go", GoalState.CANCELING), goal(1.0, "/charge", GoalState.EXECUTING)) == []


def test_a_goal_that_does_not_end_in_time_is_found() -> None:
    began, later = goal(0.0, "/go", GoalState.EXECUTING), goal(61.0, "/say", GoalState.SUCCEEDED)
    assert carrying(began, later) == [(61.0, "endless goal")]
    assert carrying(began, goal(9.0, "/go", GoalState.ABORTED), later) == []
    assert carrying(began, Ordered(9.0, "robot", "begin"), later) == []  # its server is another one


def test_a_process_that_is_shut_down_leaves_no_goal_open() -> None:
    began, down = goal(0.0, "/go", GoalState.EXECUTING), Ordered(5.0, "robot", "shutdown")
    assert carrying(began, down) == [(5.0, "endless goal")]
    assert carrying(began, down, goal(5.0, "/go", GoalState.ABORTED)) == []


# Stories


def test_the_laws_of_the_patrol_robot_come_from_its_plan() -> None:
    laws = laws_of(check_file(PATROL).plan)
    assert [(base.command, base.timeout, base.deceleration) for base in laws.bases] == [("/cmd_vel", 0.5, (1.0, 3.0))]
    assert {topic: switch_input.priority for topic, switch_input in laws.switches[0].inputs.items()} == {
        "/cmd_vel/teleop": 100,
        "/cmd_vel/navigation": 10,
    }
    assert {name: claim.part for name, claim in laws.claims.items()} == {"/go_to": "base", "/recharge": "base"}
