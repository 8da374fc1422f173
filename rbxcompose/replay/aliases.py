"""Names that differ in each run: those of a component's clients, and of the goals that it sends.

They depend on the position of an end among all ends of its process. A component that runs alone gets others, which are
mapped to the recorded ones as soon as both were seen in the same request.
"""

from __future__ import annotations

from typing import Any

from rbxcompose.msgs import registry
from rbxcompose.msgs.cdr import decode
from rbxcompose.msgs.service_msgs import ServiceEventInfo
from rbxcompose.recording.message import Recorded


class Aliases:
    """Pairs of 16-byte names: the recorded one and the present one."""

    def __init__(self) -> None:
        self._pairs: dict[bytes, bytes] = {}  # recorded -> now

    def learn(self, recorded: Recorded, now: Recorded) -> None:
        """Learn pairs from the same service event, as recorded and as it is now."""
        cls = registry.message(now.topic.type)
        before: Any = decode(cls, recorded.payload)
        after: Any = decode(cls, now.payload)
        if before.info.event_type == after.info.event_type == ServiceEventInfo.REQUEST_SENT:
            self._add(before.info.client_gid, after.info.client_gid)
            for old, new in zip(before.request, after.request, strict=False):
                if hasattr(old, "goal_id"):
                    self._add(old.goal_id.uuid, new.goal_id.uuid)

    def inwards(self, payload: bytes) -> bytes:
        """Return recorded bytes with the present names."""
        for recorded, now in self._pairs.items():
            payload = payload.replace(recorded, now)
        return payload

    def outwards(self, payload: bytes) -> bytes:
        """Return present bytes with the recorded names."""
        for recorded, now in self._pairs.items():
            payload = payload.replace(now, recorded)
        return payload

    def _add(self, recorded: bytes, now: bytes) -> None:
        if recorded != now:
            self._pairs[recorded] = now
