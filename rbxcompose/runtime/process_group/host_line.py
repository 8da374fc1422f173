"""How the hosts of a robot tell each other how they are: one key for each, written by the router of that host."""

from __future__ import annotations

import json
from collections.abc import Callable

from rbxcompose.bus.names import admin_key
from rbxcompose.bus.transport import Arrival, Transport
from rbxcompose.plan.model import Share
from rbxcompose.qos import Qos
from rbxcompose.runtime.host_report import HostReport
from rbxcompose.typed_json import UnreadableError, from_data, to_data


def host_key(robot: str, host: str) -> str:
    """Return the Zenoh key of the reports of a host."""
    return admin_key(robot, f"hosts/{host}")


class HostLine:
    """Sends the reports of this host; `heard` is called with those of the others, in the scheduler's thread."""

    def __init__(self, robot: str, share: Share, transport: Transport, heard: Callable[[HostReport], None]) -> None:
        self._heard, self._transport = heard, transport
        self._publisher = transport.publisher(host_key(robot, share.host), Qos.STATE)
        for other in share.others:
            transport.subscribe(host_key(robot, other.name), Qos.STATE, self._arrived)

    def tell(self, report: HostReport) -> None:
        """Send a report; nobody waits for it."""
        self._publisher.put(json.dumps(to_data(report)).encode(), b"")

    def _arrived(self, arrival: Arrival) -> None:
        data = arrival.payload
        self._transport.wake("", lambda: self._read(data))

    def _read(self, data: bytes) -> None:
        try:
            report = from_data(HostReport, json.loads(data))
        except (UnreadableError, ValueError, RecursionError):
            return  # another version, or a stranger: the host counts as silent, which is told
        self._heard(report)
