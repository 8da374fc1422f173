"""A tape: all that happens on the bus of one process on a stepped clock, in order and exactly enough to repeat it.

Besides the topics of the robot, it holds the events of services, as ROS 2 records them, and on three topics of its own
the orders that the host received, the instants whose time [s] cannot be computed from nanoseconds, and the reason of a
reply that refuses or fails, before its event, which has no room for it.
"""

import json
from collections.abc import Callable
from dataclasses import field, make_dataclass, replace
from functools import cache
from typing import Any

from rbxcompose.base.clock import NANOSECONDS, Clock
from rbxcompose.bus.local import WitnessedCall
from rbxcompose.bus.names import ADMIN, decode_attachment
from rbxcompose.bus.tokens import EndpointToken, gid, parse_token
from rbxcompose.bus.transport import Closable, RemotePublisher, Transport
from rbxcompose.msgs import registry
from rbxcompose.msgs.cdr import encode
from rbxcompose.msgs.definitions import FieldDefinition, Structure, parse_type, type_hash
from rbxcompose.msgs.service_msgs import ServiceEventInfo
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Float64, String
from rbxcompose.msgs.types import Fields, Message, Service
from rbxcompose.runtime.recording.topics import Recorded, RecordedTopic, definition_of, topic_of
from rbxcompose.sdk.ports import Qos

PLAN = "plan.json"  # name of the attachment with the plan of the robot
EVENT_TOPIC = "_service_event"  # suffix of the topic of a service's events
ORDERS = "/rbxcompose/orders"
INSTANTS = "/rbxcompose/instants"
REASONS = "/rbxcompose/reasons"


class Tape:
    """Passes events to `write`, and topics to `declare` as soon as they have a publisher."""

    def __init__(
        self, clock: Clock, declare: Callable[[RecordedTopic], None], write: Callable[[Recorded], None]
    ) -> None:
        self._clock, self._declare, self._write = clock, declare, write
        self._instant, self._stamp = 0.0, 0  # [s] and [ns], the last instant
        self._topics: dict[bytes, RecordedTopic] = {}  # by the GID of the publisher

    def around(self, transport: Transport) -> Transport:
        """Return a transport that behaves like this one and is recorded."""
        return _Taped(self, transport)

    def witness(self, call: WitnessedCall) -> None:
        """Record a request or a reply."""
        event = event_of(call.service)
        kind = ServiceEventInfo.RESPONSE_SENT if call.is_reply else ServiceEventInfo.REQUEST_SENT
        stamp = to_time(self._clock.stamp())
        info = ServiceEventInfo(event_type=kind, stamp=stamp, client_gid=call.client, sequence_number=call.sequence)
        held = () if call.message is None else (call.message,)
        message = event(info=info, response=held) if call.is_reply else event(info=info, request=held)
        if call.reason:
            self._say(REASONS, String(data=call.reason))
        self._say(f"{call.name}/{EVENT_TOPIC}", message, node=call.node, sequence=call.sequence)

    def order(self, verb: str, *words: object) -> None:
        """Record an order to the host."""
        self._say(ORDERS, String(data=json.dumps([verb, *words])))

    def announced(self, token: str) -> None:
        """Register a publisher."""
        endpoint = parse_token(token)
        topic = topic_of(endpoint) if isinstance(endpoint, EndpointToken) else None
        if isinstance(endpoint, EndpointToken) and topic is not None:
            whole = replace(topic, definition=definition_of(topic.type), node=endpoint.node.name)
            self._topics[gid(token)] = whole
            self._declare(whole)

    def published(self, payload: bytes, attachment: bytes) -> None:
        """Record a message."""
        source = decode_attachment(attachment)
        self._keep(self._topics[source.gid], source.sequence, payload)

    def _say(self, name: str, message: Message, *, node: str = "", sequence: int = 0) -> None:
        topic = RecordedTopic(name, message.TYPE, message.HASH, Qos.EVENT, definition_of(message.TYPE), node=node)
        self._keep(topic, sequence, encode(message))

    def _keep(self, topic: RecordedTopic, sequence: int, payload: bytes) -> None:
        now, stamp = self._clock.now(), self._clock.stamp()
        if now != self._instant:
            is_next_to_last = stamp == self._stamp  # two instants may have one stamp
            self._instant, self._stamp = now, stamp
            if is_next_to_last or now != stamp / NANOSECONDS:
                self._say(INSTANTS, Float64(data=now))
        self._write(Recorded(topic, stamp, stamp, sequence, payload))


class _Taped:
    """A transport that records on a tape what leaves the process, even without a subscriber outside."""

    def __init__(self, tape: Tape, inner: Transport) -> None:
        self._tape, self._inner = tape, inner
        self.session = inner.session
        self.wake, self.bring, self.close = inner.wake, inner.bring, inner.close
        self.subscribe, self.serve, self.ask, self.watch = inner.subscribe, inner.serve, inner.ask, inner.watch

    def publisher(self, key: str, qos: Qos) -> RemotePublisher:
        if key.startswith(ADMIN):  # what tools look at is not part of the robot's behaviour
            return self._inner.publisher(key, qos)
        return _TapedPublisher(self._tape, self._inner.publisher(key, qos))

    def announce(self, token: str) -> Closable:
        self._tape.announced(token)
        return self._inner.announce(token)


class _TapedPublisher:
    """A publisher that always has a subscriber: the tape."""

    has_match = True

    def __init__(self, tape: Tape, inner: RemotePublisher) -> None:
        self._tape, self._inner = tape, inner

    def put(self, payload: bytes, attachment: bytes) -> None:
        self._tape.published(payload, attachment)
        if self._inner.has_match:
            self._inner.put(payload, attachment)

    def close(self) -> None:
        self._inner.close()


def event_of(service: type[Service[Any, Any]]) -> type[Any]:
    """Return the type with the fields `info`, `request` and `response`; one of the last two holds one message."""
    named: Any = service  # for mypy, classes of a generic are not hashable
    return _event_of(named)


@cache
def _event_of(service: Any) -> type[Any]:
    name = f"{service.TYPE}_Event"
    fields = {
        "info": ServiceEventInfo.TYPE,
        "request": f"{service.Request.TYPE}[<=1]",
        "response": f"{service.Response.TYPE}[<=1]",
    }
    structures: dict[str, Structure] = {}
    _describe(name, fields, structures)
    return make_dataclass(
        name.split("/")[-1],
        [
            ("info", ServiceEventInfo, field(default_factory=ServiceEventInfo)),
            ("request", tuple[Any, ...], ()),
            ("response", tuple[Any, ...], ()),
        ],
        bases=(Message,),
        namespace={"TYPE": name, "HASH": type_hash(name, structures), "FIELDS": fields},
        frozen=True,
        slots=True,
    )


def _describe(name: str, fields: Fields, found: dict[str, Structure]) -> None:
    """Add a message and all messages inside it to `found`."""
    found[name] = Structure(name, tuple(FieldDefinition(each, parse_type(text)) for each, text in fields.items()))
    for each in found[name].fields:
        if each.type.is_message and each.type.base not in found:
            _describe(each.type.base, registry.message(each.type.base).FIELDS, found)
