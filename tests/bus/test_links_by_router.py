"""With `links: router`, processes reach each other by the router alone, so their links do not grow with the others."""

from __future__ import annotations

from queue import SimpleQueue
from typing import Any

import pytest

from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.bus.zenoh_session import open_lone, open_peer, open_router
from rbxcompose.compiler.sections.bus import BusModel
from tests.systems.test_links import free_port, until

PATIENCE = 10.0  # [s]


@pytest.mark.parametrize("is_alone", [True, False])
def test_a_message_gets_to_another_process_which_is_linked_only_if_it_is_not_alone(is_alone: bool) -> None:
    router = open_router(endpoint := tcp_endpoint(free_port()))
    giver, taker = (open_lone(endpoint) if is_alone else open_peer(endpoint) for _ in range(2))
    try:
        heard: SimpleQueue[bytes] = SimpleQueue()
        subscriber = taker.declare_subscriber("a/key", lambda sample: heard.put(sample.payload.to_bytes()))
        publisher = giver.declare_publisher("a/key")
        status: Any = publisher  # whose stub has another type
        until(lambda: bool(status.matching_status.matching))
        publisher.put(b"word")
        assert heard.get(timeout=PATIENCE) == b"word"
        until(lambda: bool(giver.info.peers_zid()) is not is_alone)
        subscriber.undeclare()  # type: ignore[no-untyped-call]
    finally:
        for session in (giver, taker, router):
            session.close()  # type: ignore[no-untyped-call]


def test_without_a_router_there_is_no_session_and_the_process_may_say_so() -> None:
    with pytest.raises(OSError, match="no router answers"):
        open_lone(tcp_endpoint(free_port()))


def test_links_by_a_router_need_one_that_exists() -> None:
    with pytest.raises(ValueError, match="needs 'router'"):
        BusModel(links="router")
    assert BusModel(links="router", router="tcp/127.0.0.1:7447").links == "router"
