"""How the hosts of a robot tell each other how they are: one key for each, written by the router of that host.

With access control, each report follows a message that the other router must not let through. A report that arrives
without it proves both: what is allowed passes, and what is denied does not. Zenoh itself drops without a word, and
would let all pass as silently.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

from rbxcompose.bus.names import admin_key, denied_key
from rbxcompose.bus.transport import Arrival, Transport
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import kind
from rbxcompose.plan.model import Share
from rbxcompose.qos import Qos
from rbxcompose.runtime.clock_offset import Echo, OffsetFilter
from rbxcompose.runtime.host_report import HostReport
from rbxcompose.typed_json import UnreadableError, from_data, to_data

LETS_THROUGH = kind("RBX6142")


def host_key(robot: str, host: str) -> str:
    """Return the Zenoh key of the reports of a host."""
    return admin_key(robot, f"hosts/{host}")


@dataclass(frozen=True, slots=True)
class _Sent:
    """A report on its way: when it was sent, and when the last ones of the other hosts were sent and arrived [ns]."""

    report: HostReport
    sent: int
    heard: dict[str, Echo]


class HostLine:
    """Sends the reports of this host; `heard` is called with those of the others, in the scheduler's thread.

    `passed` is called with the reason if a message of another host came through that is denied. `stamp` is wall-clock
    time [ns]; reports both ways tell how far the clocks of two hosts are apart. `judge` takes of each report its host,
    when it was sent, and what that host had heard.
    """

    def __init__(
        self,
        robot: str,
        share: Share,
        transport: Transport,
        heard: Callable[[HostReport], None],
        passed: Callable[[str], None],
        stamp: Callable[[], int],
        judge: Callable[[str, int, Mapping[str, Echo]], None],
    ) -> None:
        self._heard, self._passed, self._transport, self._judge = heard, passed, transport, judge
        self._stamp, self._host = stamp, share.host
        self._echoes: dict[str, Echo] = {}
        self._filters: dict[str, OffsetFilter] = {}
        self._denied = transport.publisher(denied_key(robot, share.host), Qos.STATE) if share.access else None
        for other in share.others if share.access else ():  # before the reports, so that whoever knows these knows both
            transport.subscribe(denied_key(robot, other.name), Qos.STATE, partial(self._came_through, other.name))
        self._publisher = transport.publisher(host_key(robot, share.host), Qos.STATE)
        for other in share.others:
            transport.subscribe(host_key(robot, other.name), Qos.STATE, self._arrived)

    def tell(self, report: HostReport) -> None:
        """Send a report; nobody waits for it."""
        if self._denied is not None:
            self._denied.put(b"", b"")
        sent = _Sent(report, self._stamp(), self._echoes)
        self._publisher.put(json.dumps(to_data(sent)).encode(), b"")

    def _came_through(self, host: str, arrival: Arrival) -> None:
        text = f"{LETS_THROUGH.code}: access control lets through what it denies to host '{host}'"
        self._transport.wake("", lambda: self._passed(text))

    def _arrived(self, arrival: Arrival) -> None:
        data, arrived = arrival.payload, self._stamp()
        self._transport.wake("", lambda: self._read(data, arrived))

    def _read(self, data: bytes, arrived: int) -> None:
        try:
            told: _Sent = from_data(_Sent, json.loads(data))
        except (UnreadableError, ValueError, RecursionError):
            return  # another version, or a stranger: the host counts as silent, which is told
        host = told.report.host
        self._echoes[host] = answer = Echo(told.sent, arrived)
        own = told.heard.get(self._host)
        clock = self._filters.setdefault(host, OffsetFilter()).feed(own, answer) if own else None
        self._heard(replace(told.report, clock=clock))
        self._judge(host, told.sent, told.heard)
