"""Runs one component of a recorded robot again from its recorded inputs, and compares what it sends."""

import json
import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import field
from typing import Any, TypeVar

from rbxcompose.base.clock import NANOSECONDS, Clock, SteppedClock
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Refused
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.names import TRANSFORMS, ActionNames, Attachment, data_key, decode_attachment
from rbxcompose.bus.tokens import EntityKind, mangle
from rbxcompose.bus.topics import Publisher
from rbxcompose.bus.transport import Arrival, NoTransport, OnReply, Question, TransportReply
from rbxcompose.bus.wire import WIRE_PROFILES
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.msgs import registry
from rbxcompose.msgs.action_msgs import CancelGoal
from rbxcompose.msgs.cdr import CdrError, decode, encode
from rbxcompose.msgs.plain import to_plain
from rbxcompose.msgs.service_msgs import ServiceEventInfo
from rbxcompose.msgs.std_msgs import Float64, String
from rbxcompose.msgs.types import Message, Service
from rbxcompose.runtime.log import Record
from rbxcompose.runtime.process_group.host import Host
from rbxcompose.runtime.recording.tape import EVENT_TOPIC, INSTANTS, ORDERS, REASONS, Tape, event_of
from rbxcompose.runtime.recording.topics import Recorded, RecordedTopic
from rbxcompose.sdk.ports import Calls, CallsAction, In, Looks, Qos, Serves, ServesAction
from rbxcompose.sdk.registry import component_type


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


Known = tuple[str, type[Service[Any, Any]]]  # key on the bus, type


class ReplayedServices:
    """Maps the service events of a recording to the services of one component."""

    def __init__(self, plan: Plan, instance: Instance) -> None:
        wire = WIRE_PROFILES[plan.bus.wire]
        self._served = {name for one in plan.instances for name, _ in _ends(one, Serves, ServesAction)}
        self._known = {
            f"{name}/{EVENT_TOPIC}": (data_key(plan.bus.domain, name, service.TYPE, wire.hash_of(service)), service)
            for name, service in _ends(instance, Serves, ServesAction, Calls, CallsAction)
        }

    def find(self, topic: str) -> Known | None:
        """Return the component's service whose events are on this topic, if any."""
        return self._known.get(topic)

    def is_served(self, pattern: str) -> bool:
        """Return whether a token pattern matches the servers of a service that the robot has."""
        is_server = f"/{EntityKind.SERVER}/" in pattern
        return is_server and any(f"/{mangle(name)}/" in pattern for name in self._served)


def _ends(instance: Instance, *kinds: type[Any]) -> Iterator[Known]:
    """Yield the name and type of each service behind ports of these kinds."""
    for name, port in component_type(instance.type).ports(instance.config).items():
        interface: Any = port.interface
        if not isinstance(port, kinds):
            continue
        topic = instance.topic(name)
        if isinstance(port, Serves | Calls):
            yield topic, interface
        else:
            names = ActionNames.of(topic)
            yield names.send_goal, interface.SendGoal
            yield names.get_result, interface.GetResult
            yield names.cancel_goal, CancelGoal


M = TypeVar("M", bound=Message)


@dataclass(frozen=True, slots=True)
class Fed:
    """Recorded bytes on their way in; the reply to a request goes to nobody, since a witness records it."""

    payload: bytes
    attachment: bytes

    def reply(self, payload: bytes, attachment: bytes, reason: str = "") -> None:
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
    waiting: dict[tuple[str, bytes, int], OnReply] = field(default_factory=dict)

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
        self, key: str, payload: bytes, attachment: bytes, answered: OnReply, *, of_all: bool, within: float
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


NOTHING = "nothing"


@dataclass(frozen=True, slots=True)
class RunDifference:
    """The first difference from the recording: robot time [s], topic, field (empty: the message as a whole)."""

    time: float
    topic: str
    field: str
    recorded: str
    now: str


class RunComparison:
    """Compares both sides as they arrive."""

    def __init__(self, aliases: Aliases) -> None:
        self.equal = 0  # number of equal messages
        self.difference: RunDifference | None = None
        self._aliases = aliases
        self._recorded: deque[Recorded] = deque()
        self._now: deque[Recorded] = deque()

    def expect(self, record: Recorded) -> None:
        """Take a message of the recording."""
        self._recorded.append(record)
        self._compare()

    def sent(self, record: Recorded) -> None:
        """Take a message sent now."""
        self._now.append(record)
        self._compare()

    def end(self, cut_at: float) -> None:
        """Finish: what is left has no counterpart, unless the recording ends there [ns]."""
        if self.difference is not None:
            return
        if self._recorded and (record := self._recorded[0]).log_time < cut_at:
            self.difference = _whole(record, f"a message on {record.topic.name}", NOTHING)
        if self._now and (record := self._now[0]).log_time < cut_at:
            self.difference = _whole(record, NOTHING, f"a message on {record.topic.name}")

    def _compare(self) -> None:
        while self._recorded and self._now and self.difference is None:
            recorded, now = self._recorded.popleft(), self._now.popleft()
            self.difference = self._between(recorded, now)
            self.equal += self.difference is None

    def _between(self, recorded: Recorded, now: Recorded) -> RunDifference | None:
        if recorded.topic.name != now.topic.name:
            first = min(recorded, now, key=lambda one: one.log_time)
            return _whole(first, f"a message on {recorded.topic.name}", f"a message on {now.topic.name}")
        if recorded.log_time != now.log_time:
            return _whole(min(recorded, now, key=lambda one: one.log_time), *map(_at, (recorded, now)))
        if recorded.topic.name.endswith(f"/{EVENT_TOPIC}"):
            self._aliases.learn(recorded, now)
        if recorded.payload == (payload := self._aliases.outwards(now.payload)):
            return None
        try:
            cls = registry.message(recorded.topic.type)
            pairs = zip(
                _leaves(to_plain(decode(cls, recorded.payload))), _leaves(to_plain(decode(cls, payload))), strict=False
            )
            field, before, after = next((text, a, b) for (text, a), (other, b) in pairs if (text, a) != (other, b))
        except (KeyError, CdrError, StopIteration):  # a type that is not installed, or bytes that belong to no field
            return _whole(recorded, f"{len(recorded.payload)} bytes", f"{len(payload)} other bytes")
        return RunDifference(recorded.log_time / NANOSECONDS, recorded.topic.name, field, f"{before}", f"{after}")


def _at(record: Recorded) -> str:
    return f"at {record.log_time / NANOSECONDS:.6f} s"


def _whole(record: Recorded, recorded: str, now: str) -> RunDifference:
    return RunDifference(record.log_time / NANOSECONDS, record.topic.name, "", recorded, now)


def _leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield each value except maps and lists with its path, and the length of each list."""
    if isinstance(value, Mapping):
        for key, each in value.items():
            yield from _leaves(each, f"{path}.{key}" if path else str(key))
    elif isinstance(value, list | tuple):
        yield f"{path} (length)", len(value)
        for index, each in enumerate(value):
            yield from _leaves(each, f"{path}[{index}]")
    else:
        yield path, value


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
        self._reason = ""
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
        """Return the next record that is neither an instant nor the reason of the reply behind it."""
        self._reason = ""
        for record in self._records:
            self._last = record.log_time
            if record.topic.name == INSTANTS:
                self._instant = (record.log_time, decode(Float64, record.payload).data)
            elif record.topic.name == REASONS:
                self._reason = decode(String, record.payload).data
            else:
                return record
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
        if topic.name.endswith(f"/{EVENT_TOPIC}"):
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
                failed = TransportReply(error=self._reason or "the recorded request failed")
                whole = (TransportReply(encode(each), reason=self._reason) for each in event.response)
                answered(next(whole, failed))


def _belong_together(first: Recorded, record: Recorded) -> bool:
    """Return whether two records were sent in one go."""
    return (record.topic.node, record.log_time) == (first.topic.node, first.log_time) and (
        (record.topic.name == ORDERS) == (first.topic.name == ORDERS)
    )


@dataclass(frozen=True, slots=True)
class ReplayResult:
    """The result: the number of messages that were as recorded, the first that was not, and what went wrong."""

    equal: int
    difference: RunDifference | None
    errors: tuple[str, ...]


def missing_topics(plan: Plan, instance: Instance, topics: Iterable[RecordedTopic]) -> list[str]:
    """Return the inputs of a component that the robot publishes but the recording lacks."""
    recorded = {topic.name for topic in topics}
    published = {wire.topic for one in plan.instances for wire in one.wires if wire.kind == "out"}
    wanted: set[str] = set()
    for name, port in component_type(instance.type).ports(instance.config).items():
        if isinstance(port, In) and instance.topic(name) in published:
            wanted.add(instance.topic(name))
        if isinstance(port, Looks):
            wanted |= {frame for frame in TRANSFORMS if frame in published}
    return sorted(wanted - recorded)


def replayed(
    plan: Plan, instance: Instance, records: Iterable[Recorded], keep: Callable[[Recorded], None] | None = None
) -> ReplayResult:
    """Give a component its recorded inputs at their instants and compare its outputs.

    It stops at the first difference, unless there is a `keep`, which receives all outputs.
    """
    alone = plan.in_one_process()
    only = next(candidate for candidate in alone.instances if candidate.name == instance.name)
    clock, scheduler, aliases, services = SteppedClock(), Scheduler(), Aliases(), ReplayedServices(plan, only)
    comparison = RunComparison(aliases)
    errors: list[str] = []

    def sent(record: Recorded) -> None:
        if record.topic.node == only.name:
            if keep is not None:
                keep(record)
            comparison.sent(record)

    def log(record: Record) -> None:
        if record.level is Level.ERROR:
            errors.append(f"{record.source}: {record.text}")

    stage = ReplayStage(scheduler, services.is_served)
    tape = Tape(clock, lambda topic: None, sent)
    bus = StageBus(scheduler, clock, alone, only.name, stage, tape)
    host = Host(alone, [only], scheduler, clock, bus, log, lambda notice: None, stands_until_start=True)
    feed = ReplayFeed(iter(records), only.name, alone.bus.domain, stage, services, aliases, comparison.expect)
    host.configure()
    feed.begin(scheduler, host)
    while (due := scheduler.next_due()) is not None and not feed.is_past(due):
        if comparison.difference is not None and keep is None:
            break
        clock.advance_to(max(due, clock.now()))
        scheduler.advance(clock.now())
    comparison.end(feed.cut_at)
    return ReplayResult(comparison.equal, comparison.difference, tuple(errors))
