"""The router of a host, and two programs beside it that talk: `python -m tests.systems.host_alone LISTEN|- DIAL|-`.

With a talk it prints how many of its messages arrived, and how many bytes left the host meanwhile.
"""

from __future__ import annotations

import signal
import sys
import time
from pathlib import Path

from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.bus.transport import Arrival
from rbxcompose.bus.zenoh_session import RouterLink, open_peer, open_router
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.sdk.ports import Qos
from tests.systems.namespaces import DEVICE

PORT, KEY = 7447, "0/scan/type/hash"
COUNT, SIZE, PERIOD = 150, 10_000, 0.01  # messages, [bytes], [s] at least between two of them
SENT = Path(f"/sys/class/net/{DEVICE}/statistics/tx_bytes")


def main(listen: str, dial: str) -> None:
    """Run the router; the host that listens talks once the other one is linked, and ends."""
    ends = [() if text == "-" else (text,) for text in (listen, dial)]
    router = open_router(tcp_endpoint(PORT), RouterLink(ends[0], ends[1]))
    if listen == "-":
        signal.sigwait([signal.SIGINT, signal.SIGTERM])
    else:
        sender, taker = (ZenohTransport(open_peer(tcp_endpoint(PORT)), lambda owner, call: None) for _ in range(2))
        got: list[Arrival] = []
        taker.subscribe(KEY, Qos.STATE, got.append)
        publisher = sender.publisher(KEY, Qos.STATE)
        while not (router.info.routers_zid() and got):
            publisher.put(b"", b"")
            time.sleep(0.02)
        got.clear()
        before = int(SENT.read_text())
        for _ in range(COUNT):
            publisher.put(bytes(SIZE), b"")
            time.sleep(PERIOD)
        print(len(got), int(SENT.read_text()) - before)  # noqa: T201 - its output is its answer
        for each in (sender, taker):
            each.close()
    router.close()  # type: ignore[no-untyped-call]


if __name__ == "__main__":
    main(*sys.argv[1:])
