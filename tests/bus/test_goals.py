from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.bus.actions import ANY_GOAL, KEPT_FOR, MOST_KEPT, CancelCode, Goal, Goals, GoalState
from tests.loops import for_all


def id_of(number: int) -> bytes:
    return number.to_bytes(16, "big")


def accepted(goals: Goals[Any, Any], number: int, client: bytes = b"c") -> Goal[Any, Any]:
    goal: Goal[Any, Any] = Goal(id_of(number), "request", client, accepted=number * 100)
    goals.accept(goal)
    return goal


def ended(goals: Goals[Any, Any], number: int, now: float = 0.0) -> Goal[Any, Any]:
    goal = accepted(goals, number)
    goals.end(goal, GoalState.SUCCEEDED, "result", now)
    return goal


def test_a_goal_is_carried_out_from_its_acceptance_to_its_end() -> None:
    goals: Goals[Any, Any] = Goals()
    goal = accepted(goals, 1)
    assert (goals.current, goal.state) == (goal, GoalState.EXECUTING)
    assert goals.end(goal, GoalState.SUCCEEDED, "done", 3.0)
    assert (goals.current, goal.state, goal.result, goal.ended) == (None, GoalState.SUCCEEDED, "done", 3.0)


def test_a_goal_ends_once() -> None:
    goals: Goals[Any, Any] = Goals()
    goal = ended(goals, 1)
    assert not goals.end(goal, GoalState.ABORTED, "again", 1.0)
    assert (goal.state, goal.result) == (GoalState.SUCCEEDED, "result")


def test_two_goals_at_a_time_or_of_one_id_are_our_own_mistake() -> None:
    goals: Goals[Any, Any] = Goals()
    ended(goals, 1)
    with pytest.raises(ValueError, match="only once"):
        accepted(goals, 1)
    accepted(goals, 2)
    with pytest.raises(ValueError, match="only after"):
        accepted(goals, 3)


@for_all(
    "number, stamp, code, is_cancelled",
    [
        (0, 0, CancelCode.NONE, True),  # all goals
        (2, 0, CancelCode.NONE, True),
        (1, 0, CancelCode.GOAL_TERMINATED, False),
        (9, 0, CancelCode.UNKNOWN_GOAL, False),
        (0, 200, CancelCode.NONE, True),  # accepted until then
        (0, 199, CancelCode.NONE, False),
        (9, 200, CancelCode.NONE, True),
        (2, 1, CancelCode.NONE, True),
        (1, 1, CancelCode.NONE, False),
    ],
)
def test_cancelling_names_a_goal_a_time_or_all(number: int, stamp: int, code: CancelCode, is_cancelled: bool) -> None:
    goals: Goals[Any, Any] = Goals()
    ended(goals, 1)
    goal = accepted(goals, 2)
    assert goals.cancel(id_of(number), stamp) == (code, [goal] if is_cancelled else [])
    assert (goal.state is GoalState.CANCELING) == is_cancelled


def test_naming_a_goal_of_time_zero_cancels_no_other() -> None:
    goals: Goals[Any, Any] = Goals()
    goal: Goal[Any, Any] = Goal(id_of(1), "request", b"c", accepted=0)
    goals.accept(goal)
    assert goals.cancel(id_of(7)) == (CancelCode.UNKNOWN_GOAL, [])
    assert goals.cancel() == (CancelCode.NONE, [goal])


def test_a_goal_whose_client_left_is_cancelled() -> None:
    goals: Goals[Any, Any] = Goals()
    goal = accepted(goals, 1, client=b"mine")
    assert (goals.cancel_from(b"other"), goal.state) == (False, GoalState.EXECUTING)
    assert (goals.cancel_from(b"mine"), goal.state) == (True, GoalState.CANCELING)


def test_ended_goals_are_remembered_for_a_while() -> None:
    goals: Goals[Any, Any] = Goals()
    ended(goals, 1, now=5.0)
    goals.forget(5.0 + KEPT_FOR)
    assert goals.find(id_of(1)) is not None
    goals.forget(5.1 + KEPT_FOR)
    assert goals.find(id_of(1)) is None


def test_only_so_many_ended_goals_are_remembered_but_always_the_current_one() -> None:
    goals: Goals[Any, Any] = Goals()
    for number in range(1, MOST_KEPT + 3):
        ended(goals, number)
    current = accepted(goals, 1000)
    goals.forget(0.0)
    assert [goal.id for goal in goals] == [*map(id_of, range(3, MOST_KEPT + 3)), current.id]


operations = st.lists(
    st.tuples(st.sampled_from(["accept", "end", "cancel", "leave", "forget"]), st.integers(0, 6), st.integers(0, 300)),
    max_size=40,
)


@given(operations)
def test_whatever_happens_only_the_current_goal_is_open_and_an_end_is_final(steps: list[tuple[str, int, int]]) -> None:
    goals: Goals[Any, Any] = Goals()
    ends: dict[bytes, GoalState] = {}
    for now, (what, number, stamp) in enumerate(steps):
        match what:
            case "accept":
                if goals.current is None and goals.find(id_of(number)) is None and number:
                    accepted(goals, number, client=bytes([number]))
            case "end":
                if goals.current is not None:
                    state = (GoalState.SUCCEEDED, GoalState.CANCELED, GoalState.ABORTED)[stamp % 3]
                    ends[goals.current.id] = state
                    goals.end(goals.current, state, "result", float(now))
            case "cancel":
                code, chosen = goals.cancel(id_of(number), stamp)
                assert all(goal is goals.current for goal in chosen)
                assert code is CancelCode.NONE or not chosen
            case "leave":
                goals.cancel_from(bytes([number]))
            case _:
                goals.forget(float(now))
        for goal in goals:
            assert goal.state.is_end == (goal is not goals.current)
            assert not goal.state.is_end or goal.state is ends[goal.id]
            assert goal.id != ANY_GOAL
        ends = {id_: state for id_, state in ends.items() if goals.find(id_) is not None}
