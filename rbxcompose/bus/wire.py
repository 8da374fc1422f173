"""Wire profiles of ROS 2's distributions, and what a QoS class means for Zenoh."""

from dataclasses import field

from rbxcompose.base.dataclass import dataclass
from rbxcompose.msgs.types import Interface
from rbxcompose.sdk.ports import Qos

DEFAULT_DEPTH = 42  # of rmw_zenoh, since its version 0.2


@dataclass(frozen=True, slots=True)
class RosQos:
    """Quality of service in the words of ROS; the defaults are those of rmw_zenoh."""

    is_reliable: bool = True
    is_transient_local: bool = False
    keeps_all: bool = False
    depth: int = DEFAULT_DEPTH


@dataclass(frozen=True, slots=True)
class WireProfile:
    """The particulars of one distribution on the wire."""

    name: str
    has_type_hashes: bool = True
    default_qos: RosQos = field(default_factory=RosQos)

    def hash_of(self, interface: type[Interface]) -> str:
        """Return the last chunk of the data key; ends with different ones never meet."""
        return interface.HASH if self.has_type_hashes else "TypeHashNotSupported"

    def qos_text(self, qos: RosQos) -> str:
        """Return `qos` as tokens write it, without what equals the default.

        A written default would mean the same, but GIDs are derived from the text of the token.
        """
        default = self.default_qos
        reliability = _unless(qos.is_reliable == default.is_reliable, 1 if qos.is_reliable else 2)
        durability = _unless(qos.is_transient_local == default.is_transient_local, 1 if qos.is_transient_local else 2)
        history = _unless(qos.keeps_all == default.keeps_all, 2 if qos.keeps_all else 1)
        depth = _unless(qos.depth == default.depth, qos.depth)
        # Deadline, lifespan and liveliness are never set.
        return f"{reliability}:{durability}:{history},{depth}:,:,:,,"

    def read_qos(self, text: str) -> RosQos:
        """Read the text that `qos_text` wrote.

        Raises:
            ValueError: if it is something else.
        """
        reliability, durability, history, *_ = text.split(":")
        kind, depth = history.split(",")
        default = self.default_qos
        return RosQos(
            is_reliable=reliability == "1" if reliability else default.is_reliable,
            is_transient_local=durability == "1" if durability else default.is_transient_local,
            keeps_all=kind == "2" if kind else default.keeps_all,
            depth=int(depth) if depth else default.depth,
        )


def _unless(is_default: bool, value: int) -> str:
    return "" if is_default else str(value)


WIRE_PROFILES = {
    profile.name: profile
    for profile in (
        WireProfile("humble", has_type_hashes=False),
        WireProfile("jazzy"),
        WireProfile("kilted"),
        WireProfile("lyrical"),
    )
}


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
