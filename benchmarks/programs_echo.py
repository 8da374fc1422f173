"""A program with bare Zenoh that answers each velocity with odometry, for the benchmark of the bridge."""

import os
import signal
import struct
import time
from typing import Any

import zenoh

# Odometry with two empty names in front of its numbers: stamp, frame, child frame, and so on.
_HEAD = b"\0\1\0\0" + bytes(8) + (b"\1\0\0\0\0\0\0\0" * 2) + bytes(7 * 8 + 36 * 8)


def main() -> None:
    """Answer until the process is ended."""
    gid, sequence = os.urandom(16), 0
    with zenoh.open(zenoh.Config.from_env()) as session:
        sender = session.declare_publisher(os.environ["RBXCOMPOSE_KEY_BRIDGE_ODOM"])

        def answer(sample: Any) -> None:
            nonlocal sequence
            sequence += 1
            velocities = sample.payload.to_bytes()[4:52]
            origin = struct.pack("<qqB", sequence, time.time_ns(), 16) + gid
            sender.put(_HEAD + velocities + bytes(36 * 8), attachment=origin)

        session.declare_subscriber(os.environ["RBXCOMPOSE_KEY_BRIDGE_CMD"], answer)
        signal.sigwait([signal.SIGTERM])


if __name__ == "__main__":
    main()
