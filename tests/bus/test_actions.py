from __future__ import annotations

from typing import Any

import pytest

from rbxcompose.bus.actions import ActionServer
from rbxcompose.msgs.action_msgs import GoalStatusArray
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.sdk.bound import Ended, Outcome
from rbxcompose.sdk.ports import Qos
from tests.bus.conftest import Alone

Goal, Result, Feedback = NavigateToPose.Goal, NavigateToPose.Result, NavigateToPose.Feedback
Server = ActionServer[NavigateToPose.Goal, NavigateToPose.Result, NavigateToPose.Feedback]
Ends = list[Ended[NavigateToPose.Result]]

TO_DOCK = Goal(behavior_tree="dock")


def served(alone: Alone, refusal: str = "") -> Server:
    return alone.bus.serve_action("base", "go_to", NavigateToPose, lambda goal: refusal)


@pytest.fixture
def ends() -> Ends:
    return []


def test_a_goal_is_carried_out_and_its_result_comes_back(alone: Alone, ends: Ends) -> None:
    server = served(alone)
    send = alone.bus.action_client("mission", "go_to", NavigateToPose)
    assert send.is_available
    heard: list[NavigateToPose.Feedback] = []
    send(TO_DOCK, ends.append, heard.append)
    alone.settle()
    assert server.current is not None
    assert server.current.request is TO_DOCK
    assert not server.current.cancel_requested
    server.current.feedback(Feedback(distance_remaining=1.5))
    alone.settle()
    assert heard == [Feedback(distance_remaining=1.5)]
    alone.settle(after=3600.0)
    result = Result()
    server.current.succeeded(result)
    alone.settle()
    assert ends == [Ended(Outcome.SUCCEEDED, result)]
    assert vars(server)["current"] is None


@pytest.mark.parametrize("how", ["aborted", "canceled"])
def test_a_goal_may_end_otherwise(alone: Alone, ends: Ends, how: str) -> None:
    server = served(alone)
    alone.bus.action_client("mission", "go_to", NavigateToPose)(TO_DOCK, ends.append)
    alone.settle()
    assert server.current is not None
    getattr(server.current, how)()
    alone.settle()
    assert ends == [Ended(Outcome(how), Result())]


def test_the_reason_of_an_abort_is_logged(alone: Alone) -> None:
    server = served(alone)
    alone.bus.action_client("mission", "go_to", NavigateToPose)(TO_DOCK, lambda end: None)
    alone.settle()
    assert server.current is not None
    server.current.aborted("a wheel is stuck")
    assert alone.log == [("base", "go_to: a goal was aborted: a wheel is stuck")]


def test_a_refused_goal_never_starts_and_the_reason_is_logged_and_reaches_its_client(alone: Alone, ends: Ends) -> None:
    server = served(alone, refusal="not at the dock")
    alone.bus.action_client("mission", "go_to", NavigateToPose)(TO_DOCK, ends.append)
    alone.settle()
    assert server.current is None
    assert ends == [Ended(Outcome.REJECTED, message="not at the dock")]
    assert alone.log == [("base", "go_to: a goal was refused: not at the dock")]


def test_a_newer_goal_replaces_the_current_one(alone: Alone, ends: Ends) -> None:
    server = served(alone)
    send = alone.bus.action_client("mission", "go_to", NavigateToPose)
    send(TO_DOCK, ends.append)
    alone.settle()
    old = server.current
    assert old is not None
    newer: Ends = []
    send(Goal(behavior_tree="corner"), newer.append)
    alone.settle()
    assert ends == [Ended(Outcome.ABORTED, Result(error_msg="replaced by a newer goal"))]
    assert alone.log == [("base", "go_to: a goal was aborted: replaced by a newer goal")]
    old.succeeded()  # its server may not have noticed
    old.feedback(Feedback())
    assert server.current is not None
    assert server.current.request.behavior_tree == "corner"
    server.current.succeeded()
    alone.settle()
    assert newer == [Ended(Outcome.SUCCEEDED, Result())]


def test_a_refused_goal_replaces_nothing(alone: Alone) -> None:
    server = alone.bus.serve_action("base", "go_to", NavigateToPose, lambda goal: goal.behavior_tree)
    send = alone.bus.action_client("mission", "go_to", NavigateToPose)
    send(Goal(), lambda end: None)
    alone.settle()
    current = server.current
    send(Goal(behavior_tree="too far"), lambda end: None)
    alone.settle()
    assert server.current is current is not None


@pytest.mark.parametrize("is_settled", [True, False])
def test_a_client_can_cancel_its_goal_even_before_it_was_accepted(alone: Alone, ends: Ends, is_settled: bool) -> None:
    server = served(alone)
    goal = alone.bus.action_client("mission", "go_to", NavigateToPose)(TO_DOCK, ends.append)
    if is_settled:
        alone.settle()
    goal.cancel()
    alone.settle()
    assert server.current is not None
    assert server.current.cancel_requested
    assert ends == []
    server.current.canceled()
    alone.settle()
    assert ends == [Ended(Outcome.CANCELED, Result())]


def test_a_stop_cancels_the_current_goal_whose_result_says_so(alone: Alone, ends: Ends) -> None:
    server = served(alone)
    alone.bus.action_client("mission", "go_to", NavigateToPose)(TO_DOCK, ends.append)
    alone.settle()
    server.cancel_all("the robot was stopped")
    assert server.current is not None
    assert server.current.cancel_requested
    server.current.canceled()
    alone.settle()
    assert ends == [Ended(Outcome.CANCELED, Result(error_msg="the robot was stopped"))]


def test_a_goal_whose_client_is_gone_is_cancelled(alone: Alone) -> None:
    server = served(alone)
    alone.bus.action_client("mission", "go_to", NavigateToPose)(TO_DOCK, lambda end: None)
    alone.settle()
    alone.bus.close_owner("mission")
    alone.settle()
    assert server.current is not None
    assert server.current.cancel_requested


def test_a_goal_whose_server_is_gone_is_lost_once_and_can_be_sent_again(alone: Alone, ends: Ends) -> None:
    server = served(alone)
    send = alone.bus.action_client("mission", "go_to", NavigateToPose)
    changes: list[bool] = []
    send.watch(changes.append)
    send(TO_DOCK, ends.append)
    alone.settle()
    alone.bus.close_owner("base")
    alone.settle()
    assert [end.outcome for end in ends] == [Outcome.LOST]
    assert server.current is None
    assert not send.is_available
    server = served(alone)
    alone.settle()
    assert changes == [False, True]
    send(TO_DOCK, ends.append)
    alone.settle()
    assert server.current is not None
    server.current.succeeded()
    alone.settle()
    assert [end.outcome for end in ends] == [Outcome.LOST, Outcome.SUCCEEDED]


def test_without_a_server_a_goal_is_lost(alone: Alone, ends: Ends) -> None:
    send = alone.bus.action_client("mission", "go_to", NavigateToPose)
    assert not send.is_available
    send(TO_DOCK, ends.append)
    alone.settle()
    assert ends == [Ended(Outcome.LOST, message="no server of /go_to/_action/send_goal is known")]


def test_feedback_goes_to_the_client_of_the_goal_only(alone: Alone) -> None:
    server = served(alone)
    heard: list[str] = []
    for owner in ("first", "second"):
        send = alone.bus.action_client(owner, "go_to", NavigateToPose)
        send(TO_DOCK, lambda end: None, lambda message, owner=owner: heard.append(owner))  # type: ignore[misc]
        alone.settle()
    assert server.current is not None
    server.current.feedback(Feedback())
    alone.settle()
    assert heard == ["second"]


def test_a_goal_feedback_and_result_have_the_types_of_the_action(alone: Alone) -> None:
    server = served(alone)
    send: Any = alone.bus.action_client("mission", "go_to", NavigateToPose)
    with pytest.raises(TypeError, match=r"'go_to' takes nav2_msgs/action/NavigateToPose_Goal, not .*_Result"):
        send(Result(), lambda end: None)
    send(TO_DOCK, lambda end: None)
    alone.settle()
    goal: Any = server.current
    with pytest.raises(TypeError, match=r"'go_to' takes nav2_msgs/action/NavigateToPose_Feedback, not .*_Goal"):
        goal.feedback(TO_DOCK)
    with pytest.raises(TypeError, match=r"'go_to' takes nav2_msgs/action/NavigateToPose_Result, not .*_Goal"):
        goal.succeeded(TO_DOCK)
    assert server.current is goal


def test_the_states_of_goals_are_published_and_latched(alone: Alone) -> None:
    server = served(alone)
    send = alone.bus.action_client("mission", "go_to", NavigateToPose)
    send(TO_DOCK, lambda end: None)
    alone.settle()
    states: list[list[int]] = []

    def note(message: GoalStatusArray) -> None:
        states.append([status.status for status in message.status_list])

    alone.bus.subscribe("tool", "go_to/_action/status", GoalStatusArray, Qos.LATCHED, note)
    alone.settle()
    server.cancel_all("the robot was stopped")
    alone.settle()
    assert server.current is not None
    server.current.canceled()
    alone.settle()
    send(TO_DOCK, lambda end: None)
    alone.settle()
    assert states == [[2], [3], [5], [5, 2]]


def test_an_accept_that_raises_loses_the_goal_and_is_reported(alone: Alone, ends: Ends) -> None:
    def accept(goal: NavigateToPose.Goal) -> str:
        raise RuntimeError("broken")

    alone.bus.serve_action("base", "go_to", NavigateToPose, accept)
    alone.bus.action_client("mission", "go_to", NavigateToPose)(TO_DOCK, ends.append)
    alone.settle()
    assert ends == [Ended(Outcome.LOST, message="RuntimeError: broken")]
    assert [owner for owner, _ in alone.errors] == ["base"]


def test_two_runs_on_a_stepped_clock_are_the_same() -> None:
    def run() -> list[GoalStatusArray]:
        alone, seen = Alone(), list[GoalStatusArray]()
        served(alone)
        alone.bus.subscribe("tool", "go_to/_action/status", GoalStatusArray, Qos.LATCHED, seen.append)
        alone.bus.action_client("mission", "go_to", NavigateToPose)(TO_DOCK, lambda end: None)
        alone.settle()
        return seen

    assert run() == run() != []


def test_after_closing_nothing_is_left(alone: Alone) -> None:
    served(alone)
    alone.bus.action_client("mission", "go_to", NavigateToPose)(TO_DOCK, lambda end: None)
    alone.settle()
    alone.bus.close()
    assert len(alone.bus) == 0
    alone.settle()
    assert alone.scheduler.next_due() is None
