"""Writes how a base moves, as any participant on its host sees it: `python -m tests.systems.motion ROUTER FILE`."""

from __future__ import annotations

import signal
import sys
import time
from pathlib import Path

from rbxcompose.bus.names import data_key
from rbxcompose.bus.transport import Arrival
from rbxcompose.bus.zenoh_session import open_peer
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.msgs.cdr import decode
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.sdk.ports import Qos

ROLLING, TURNING = 0.01, 0.05  # [m/s], [rad/s]


def main(router: str, path: Path) -> None:
    """Append a line for each message: time [s, monotonic], and whether it moves."""
    transport = ZenohTransport(open_peer(router), lambda owner, callback: None)
    with path.open("a", buffering=1, encoding="utf-8") as file:

        def take(arrival: Arrival) -> None:
            twist = decode(Odometry, arrival.payload).twist.twist
            moves = abs(twist.linear.x) > ROLLING or abs(twist.angular.z) > TURNING
            file.write(f"{time.monotonic()} {int(moves)}\n")

        transport.subscribe(data_key(0, "odom", Odometry.TYPE, Odometry.HASH), Qos.STATE, take)
        signal.sigwait([signal.SIGINT, signal.SIGTERM])
        transport.close()


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
