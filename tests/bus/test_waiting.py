"""Requests and goals that come before a component is active: they wait for it."""

from __future__ import annotations

from rbxcompose.bus.services import LOST
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.msgs.std_srvs import Trigger
from rbxcompose.sdk.bound import Reply
from tests.bus.conftest import Alone, Network, network

__all__ = ["network"]

Replies = list[Reply[Trigger.Response]]


def test_requests_wait_in_their_order_until_the_component_is_open(alone: Alone) -> None:
    alone.bus.serve_later("bell", "ring", Trigger, lambda asked: asked.reply(Trigger.Response()), waits=True)
    ring = alone.bus.client("guest", "ring", Trigger)
    replies: list[int] = []
    for number in range(3):
        ring(Trigger.Request(), lambda reply, number=number: replies.append(number))  # type: ignore[misc]
    alone.settle()
    assert replies == []
    alone.bus.open("bell")
    alone.settle()
    assert replies == [0, 1, 2]
    ring(Trigger.Request(), lambda reply: replies.append(3))
    alone.settle()
    assert replies == [0, 1, 2, 3]


def test_who_waits_for_a_component_that_never_opens_hears_that_it_is_lost(alone: Alone) -> None:
    alone.bus.serve_later("bell", "ring", Trigger, lambda asked: asked.reply(Trigger.Response()), waits=True)
    replies: Replies = []
    alone.bus.client("guest", "ring", Trigger)(Trigger.Request(), replies.append)
    alone.settle()
    alone.bus.close_owner("bell")
    alone.settle()
    assert [reply.error for reply in replies] == [LOST]


def test_a_goal_waits_and_is_judged_by_what_holds_then(alone: Alone) -> None:
    refusal = ["not yet"]
    server = alone.bus.serve_action("base", "go_to", NavigateToPose, lambda goal: refusal[0], waits=True)
    alone.bus.action_client("guest", "go_to", NavigateToPose)(NavigateToPose.Goal(), lambda ended: None)
    alone.settle()
    assert server.current is None
    refusal[0] = ""
    alone.bus.open("base")
    alone.settle()
    assert server.current is not None


def test_a_request_of_another_process_waits_too(network: Network) -> None:
    here, there = network.process(), network.process()
    there.bus.serve_later("bell", "ring", Trigger, lambda asked: asked.reply(Trigger.Response()), waits=True)
    ring = here.bus.client("guest", "ring", Trigger)
    network.until(lambda: ring.is_available)
    replies: Replies = []
    ring(Trigger.Request(), replies.append)
    there.turn()
    assert replies == []
    there.bus.open("bell")
    network.until(lambda: replies)
    assert replies[0].response is not None
