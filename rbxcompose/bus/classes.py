"""What a QoS class means: for Zenoh's publishers, for a subscriber's queue, and in the words of ROS."""

from __future__ import annotations

from rbxcompose.bus.wire import RosQos
from rbxcompose.dataclass import dataclass
from rbxcompose.qos import Qos

SERVICE_QOS = RosQos(depth=10)  # ROS's default for services

COMMAND_RATE = 1000.0  # [Hz]; a higher rate is no control loop but a mistake
LATCHED_QUEUE = 100  # several publishers may each have a latched message for one subscriber


@dataclass(frozen=True, slots=True)
class Sending:
    """How Zenoh sends what is published: `priority` is a name of its `Priority`."""

    priority: str
    is_express: bool = False  # sent immediately, never batched
    blocks: bool = False  # when the link is congested: wait, rather than drop
    is_reliable: bool = True


# `event` has a priority of its own, since its waiting messages would hold up all others of that priority.
_SENDING = {
    Qos.COMMAND: Sending("REAL_TIME", is_express=True),
    Qos.STATE: Sending("INTERACTIVE_HIGH"),
    Qos.EVENT: Sending("DATA_HIGH", blocks=True),
    Qos.LATCHED: Sending("DATA"),
    Qos.BULK: Sending("DATA_LOW", is_reliable=False),
}

SERVICE_SENDING = Sending("INTERACTIVE_LOW", is_express=True, blocks=True)


def sending(qos: Qos) -> Sending:
    """Return how messages of this class are sent."""
    return _SENDING[qos]


def queue_depth(qos: Qos) -> int:
    """Return how many messages a subscription holds before the oldest is dropped."""
    return LATCHED_QUEUE if qos is Qos.LATCHED else qos.depth


def most_per_second(qos: Qos) -> float | None:
    """Return the default limit on messages that a subscription takes from each publisher of another process [Hz]."""
    return COMMAND_RATE if qos is Qos.COMMAND else None


def expects_speech(qos: Qos) -> bool:
    """Return whether a publisher that exists should publish something before long."""
    return qos in (Qos.STATE, Qos.LATCHED)


def ros_qos(qos: Qos) -> RosQos:
    """Return the quality of service that ROS tools see for this class."""
    if qos is Qos.EVENT:
        return RosQos(keeps_all=True)
    return RosQos(
        is_reliable=sending(qos).is_reliable, is_transient_local=qos is Qos.LATCHED, keeps_all=False, depth=qos.depth
    )
