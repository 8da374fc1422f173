"""A base that knows nothing but Zenoh: it integrates velocities, publishes odometry, and brakes after 0.5 s.

It is how a driver in another language would be written: bytes at the keys that its environment names.
"""

import math
import os
import signal
import struct
import sys
import time
from typing import Any

import zenoh

RATE, BRAKES_AFTER = 50.0, 0.5  # [Hz], [s]


class Writer:
    """CDR, little-endian: numbers are aligned to their size."""

    def __init__(self) -> None:
        self.data = bytearray(b"\0\1\0\0")

    def put(self, letter: str, *values: float) -> None:
        size = struct.calcsize(f"<{letter}")
        self.data += bytes(-(len(self.data) - 4) % size) + struct.pack(f"<{len(values)}{letter}", *values)

    def text(self, text: str) -> None:
        data = text.encode() + b"\0"
        self.put("I", len(data))
        self.data += data

    def header(self, stamp: int, frame: str) -> None:
        self.put("i", stamp // 10**9)
        self.put("I", stamp % 10**9)
        self.text(frame)


class Base:
    def __init__(self) -> None:
        self.x = self.y = self.heading = 0.0
        self.command, self.at = (0.0, 0.0), -math.inf

    def take(self, sample: Any) -> None:
        velocities = struct.unpack_from("<6d", sample.payload.to_bytes(), 4)
        self.command, self.at = (velocities[0], velocities[5]), time.monotonic()

    def move(self, dt: float) -> tuple[float, float]:
        speed, turn = self.command if time.monotonic() - self.at < BRAKES_AFTER else (0.0, 0.0)
        self.heading += turn * dt
        self.x += speed * math.cos(self.heading) * dt
        self.y += speed * math.sin(self.heading) * dt
        return speed, turn

    def pose(self, writer: Writer) -> None:
        writer.put("d", self.x, self.y, 0.0, 0.0, 0.0, math.sin(self.heading / 2), math.cos(self.heading / 2))


def main() -> None:
    base, gid, sequence = Base(), os.urandom(16), 0
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit())
    with zenoh.open(zenoh.Config.from_env()) as session:
        odometry = session.declare_publisher(os.environ["RBXCOMPOSE_KEY_ODOM"])
        frames = session.declare_publisher(os.environ["RBXCOMPOSE_KEY_TF"])
        own = os.environ.get("RBXCOMPOSE_KEY_UPTIME")  # a message of the user's, where the manifest declares it
        uptime = session.declare_publisher(own) if own else None
        session.declare_subscriber(os.environ["RBXCOMPOSE_KEY_CMD_VEL"], base.take)
        sys.stderr.write("the base is there\n")
        while True:
            time.sleep(1 / RATE)
            speed, turn = base.move(1 / RATE)
            stamp, sequence = time.time_ns(), sequence + 1
            origin = struct.pack("<qqB", sequence, stamp, 16) + gid
            odom = Writer()
            odom.header(stamp, "odom")
            odom.text("base_footprint")
            base.pose(odom)
            odom.put("d", *[0.0] * 36, speed, 0.0, 0.0, 0.0, 0.0, turn, *[0.0] * 36)
            odometry.put(bytes(odom.data), attachment=origin)
            moved = Writer()
            moved.put("I", 1)
            moved.header(stamp, "odom")
            moved.text("base_footprint")
            base.pose(moved)
            frames.put(bytes(moved.data), attachment=origin)
            if uptime is not None:
                up = Writer()
                up.put("i", 7, 0, stamp // 10**9, stamp % 10**9)
                uptime.put(bytes(up.data), attachment=origin)


if __name__ == "__main__":
    main()
