"""A substitute for the rest of the robot: a transport that plays a recording, and a bus over it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import TypeVar

from rbxcompose.bus.attachment import Attachment, decode_attachment
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.topics import Publisher
from rbxcompose.bus.transport import LONGEST_WAIT, Arrival, NoTransport, Question, TransportReply
from rbxcompose.clock import Clock
from rbxcompose.dataclass import dataclass
from rbxcompose.msgs.types import Message
from rbxcompose.plan.model import Plan
from rbxcompose.qos import Qos
from rbxcompose.recording.tape import Tape
from rbxcompose.scheduler import Scheduler

M = TypeVar("M", bound=Message)


@dataclass(frozen=True, slots=True)
class Fed:
    """Recorded bytes on their way in; the reply to a request goes to nobody, since a witness records it."""

    payload: bytes
    attachment: bytes

    def reply(self, payload: bytes, attachment: bytes) -> None:
        """Leave the reply to the witness."""

    def fail(self, error: str) -> None:
        """Leave the failure to the witness."""


@dataclass(slots=True)
class ReplayStage(NoTransport):
    """A transport whose other side is a recording. Keys are those of topics and services."""

    scheduler: Scheduler
    served: Callable[[str], bool]  # returns whether a token pattern has a server in the robot
    session: str = "0"
    subscribers: dict[str, list[Callable[[Arrival], None]]] = field(default_factory=dict)
    servers: dict[str, Callable[[Question], None]] = field(default_factory=dict)
    waiting: dict[tuple[str, bytes, int], Callable[[TransportReply], None]] = field(default_factory=dict)

    def wake(self, owner: str, callback: Callable[[], None]) -> None:
        """Let the scheduler run the callback at this instant."""
        self.scheduler.post(owner, callback)

    bring = wake

    def subscribe(self, key: str, qos: Qos, arrived: Callable[[Arrival], None]) -> NoTransport:
        """Receive the recorded messages."""
        self.subscribers.setdefault(key, []).append(arrived)
        return self

    def serve(self, key: str, asked: Callable[[Question], None]) -> NoTransport:
        """Receive the recorded requests."""
        self.servers[key] = asked
        return self

    def ask(
        self,
        key: str,
        payload: bytes,
        attachment: bytes,
        answered: Callable[[TransportReply], None],
        *,
        of_all: bool = True,
        within: float = LONGEST_WAIT,
    ) -> NoTransport:
        """Wait for the recorded reply."""
        source = decode_attachment(attachment)
        self.waiting[key, source.gid, source.sequence] = answered
        return self

    def watch(self, pattern: str, changed: Callable[[str, bool], None]) -> NoTransport:
        """Report a server where the robot has one."""
        if self.served(pattern):
            changed(pattern.replace("*", "recorded"), True)
        return self

    def publish(self, key: str, payload: bytes, source: Attachment) -> None:
        """Deliver a recorded message."""
        for arrived in self.subscribers.get(key, ()):
            arrived(Fed(payload, source.encode()))


class StageBus(Bus):
    """The bus of one component. Its host's own messages go nowhere: the recording has those of the whole host."""

    def __init__(
        self, scheduler: Scheduler, clock: Clock, plan: Plan, owner: str, stage: ReplayStage, tape: Tape
    ) -> None:
        names, wire = plan.bus, plan.bus.wire
        super().__init__(
            scheduler,
            clock,
            domain=names.domain,
            namespace=names.namespace,
            wire=wire,
            transport=tape.around(stage),
            witness=tape.witness,
            log=lambda owner, text: None,
        )
        self._owner = owner
        self._aside = Bus(scheduler, clock, wire=wire, log=lambda owner, text: None)

    def publisher(self, owner: str, topic: str, message: type[M], qos: Qos) -> Publisher[M]:
        """Declare a publisher of the component; messages of any other owner go nowhere."""
        if owner != self._owner:
            return self._aside.publisher(owner, topic, message, qos)
        return super().publisher(owner, topic, message, qos)
