"""A process of its own that sends pictures until it is killed: `python -m tests.bus.lone_camera PORT`."""

from __future__ import annotations

import os
import sys
import time

import numpy as np

from rbxcompose.base.clock import MonotonicClock
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.zenoh_session import open_peer
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.msgs.rcl_interfaces import ParameterValue
from rbxcompose.sdk.ports import Qos

SIZES = (60_000, 1_000_000, 8_000_000)  # bytes
PERIOD = 0.1  # [s] between two pictures


def picture(size: int) -> ParameterValue:
    """Return a message with `size` octets, and as many bytes of numbers."""
    octets = np.random.default_rng(size).bytes(size)
    return ParameterValue(byte_array_value=octets, double_array_value=np.arange(size // 8, dtype="<f8"))


def main(port: str) -> None:
    """Send a picture of each size, again and again, as whoever listens may have come late."""
    parent = os.getppid()
    transport = ZenohTransport(open_peer(f"tcp/127.0.0.1:{port}"), lambda owner, callback: None)
    bus = Bus(Scheduler(), MonotonicClock(), transport=transport, log=lambda owner, text: None)
    publish = bus.publisher("camera", "image", ParameterValue, Qos.BULK)
    pictures = [picture(size) for size in SIZES]
    while os.getppid() == parent:
        for parameter_value in pictures:
            publish(parameter_value)
            time.sleep(PERIOD)


if __name__ == "__main__":
    main(sys.argv[1])
