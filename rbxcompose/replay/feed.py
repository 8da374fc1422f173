"""Feed a component with a recording: each input at its instant, after what preceded it there.

A stepped run is ordered by time, then owner, then sequence. So a message is replayed as an event of its sender; if
the component itself sent something in between, or the host received an order, it comes after all of that.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from typing import Any

from rbxcompose.bus.attachment import Attachment
from rbxcompose.bus.names import data_key
from rbxcompose.bus.transport import TransportReply
from rbxcompose.clock import NANOSECONDS
from rbxcompose.levels import Level
from rbxcompose.msgs.cdr import decode, encode
from rbxcompose.msgs.events import TOPIC, event_of
from rbxcompose.msgs.service_msgs import ServiceEventInfo
from rbxcompose.msgs.std_msgs import Float64, String
from rbxcompose.recording.message import Recorded
from rbxcompose.recording.tape import INSTANTS, ORDERS
from rbxcompose.replay.aliases import Aliases
from rbxcompose.replay.services import Known, ReplayedServices
from rbxcompose.replay.stage import Fed, ReplayStage
from rbxcompose.requests import Refused
from rbxcompose.runtime.process_group.host import Host
from rbxcompose.scheduler import Scheduler

LAST = "\U0010ffff"  # an owner whose events come after those of all others


class ReplayFeed:
    """Goes through the records of a run once; those of the component itself go to `expect`."""

    def __init__(
        self,
        records: Iterator[Recorded],
        name: str,
        domain: int,
        stage: ReplayStage,
        services: ReplayedServices,
        aliases: Aliases,
        expect: Callable[[Recorded], None],
    ) -> None:
        self._records, self._name, self._domain = records, name, domain
        self._stage, self._services, self._aliases, self._expect = stage, services, aliases, expect
        self._instant = (0, 0.0)  # [ns], [s]
        self._count = 0
        self._next: Recorded | None = None
        self._last = 0  # [ns], of the record read last
        self._is_whole = False

    def begin(self, scheduler: Scheduler, host: Host) -> None:
        """Schedule the first input."""
        self._scheduler, self._host = scheduler, host
        self._next = self._following()
        self._schedule(is_after_own=True)

    def is_past(self, time: float) -> bool:
        """Return whether a time [s] is after everything that was recorded."""
        return self._next is None and round(time * NANOSECONDS) > self._last

    @property
    def cut_at(self) -> float:
        """Return the time [ns] after which the recording may lack something, since it has no orderly end."""
        return math.inf if self._is_whole else self._last

    def _following(self) -> Recorded | None:
        """Return the next record that is not an instant."""
        for record in self._records:
            self._last = record.log_time
            if record.topic.name != INSTANTS:
                return record
            self._instant = (record.log_time, decode(Float64, record.payload).data)
        return None

    def _time(self, record: Recorded) -> float:
        stamp, exact = self._instant
        return exact if stamp == record.log_time else record.log_time / NANOSECONDS

    def _schedule(self, *, is_after_own: bool = False) -> None:
        """Skip to the next input, and schedule it at its time."""
        while self._next is not None and not self._is_input(self._next):
            if self._next.topic.node == self._name:
                self._expect(self._next)
                is_after_own = True
            self._next = self._following()
        if self._next is not None:
            owner = LAST if is_after_own or self._next.topic.name == ORDERS else self._next.topic.node
            self._scheduler.at(self._time(self._next), owner, self._feed)

    def _feed(self) -> None:
        """Deliver all inputs that the sender sent in one go."""
        first = self._next
        is_after_own = False
        while self._next is not None and first is not None and _belong_together(first, self._next):
            if self._is_input(self._next):
                self._arrive(self._next)
            self._next = self._following()
        self._schedule(is_after_own=is_after_own)

    def _is_input(self, record: Recorded) -> bool:
        topic = record.topic
        if topic.node == self._name:
            return False
        if topic.name == ORDERS:
            return True
        if topic.name.endswith(f"/{TOPIC}"):
            return self._services.find(topic.name) is not None
        return self._key(record) in self._stage.subscribers

    def _key(self, record: Recorded) -> str:
        return data_key(self._domain, record.topic.name, record.topic.type, record.topic.hash)

    def _arrive(self, record: Recorded) -> None:
        payload = self._aliases.inwards(record.payload)
        if record.topic.name == ORDERS:
            self._order(*json.loads(decode(String, payload).data))
        elif service := self._services.find(record.topic.name):
            self._called(service, payload)
        else:
            self._count += 1
            sender = record.topic.node.encode()[:16].ljust(16, b"\0")
            self._stage.publish(self._key(record), payload, Attachment(self._count, record.publish_time, sender))

    def _order(self, verb: str, *words: Any) -> None:
        """Repeat an order to the host, as far as it concerns this component."""
        match verb:
            case "shutdown":
                self._is_whole = True
                self._host.shutdown()
            case "activate":
                self._host.activate([name for name in words if name == self._name])
            case "lost":
                self._host.lost(words[1:], words[0])
            case "command":
                self._command(*words)
            case "start" | "stop" | "release" | "brake":
                getattr(self._host, verb)()

    def _command(self, instance: str, data: object) -> None:
        if instance != self._name:
            return
        try:
            request = self._host.request(instance, data)
        except Refused as refusal:  # recorded by another version
            self._host.log(instance, Level.ERROR, f"a recorded command cannot be given again: {refusal}")
            return
        try:
            self._host.ask(instance, request)
        except Refused:
            return  # refused as in the recording

    def _called(self, service: Known, payload: bytes) -> None:
        """Deliver a request to its server, or a reply to its client."""
        key, interface = service
        event = decode(event_of(interface), payload)
        info: ServiceEventInfo = event.info
        source = Attachment(info.sequence_number, 0, info.client_gid).encode()
        if info.event_type == ServiceEventInfo.REQUEST_SENT and key in self._stage.servers and event.request:
            self._stage.servers[key](Fed(encode(event.request[0]), source))
        elif info.event_type == ServiceEventInfo.RESPONSE_SENT:
            answered = self._stage.waiting.pop((key, info.client_gid, info.sequence_number), None)
            if answered is not None:
                failed = TransportReply(error="the recorded request failed")
                answered(TransportReply(encode(event.response[0])) if event.response else failed)


def _belong_together(first: Recorded, record: Recorded) -> bool:
    """Return whether two records were sent in one go."""
    return (record.topic.node, record.log_time) == (first.topic.node, first.log_time) and (
        (record.topic.name == ORDERS) == (first.topic.name == ORDERS)
    )
