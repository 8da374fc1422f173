"""QoS classes: five words in place of raw quality-of-service settings."""

from __future__ import annotations

from enum import StrEnum


class Qos(StrEnum):
    """The purpose of a topic; the bus derives queue depth, reliability, priority and congestion control from it."""

    COMMAND = "command"  # newest wins, dropped rather than late
    STATE = "state"  # newest wins, a few kept
    LATCHED = "latched"  # the last one is kept for late subscribers
    EVENT = "event"  # none may be lost
    BULK = "bulk"  # large, lowest priority

    @property
    def depth(self) -> int:
        """Return how many messages a subscriber queues before it drops the oldest."""
        return _DEPTH[self]


_DEPTH = {Qos.COMMAND: 1, Qos.STATE: 10, Qos.LATCHED: 1, Qos.EVENT: 10_000, Qos.BULK: 2}
