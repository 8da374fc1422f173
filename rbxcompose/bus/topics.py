"""Topics: by reference to subscribers in the process, encoded only if there are others."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count
from typing import Any, Generic, TypeVar

from rbxcompose.bus.attachment import Attachment, decode_attachment
from rbxcompose.bus.classes import queue_depth, ros_qos
from rbxcompose.bus.inbox import Inbox
from rbxcompose.bus.local import Node, Registry
from rbxcompose.bus.tokens import EntityKind
from rbxcompose.bus.transport import Arrival
from rbxcompose.msgs.cdr import decode, encode
from rbxcompose.msgs.types import Message
from rbxcompose.qos import Qos

M = TypeVar("M", bound=Message)


@dataclass(frozen=True, slots=True)
class Delivery(Generic[M]):
    """A message on its way within the process, and where it comes from."""

    message: M
    source: Attachment


@dataclass(frozen=True, slots=True)
class Topics:
    """The publishers and subscriptions of one process."""

    publishers: Registry[Publisher[Any]] = field(default_factory=Registry)
    subscriptions: Registry[Subscription[Any]] = field(default_factory=Registry)

    def published_here(self, subscription: Subscription[Any], source: Attachment) -> bool:
        """Tell whether a message comes from a publisher of this very process."""
        return any(publisher.gid == source.gid for publisher in self.publishers.at(subscription.route))


class Publisher(Generic[M]):
    """Publishes one message per call."""

    def __init__(self, topics: Topics, node: Node, topic: str, message: type[M], qos: Qos) -> None:
        endpoint = node.endpoint(EntityKind.PUBLISHER, topic, message, ros_qos(qos))
        self.route, self.gid = endpoint.route, endpoint.gid
        self.kept: Delivery[M] | None = None  # the last message of a latched topic
        self._topics, self._process, self._qos = topics, node.process, qos
        self._sequence = count(1)
        self._remote = node.process.transport.publisher(endpoint.key, qos)
        self._token = node.announce(endpoint)
        topics.publishers.add(self.route, self)

    @property
    def has_match(self) -> bool:
        """Tell whether somebody in another process would receive it, now or (if latched) later."""
        return self._remote.has_match

    def __call__(self, message: M) -> None:
        """Publish `message`."""
        process = self._process
        source = Attachment(next(self._sequence), process.clock.stamp(), self.gid)
        delivery = Delivery(message, source)
        if self._qos is Qos.LATCHED:
            self.kept = delivery
        for subscription in self._topics.subscriptions.at(self.route):
            subscription.deliver(delivery)
        if self._remote.has_match:
            self._remote.put(encode(message), source.encode())

    def close(self) -> None:
        """Withdraw the publisher and what it kept."""
        self._topics.publishers.remove(self.route, self)
        self._token.close()
        self._remote.close()


class Subscription(Generic[M]):
    """Hands the messages of a topic to `handler` and remembers the newest."""

    def __init__(
        self, topics: Topics, node: Node, topic: str, message: type[M], qos: Qos, handler: Callable[[M], None]
    ) -> None:
        endpoint = node.endpoint(EntityKind.SUBSCRIPTION, topic, message, ros_qos(qos))
        self.route = endpoint.route
        self.value: M | None = None
        self.source: Attachment | None = None  # of the newest message
        self.malformed = 0  # messages that could not be read
        self._topics, self._process, self._owner = topics, node.process, node.owner
        self._message, self._handler = message, handler
        self._arrived = -math.inf  # [s] of robot time
        self._inbox: Inbox[tuple[float, Delivery[M] | Arrival]] = Inbox(
            node.owner, queue_depth(qos), self._take, node.process.scheduler.post
        )
        self._remote = node.process.transport.subscribe(endpoint.key, qos, self._arrive)
        self._token = node.announce(endpoint)
        topics.subscriptions.add(self.route, self)
        if qos is Qos.LATCHED:
            for publisher in topics.publishers.at(self.route):
                if publisher.kept is not None:
                    self.deliver(publisher.kept)

    @property
    def age(self) -> float:
        """Return the time since the newest message arrived [s], infinite before the first."""
        return self._process.clock.now() - self._arrived

    @property
    def dropped(self) -> int:
        """Return how many messages were replaced by newer ones before they were handled."""
        return self._inbox.dropped

    def deliver(self, delivery: Delivery[M]) -> None:
        """Queue a message of this process; it is handled at the same instant."""
        self._inbox.put((self._process.clock.now(), delivery), self._process.scheduler.post)

    def close(self) -> None:
        """Withdraw the subscription; messages that wait are forgotten."""
        self._topics.subscriptions.remove(self.route, self)
        self._token.close()
        self._remote.close()
        self._inbox.close()

    def _arrive(self, arrival: Arrival) -> None:
        # In a thread of the transport: the age counts from here, however busy the scheduler is.
        self._inbox.put((self._process.clock.now(), arrival), self._process.transport.wake)

    def _take(self, item: tuple[float, Delivery[M] | Arrival]) -> None:
        arrived, content = item
        delivery = content if isinstance(content, Delivery) else self._read(content)
        if delivery is not None:
            self._arrived, self.value, self.source = arrived, delivery.message, delivery.source
            self._handler(delivery.message)

    def _read(self, arrival: Arrival) -> Delivery[M] | None:
        try:
            source = decode_attachment(arrival.attachment)
            if self._topics.published_here(self, source):
                return None  # the history of a latched topic brings our own messages back
            return Delivery(decode(self._message, arrival.payload), source)
        except ValueError as error:
            self.malformed += 1
            if self.malformed == 1:
                self._process.log(self._owner, f"dropped a message on {self.route[0]}: {error}")
            return None
