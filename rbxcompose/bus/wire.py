"""Wire profiles: how the distributions of ROS 2 differ on Zenoh, and how quality of service is written there.

Keys, payloads and the 33-byte attachment are the same for all of them.
"""

from __future__ import annotations

from dataclasses import field

from rbxcompose.dataclass import dataclass
from rbxcompose.msgs.types import Interface

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
