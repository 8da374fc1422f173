"""Routers that are linked: what crosses, and how much of it."""

from __future__ import annotations

import socket
import time
from collections import Counter
from collections.abc import Callable

from rbxcompose.bus.names import topic_pattern
from rbxcompose.bus.transport import Arrival
from rbxcompose.bus.zenoh_session import RouterLink, open_peer, open_router
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.endpoints import tcp_endpoint
from rbxcompose.qos import Qos

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
    one = open_router(here, RouterLink((link,), (), downsample={topic_pattern(0, "/scan"): 0.1}))
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
        for each in (sender, neighbour, stranger, one, other):
            each.close()
