"""A process of its own that serves an action until it is killed: `python -m tests.bus.lone_server PORT`."""

from __future__ import annotations

import queue
import sys
from collections.abc import Callable
from contextlib import suppress

from rbxcompose.base.clock import MonotonicClock
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.zenoh_session import open_peer
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.msgs.nav2_msgs import NavigateToPose


def main(port: str) -> None:
    clock, scheduler = MonotonicClock(), Scheduler()
    woken: queue.SimpleQueue[tuple[str, Callable[[], None]]] = queue.SimpleQueue()
    transport = ZenohTransport(open_peer(f"tcp/127.0.0.1:{port}"), lambda owner, callback: woken.put((owner, callback)))
    bus = Bus(scheduler, clock, transport=transport, log=lambda owner, text: None)
    server = bus.serve_action("base", "go_to", NavigateToPose, lambda goal: "")
    for _ in range(3000):  # some 30 s at most, should the test have gone without killing it
        with suppress(queue.Empty):
            scheduler.post(*woken.get(timeout=0.01))
        scheduler.advance(clock.now())
        if server.current is not None:
            server.current.feedback(NavigateToPose.Feedback(distance_remaining=1.0))


if __name__ == "__main__":
    main(sys.argv[1])
