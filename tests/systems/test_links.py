"""Routers that are linked: what crosses, and how much of it."""

from __future__ import annotations

import socket
import time
from collections import Counter
from collections.abc import Callable

import zenoh

from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.bus.names import topic_pattern
from rbxcompose.bus.transport import Arrival
from rbxcompose.bus.zenoh_session import RouterLink, open_peer, open_router
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.sdk.ports import Qos

LONGEST = 20.0  # [s]
SENT = 50


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


def until(holds: Callable[[], bool]) -> None:
    deadline = time.monotonic() + LONGEST
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def transport(router: str) -> ZenohTransport:
    return ZenohTransport(open_peer(router), lambda owner, callback: callback())


def test_a_topic_is_downsampled_on_its_way_to_another_host_and_whole_on_its_own() -> None:
    link, here, there = (tcp_endpoint(free_port()) for _ in range(3))
    session = open_router(here, RouterLink((link,), (), downsample={topic_pattern(0, "/scan"): 0.1}))
    other = open_router(there, RouterLink((), (link,)))
    sender, neighbour, stranger = transport(here), transport(here), transport(there)
    got: Counter[str] = Counter()

    def hear(who: ZenohTransport, label: str, topic: str) -> None:
        def count(arrival: Arrival) -> None:
            got[f"{label} {topic}"] += 1

        who.subscribe(f"0/{topic}/type/hash", Qos.EVENT, count)

    for topic in ("scan", "odom"):
        hear(neighbour, "here", topic)
        hear(stranger, "there", topic)
    scan, odom = (sender.publisher(f"0/{topic}/type/hash", Qos.EVENT) for topic in ("scan", "odom"))

    def send(times: int) -> None:
        for _ in range(times):
            scan.put(b"", b"")
            odom.put(b"", b"")

    def are_all_met() -> bool:
        send(1)
        return len(got) == 4

    try:
        until(are_all_met)
        got.clear()
        send(SENT)
        until(lambda: got["here scan"] >= SENT and got["there odom"] >= SENT)
        assert got["there scan"] <= 1 + LONGEST * 0.1
    finally:
        for each in (sender, neighbour, stranger, session, other):
            each.close()


def test_on_its_way_to_another_host_a_topic_has_its_own_priority_and_what_is_too_large_is_left_out() -> None:
    link, here, there = (tcp_endpoint(free_port()) for _ in range(3))
    scan, odom = (topic_pattern(0, topic) for topic in ("/scan", "/odom"))
    one = open_router(here, RouterLink((link,), (), priorities={scan: "low"}, largest={odom: 100}))
    other = open_router(there, RouterLink((), (link,)))
    sender, stranger = transport(here), open_peer(there)
    got: Counter[tuple[str, int, str]] = Counter()
    first, last = "Priority.INTERACTIVE_HIGH", "Priority.BACKGROUND"

    def take(sample: zenoh.Sample) -> None:
        got[str(sample.key_expr).split("/")[1], len(sample.payload), str(sample.priority)] += 1

    stranger.declare_subscriber("0/**", zenoh.handlers.Callback(take, indirect=False))
    publishers = [sender.publisher(f"0/{topic}/type/hash", Qos.STATE) for topic in ("scan", "odom")]

    def is_met() -> bool:
        for size in (200, 10):  # the one that is left out comes first
            for publisher in publishers:
                publisher.put(bytes(size), b"")
        return got["odom", 10, first] > 2 and got["scan", 10, last] > 2

    try:
        until(is_met)
        assert got.keys() == {("odom", 10, first), ("scan", 10, last), ("scan", 200, last)}
    finally:
        sender.close()
        for session in (stranger, one, other):
            session.close()  # type: ignore[no-untyped-call]
