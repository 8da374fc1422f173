from __future__ import annotations

import math
from typing import Any

import pytest

from rbxcompose.base.requests import Refused
from rbxcompose.bus.services import LOST, ServedRequest, Server
from rbxcompose.msgs.example_interfaces import AddTwoInts
from rbxcompose.sdk.bound import Reply
from tests.bus.conftest import Alone

Replies = list[Reply[AddTwoInts.Response]]


def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
    return AddTwoInts.Response(sum=request.a + request.b)


class Later:
    """A server that keeps its requests."""

    def __init__(self, alone: Alone, owner: str = "later") -> None:
        self.requests: list[ServedRequest[AddTwoInts.Request, AddTwoInts.Response]] = []
        self.left: list[bytes] = []
        bus = alone.bus
        node = bus._node(owner)
        node.keep(Server(bus._services, node, "add", AddTwoInts, self.requests.append, self.left.append))


def test_a_request_is_answered_at_the_same_instant_but_never_in_the_call(alone: Alone) -> None:
    alone.bus.serve("server", "add", AddTwoInts, add)
    call = alone.bus.client("client", "add", AddTwoInts)
    replies: Replies = []
    call(AddTwoInts.Request(a=2, b=3), replies.append)
    assert replies == []
    alone.settle()
    assert replies == [Reply(AddTwoInts.Response(sum=5))]


def test_without_a_server_the_caller_is_told_at_once(alone: Alone) -> None:
    call = alone.bus.client("client", "add", AddTwoInts)
    assert not call.is_available
    replies: Replies = []
    call(AddTwoInts.Request(), replies.append)
    alone.settle()
    assert replies == [Reply(None, "no server of /add is known")]


@pytest.mark.parametrize("error", [ValueError("too many"), SystemExit("too many")])
def test_a_server_that_raises_gives_the_error_to_the_caller_and_to_the_process(
    alone: Alone, error: BaseException
) -> None:
    def fail(request: AddTwoInts.Request) -> AddTwoInts.Response:
        raise error

    alone.bus.serve("server", "add", AddTwoInts, fail)
    call = alone.bus.client("client", "add", AddTwoInts)
    replies: Replies = []
    call(AddTwoInts.Request(), replies.append)
    alone.settle()
    assert replies == [Reply(None, f"{type(error).__name__}: too many")]
    assert [owner for owner, _ in alone.errors] == ["server"]


def test_a_request_or_an_answer_of_another_type_is_the_mistake_of_who_sends_it(alone: Alone) -> None:
    wrong: Any = AddTwoInts.Request()
    alone.bus.serve("server", "add", AddTwoInts, lambda request: wrong)
    call: Any = alone.bus.client("client", "add", AddTwoInts)
    with pytest.raises(TypeError, match="'/add' takes example_interfaces/srv/AddTwoInts_Request, not NoneType"):
        call(None, print)
    replies: Replies = []
    call(AddTwoInts.Request(), replies.append)
    alone.settle()
    told = "'/add' takes example_interfaces/srv/AddTwoInts_Response, not example_interfaces/srv/AddTwoInts_Request"
    assert replies == [Reply(None, f"TypeError: {told}")]
    assert [(owner, str(error)) for owner, error in alone.errors] == [("server", told)]


def test_a_server_may_refuse_without_being_at_fault(alone: Alone) -> None:
    def refuse(request: AddTwoInts.Request) -> AddTwoInts.Response:
        raise Refused("not while it is stopped")

    alone.bus.serve("server", "add", AddTwoInts, refuse)
    replies: Replies = []
    alone.bus.client("client", "add", AddTwoInts)(AddTwoInts.Request(), replies.append)
    alone.settle()
    assert (replies, alone.errors) == ([Reply(None, "not while it is stopped")], [])


def test_an_answer_may_come_later_and_only_the_first_counts(alone: Alone) -> None:
    server = Later(alone)
    call = alone.bus.client("client", "add", AddTwoInts)
    replies: Replies = []
    call(AddTwoInts.Request(), replies.append)
    alone.settle(after=4.9)
    assert replies == []
    server.requests[0].reply(AddTwoInts.Response(sum=1))
    server.requests[0].reply(AddTwoInts.Response(sum=2))
    alone.settle()
    alone.settle(after=10.0)
    assert replies == [Reply(AddTwoInts.Response(sum=1))]


def test_a_call_ends_after_its_timeout_and_a_late_answer_is_ignored(alone: Alone) -> None:
    server = Later(alone)
    call = alone.bus.client("client", "add", AddTwoInts)
    replies: Replies = []
    call(AddTwoInts.Request(), replies.append, timeout=0.5)
    alone.settle(after=0.5)
    assert replies == [Reply(None, "no reply within 0.5 s")]
    server.requests[0].reply(AddTwoInts.Response(sum=1))
    alone.settle()
    assert len(replies) == 1


def test_a_call_without_a_timeout_waits_until_the_server_goes_away(alone: Alone) -> None:
    Later(alone)
    call = alone.bus.client("client", "add", AddTwoInts)
    replies: Replies = []
    call(AddTwoInts.Request(), replies.append, timeout=math.inf)
    alone.settle(after=1e6)
    assert replies == []
    alone.bus.close_owner("later")
    alone.settle()
    assert replies == [Reply(None, LOST)]


def test_requests_that_no_server_took_yet_hear_that_it_went_away(alone: Alone) -> None:
    Later(alone)
    call = alone.bus.client("client", "add", AddTwoInts)
    replies: Replies = []
    call(AddTwoInts.Request(), replies.append)
    alone.bus.close_owner("later")
    alone.settle()
    assert replies == [Reply(None, LOST)]


def test_a_client_hears_of_servers_that_come_and_go(alone: Alone) -> None:
    call = alone.bus.client("client", "add", AddTwoInts)
    changes: list[bool] = []
    call.watch(changes.append)
    alone.bus.serve("server", "add", AddTwoInts, add)
    alone.settle()
    assert call.is_available
    alone.bus.close_owner("server")
    alone.settle()
    assert changes == [True, False]


def test_a_server_hears_of_a_client_that_goes_away(alone: Alone) -> None:
    server = Later(alone)
    call = alone.bus.client("client", "add", AddTwoInts)
    call(AddTwoInts.Request(), lambda reply: None)
    alone.settle()
    alone.bus.close_owner("client")
    alone.settle()
    assert server.left == [server.requests[0].client] == [call.gid]


def test_a_closed_client_hears_no_reply(alone: Alone) -> None:
    server = Later(alone)
    call = alone.bus.client("client", "add", AddTwoInts)
    replies: Replies = []
    call(AddTwoInts.Request(), replies.append)
    alone.settle()
    alone.bus.close_owner("client")
    server.requests[0].reply(AddTwoInts.Response())
    alone.settle(after=10.0)
    assert replies == []


def test_after_closing_nothing_is_left(alone: Alone) -> None:
    alone.bus.serve("server", "add", AddTwoInts, add)
    call = alone.bus.client("client", "add", AddTwoInts)
    call(AddTwoInts.Request(), lambda reply: None)
    alone.bus.close()
    assert len(alone.bus) == 0
    alone.settle()
    assert alone.scheduler.next_due() is None
