"""Messages: bytes of a twist, and its way from one component to another in the same process."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rosbags.typesys import Stores, get_typestore

from benchmarks.measuring import Row, in_turns
from rbxcompose.base.clock import SteppedClock
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.bus import Bus
from rbxcompose.msgs.cdr import decode, encode
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.sdk.ports import Qos

MEASURES = ("rbxcompose/bus", "rbxcompose/msgs")

MANY = 2000  # per sample
TWIST = Twist(linear=Vector3(x=0.3), angular=Vector3(z=-1.0))
NAME = "geometry_msgs/msg/Twist"


def rows() -> list[Row]:
    """Return the figures of messages."""
    store = get_typestore(Stores.ROS2_JAZZY)
    vector, twist = store.types["geometry_msgs/msg/Vector3"], store.types[NAME]
    theirs: Any = twist(linear=vector(x=0.3, y=0.0, z=0.0), angular=vector(x=0.0, y=0.0, z=-1.0))
    payload = encode(TWIST)
    return [
        _beside("encode a Twist", lambda: encode(TWIST), lambda: store.serialize_cdr(theirs, NAME)),
        _beside("decode a Twist", lambda: decode(Twist, payload), lambda: store.deserialize_cdr(payload, NAME)),
        _hop(),
    ]


def _beside(name: str, ours: Callable[[], object], theirs: Callable[[], object]) -> Row:
    mine, peer = in_turns(_many(ours), _many(theirs), rounds=25)
    return Row(
        name=name,
        unit="µs",
        how=f"mean of {MANY:,}, beside rosbags",
        ours=mine.median / MANY * 1e6,
        p99=mine.p99 / MANY * 1e6,
        peer=peer.median / MANY * 1e6,
        against="rosbags",
    )


def _many(job: Callable[[], object]) -> Callable[[], object]:
    def run() -> None:
        for _ in range(MANY):
            job()

    return run


def _hop() -> Row:
    scheduler, clock = Scheduler(), SteppedClock()
    bus = Bus(scheduler, clock, log=lambda owner, text: None)
    taken: list[Twist] = []
    bus.subscribe("taker", "cmd_vel", Twist, Qos.COMMAND, taken.append)
    publish = bus.publisher("giver", "cmd_vel", Twist, Qos.COMMAND)

    def hop() -> None:
        publish(TWIST)
        scheduler.advance(clock.now())

    (ours,) = in_turns(_many(hop), rounds=25)
    if len(taken) != MANY * 26:
        raise ValueError("messages were lost")
    return Row(
        name="hop of a Twist within a process",
        unit="µs",
        how=f"publish, schedule, take; mean of {MANY:,}",
        ours=ours.median / MANY * 1e6,
        p99=ours.p99 / MANY * 1e6,
        most=50,
    )
