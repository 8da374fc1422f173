"""What robots may call of each other: services and actions pass with their answers, and nothing outlives a cut link."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from rbxcompose.bus.actions import ActionClient, ActionServer, ServedGoal
from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.compiler.plan.model import Exchange, SharedWire
from rbxcompose.msgs.action_msgs import CancelGoal
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.sdk.bound import Ended, Outcome, Reply
from tests.systems.relay import Relay
from tests.systems.test_exchange import RobotWithExchange, robots
from tests.systems.test_links import free_port, until

LAMP = SharedWire("/lamp", "/scout/lamp", SetBool.TYPE)
GO = SharedWire("/go_to", "/scout/go_to", NavigateToPose.TYPE)
LEASE, SLACK = 0.6, 1.0  # [s]; until an end notices a cut link, and of a loaded machine


class _Pair:
    """A robot that gives, and one that takes, with a cable between them."""

    def __init__(self, scout: RobotWithExchange, caller: RobotWithExchange, cable: Relay) -> None:
        self.scout, self.caller, self.cable = scout, caller, cable
        self.server: ActionServer[NavigateToPose.Goal, NavigateToPose.Result, NavigateToPose.Feedback]
        self.server = scout.bus.serve_action("go_to", "go_to", NavigateToPose, lambda goal: "")
        self.client: ActionClient[NavigateToPose.Goal, NavigateToPose.Result, NavigateToPose.Feedback]
        self.client = caller.bus.action_client("mission", "/scout/go_to", NavigateToPose)
        self.ends: list[Outcome] = []
        self.heard: list[NavigateToPose.Feedback] = []

    def until(self, holds: Callable[[], bool]) -> None:
        def run() -> bool:
            self.scout.run()
            self.caller.run()
            return holds()

        until(run)

    @property
    def served(self) -> ServedGoal[NavigateToPose.Goal, NavigateToPose.Result, NavigateToPose.Feedback]:
        assert self.server.current is not None
        return self.server.current

    @property
    def has_no_goal(self) -> bool:
        return self.server.current is None

    def run_for(self, seconds: float) -> None:
        begin = time.monotonic()
        self.until(lambda: time.monotonic() - begin > seconds)

    def send(self) -> None:
        self.until(lambda: self.client.is_available)
        self.sent = self.client(NavigateToPose.Goal(), self._ended, self.heard.append)
        self.until(lambda: self.server.current is not None)

    def _ended(self, ended: Ended[NavigateToPose.Result]) -> None:
        self.ends.append(ended.outcome)

    @property
    def is_cancelled(self) -> bool:
        return self.server.current is not None and self.server.current.cancel_requested


@pytest.fixture
def pair() -> Iterator[_Pair]:
    with _pair() as made:
        yield made


@contextmanager
def _pair() -> Iterator[_Pair]:
    port = free_port()
    with Relay(port) as cable:
        gives = Exchange((tcp_endpoint(port),), (), (LAMP, GO), lease=LEASE)
        takes = Exchange((), (tcp_endpoint(cable.port),), (), (_taken(LAMP), _taken(GO)), lease=LEASE)
        with robots(gives, takes) as (scout, caller):
            made = _Pair(scout, caller, cable)
            yield made
            cable.is_cut = False


def _taken(wire: SharedWire) -> SharedWire:
    return SharedWire(wire.shared, wire.shared, wire.type)


def test_a_service_of_another_robot_answers_and_is_gone_with_its_server(pair: _Pair) -> None:
    asked: list[bool] = []

    def switch(request: SetBool.Request) -> SetBool.Response:
        asked.append(request.data)
        return SetBool.Response(success=True, message="on")

    pair.scout.bus.serve("lamp", "lamp", SetBool, switch)
    client = pair.caller.bus.client("mission", "/scout/lamp", SetBool)
    replies: list[Reply[SetBool.Response]] = []
    pair.until(lambda: client.is_available)
    client(SetBool.Request(data=True), replies.append)
    pair.until(lambda: bool(replies))
    assert (asked, replies[0].response) == ([True], SetBool.Response(success=True, message="on"))
    pair.scout.bus.close_owner("lamp")
    pair.until(lambda: not client.is_available)


def test_a_goal_gives_feedback_and_ends_as_its_server_says(pair: _Pair) -> None:
    pair.send()
    feedback = NavigateToPose.Feedback(distance_remaining=2.0)

    def is_heard() -> bool:
        if pair.server.current is not None:
            pair.server.current.feedback(feedback)
        return bool(pair.heard)

    pair.until(is_heard)
    assert pair.heard[0] == feedback
    pair.served.succeeded()
    pair.until(lambda: bool(pair.ends))
    assert pair.ends == [Outcome.SUCCEEDED]


def test_a_goal_can_be_cancelled_by_whoever_sent_it_and_by_nobody_else_of_another_robot(pair: _Pair) -> None:
    own = pair.scout.bus.action_client("own_mission", "go_to", NavigateToPose)
    pair.until(lambda: own.is_available)
    ends: list[Outcome] = []
    own(NavigateToPose.Goal(), lambda ended: ends.append(ended.outcome))
    pair.until(lambda: pair.server.current is not None)
    canceller = pair.caller.bus.client("stranger", "/scout/go_to/_action/cancel_goal", CancelGoal)
    replies: list[Reply[CancelGoal.Response]] = []
    pair.until(lambda: canceller.is_available)
    canceller(CancelGoal.Request(), replies.append)  # of no goal in particular: of all
    pair.until(lambda: bool(replies))
    assert not pair.is_cancelled
    pair.send()
    pair.until(lambda: ends == [Outcome.ABORTED])  # replaced
    pair.sent.cancel()
    pair.until(lambda: pair.is_cancelled)
    pair.served.canceled()
    pair.until(lambda: pair.ends == [Outcome.CANCELED])


def test_a_goal_ends_on_both_sides_when_the_link_is_cut_and_nothing_begins_when_it_is_back(pair: _Pair) -> None:
    pair.send()
    pair.cable.is_cut = True
    cut = time.monotonic()
    pair.until(lambda: pair.is_cancelled and bool(pair.ends))
    assert time.monotonic() - cut < LEASE + SLACK
    assert pair.ends == [Outcome.LOST]
    pair.until(lambda: not pair.client.is_available)  # what was asked ends, and what serves is gone: in either order
    pair.served.canceled()
    pair.cable.is_cut = False
    pair.until(lambda: pair.client.is_available)
    pair.run_for(0.2)
    assert pair.has_no_goal
    pair.send()
    pair.served.succeeded()
    pair.until(lambda: pair.ends == [Outcome.LOST, Outcome.SUCCEEDED])


def test_a_goal_is_cancelled_when_the_component_that_sent_it_is_gone(pair: _Pair) -> None:
    pair.send()
    pair.caller.bus.close_owner("mission")
    pair.until(lambda: pair.is_cancelled)
