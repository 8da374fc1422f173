"""A router with a process of its own, as each host has: `linked_router.py LISTEN|- DIAL|- TLS`.

It prints its identity, then that of each router that is linked with it, and ends with its input. `TLS` is JSON.
"""

from __future__ import annotations

import json
import os
import select
import socket
import sys

from rbxcompose.bus.endpoints import tcp_endpoint
from rbxcompose.bus.zenoh_session import RouterLink, open_router

PERIOD = 0.02  # [s]


def main(listen: str, dial: str, tls: str) -> None:
    """Run the router and tell who is linked."""
    ends = [() if text == "-" else (text,) for text in (listen, dial)]
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    router = open_router(tcp_endpoint(port), RouterLink(ends[0], ends[1], json.loads(tls)))
    told: set[str] = set()
    _tell(str(router.zid()))
    while not select.select([sys.stdin], [], [], PERIOD)[0]:
        for linked in {str(one) for one in router.info.routers_zid()} - told:
            told.add(linked)
            _tell(linked)
    os._exit(0)  # Zenoh waits for those that it still dials


def _tell(text: str) -> None:
    print(text, flush=True)  # noqa: T201 - its output is its answer


if __name__ == "__main__":
    main(*sys.argv[1:])
