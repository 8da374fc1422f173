"""The bus for `record` and `replay`: one more participant, which sends and receives bytes without decoding."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from itertools import count

from rbxcompose.bus.attachment import Attachment, decode_attachment
from rbxcompose.bus.classes import ros_qos
from rbxcompose.bus.names import data_key, dds_type
from rbxcompose.bus.tokens import SPACE, EndpointToken, EntityKind, NodeToken, gid, parse_token
from rbxcompose.bus.transport import Arrival, RemotePublisher
from rbxcompose.bus.wire import WIRE_PROFILES
from rbxcompose.cli.bus.guest import Guest
from rbxcompose.recording.definitions import definition_of
from rbxcompose.recording.message import Recorded
from rbxcompose.recording.topics import RecordedTopic, Selection, topic_of

MOST_WAITING = 20_000  # messages that arrived and are not yet written
MOST_TOPICS = 2_000
_MATCHING = 1.0  # [s] maximum wait until subscribers have found a new publisher
_PAUSE = 0.01  # [s] between two checks for them


class Tap:
    """Receives the messages of all selected topics, including those that appear while it runs."""

    def __init__(self, guest: Guest, wanted: Selection) -> None:
        self._guest, self._wanted = guest, wanted
        self._tokens: deque[str] = deque(maxlen=MOST_WAITING)
        self._waiting: deque[Callable[[], Recorded]] = deque(maxlen=MOST_WAITING)
        self._arrivals = count(1)
        self._arrived = self._taken = 0
        self._keys: set[str] = set()
        guest.transport.watch(f"{SPACE}/{guest.domain}/**", self._noticed)

    @property
    def lost(self) -> int:
        """Return how many messages had to make room for newer ones."""
        return max(0, self._arrived - self._taken - len(self._waiting))

    def take(self) -> Iterator[Recorded]:
        """Yield the messages that have arrived, and subscribe to new topics."""
        while self._tokens:
            self._subscribe(self._tokens.popleft())
        for _ in range(len(self._waiting)):
            self._taken += 1
            yield self._waiting.popleft()()

    def _noticed(self, token: str, is_there: bool) -> None:
        if is_there:
            self._tokens.append(token)

    def _subscribe(self, key: str) -> None:
        token = parse_token(key)
        topic = topic_of(token) if isinstance(token, EndpointToken) else None
        if topic is None or not self._wanted.takes(topic) or len(self._keys) >= MOST_TOPICS:
            return
        data = data_key(self._guest.domain, topic.name, topic.type, topic.hash)
        if data in self._keys:
            return
        self._keys.add(data)
        whole = replace(topic, definition=definition_of(topic.type))
        self._guest.transport.subscribe(data, topic.qos, lambda arrival: self._arrive(whole, arrival))

    def _arrive(self, topic: RecordedTopic, arrival: Arrival) -> None:
        stamp = self._guest.clock.stamp()
        self._waiting.append(lambda: _recorded(topic, stamp, arrival))
        self._arrived = next(self._arrivals)


def _recorded(topic: RecordedTopic, stamp: int, arrival: Arrival) -> Recorded:
    try:
        sequence, published, _ = decode_attachment(arrival.attachment)
    except ValueError:
        sequence, published = 0, stamp  # it comes from no ROS participant: only its time of arrival is known
    return Recorded(topic, stamp, max(0, published), max(0, sequence), arrival.payload)


class Player:
    """Publishes recorded messages as the node `replay`, below a namespace (`/old`) if there is one."""

    def __init__(self, guest: Guest, topics: Iterable[RecordedTopic], namespace: str = "") -> None:
        self._guest = guest
        self._sequence = count(1)
        transport, domain = guest.transport, guest.domain
        node = NodeToken(domain, transport.session, 0, "replay")
        transport.announce(node.key)
        self._publishers: dict[RecordedTopic, tuple[RemotePublisher, bytes]] = {}
        for number, topic in enumerate(topics, 1):
            qos = WIRE_PROFILES["jazzy"].qos_text(ros_qos(topic.qos))
            name = f"{namespace}{topic.name}"
            place = (EntityKind.PUBLISHER, number, name, dds_type(topic.type), topic.hash, qos)
            token = node.endpoint_key(*place)
            publisher = transport.publisher(data_key(domain, name, topic.type, topic.hash), topic.qos)
            transport.announce(token)
            self._publishers[topic] = publisher, gid(token)

    def wait_for_subscribers(self) -> None:
        """Wait until each topic has a subscriber, but only briefly: many will never have one."""
        publishers = [one for one, _ in self._publishers.values()]
        deadline = self._guest.clock.now() + _MATCHING
        while not all(one.has_match for one in publishers) and self._guest.clock.now() < deadline:
            if self._guest.run(lambda: self._guest.is_interrupted, _PAUSE):
                return

    def put(self, message: Recorded) -> None:
        """Publish a message again."""
        publisher, sender = self._publishers[message.topic]
        publisher.put(message.payload, Attachment(next(self._sequence), self._guest.clock.stamp(), sender).encode())
