"""A program that floods a topic with what is no command: `flooder.py ROUTER TOPIC RATE SECONDS`.

It sends `RATE` messages a second, or as many as it can, and prints how many it has sent.
"""

from __future__ import annotations

import sys
import time

from rbxcompose.bus.names import data_key
from rbxcompose.bus.zenoh_session import open_peer
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.sdk.ports import Qos

BATCH = 0.005  # [s] between two looks at the clock
NOTHING = b"\xff" * 48  # as long as a command, with numbers that are none


def main(router: str, topic: str, rate: float, seconds: float) -> None:
    """Wait for who listens, then send."""
    transport = ZenohTransport(open_peer(router), lambda owner, callback: None)
    publisher = transport.publisher(data_key(0, topic, Twist.TYPE, Twist.HASH), Qos.COMMAND)
    while not publisher.has_match:
        time.sleep(BATCH)
    sys.stdout.write("it begins\n")
    sys.stdout.flush()
    began, sent = time.monotonic(), 0
    while (passed := time.monotonic() - began) < seconds:
        due = int(passed * rate) - sent
        for _ in range(min(due, int(rate * BATCH))):
            publisher.put(NOTHING, b"")
        sent += max(0, min(due, int(rate * BATCH)))
        if due <= 0:
            time.sleep(BATCH)
    sys.stdout.write(f"{sent}\n")
    transport.close()


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], float(sys.argv[3]), float(sys.argv[4]))
