"""A router that tells the others that it is there: `python -m tests.systems.telling_router NAME LISTEN DIAL,DIAL FILE`.

The file says whom it heard lately.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from rbxcompose.bus.zenoh_session import RouterLink, open_router
from rbxcompose.endpoints import tcp_endpoint
from tests.systems.test_links import free_port

PERIOD, SILENT, LEASE = 0.05, 0.5, 0.5  # [s] between two messages; after which one counts as silent; of a link


def main(name: str, listen: str, dial: str, file: str) -> None:
    """Run the router until it is ended."""
    link = RouterLink((listen,), tuple(filter(None, dial.split(","))), lease=LEASE)
    router = open_router(tcp_endpoint(free_port()), link)
    heard: dict[str, float] = {}
    router.declare_subscriber("here/*", lambda it: heard.update({str(it.key_expr)[5:]: time.monotonic()}))
    publisher = router.declare_publisher(f"here/{name}")
    while True:
        publisher.put(b"")
        since = time.monotonic() - SILENT
        draft = Path(f"{file}.new")
        draft.write_text(" ".join(sorted({one for one, at in heard.items() if at > since} - {name})), encoding="utf-8")
        draft.replace(file)
        time.sleep(PERIOD)


if __name__ == "__main__":
    main(*sys.argv[1:])
