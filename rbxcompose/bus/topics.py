"""Topics: messages go by reference within the process and are encoded only if another one subscribes."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from dataclasses import field
from functools import partial
from itertools import count
from typing import Any, Generic, NamedTuple, TypeVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.bus.graph import TopicReader
from rbxcompose.bus.local import Allowances, Inbox, Participant, RefusalReason, Refusals, Registry
from rbxcompose.bus.names import Attachment, AttachmentError, decode_attachment
from rbxcompose.bus.tokens import EndpointToken, EntityKind, gid, parse_token, session_of
from rbxcompose.bus.transport import Arrival, Closable
from rbxcompose.bus.wire import expects_speech, most_per_second, queue_depth, ros_qos
from rbxcompose.msgs.cdr import CdrError, CdrLengthError, CdrLimitError, decode, encode
from rbxcompose.msgs.fields import NotFiniteError, require_finite, require_type
from rbxcompose.msgs.types import Message
from rbxcompose.sdk.ports import MessageLimits, Qos, limits_of

M = TypeVar("M", bound=Message)

PATIENT_QUEUE = 50  # messages; half a second of poses at 50 Hz wakes the process once


class Delivery(NamedTuple, Generic[M]):
    """A message on its way within the process, and its origin."""

    message: M
    source: Attachment


_Received = tuple[float, Delivery[M] | Arrival, Attachment | None]  # when [s], what, and its origin if it is known


@dataclass(frozen=True, slots=True)
class Topics:
    """The publishers and subscriptions of one process."""

    publishers: Registry[Publisher[Any]] = field(default_factory=Registry)
    subscriptions: Registry[Subscription[Any]] = field(default_factory=Registry)


class Publisher(Generic[M]):
    """Publishes one message per call."""

    def __init__(self, topics: Topics, node: Participant, topic: str, message: type[M], qos: Qos) -> None:
        endpoint = node.endpoint(EntityKind.PUBLISHER, topic, message, ros_qos(qos))
        self.route, self.gid = endpoint.route, endpoint.gid
        self.kept: Delivery[M] | None = None  # the last message of a latched topic
        self._topics, self._process, self._qos, self._message = topics, node.process, qos, message
        self._sequence = count(1)
        self._remote = node.process.transport.publisher(endpoint.key, qos)
        self._token = node.announce(endpoint)
        topics.publishers.add(self.route, self)

    @property
    def has_match(self) -> bool:
        """Return whether anything in another process would receive it, now or (if latched) later."""
        return self._remote.has_match

    @property
    def is_wanted(self) -> bool:
        """Return whether anything, in this process or another, would receive it."""
        return self._remote.has_match or self._qos is Qos.LATCHED or bool(self._topics.subscriptions.at(self.route))

    def __call__(self, message: M) -> None:
        """Publish `message`.

        Raises:
            TypeError: if it has not the type of the topic.
        """
        if type(message) is not self._message:  # a call for each message would cost more than the rest
            require_type(message, self._message, self.route[0])
        number, here = next(self._sequence), self._topics.subscriptions.at(self.route)
        has_match, is_latched = self._remote.has_match, self._qos is Qos.LATCHED
        if not (here or has_match or is_latched):
            return  # nobody listens
        source = Attachment(number, self._process.clock.stamp(), self.gid)
        delivery = Delivery(message, source)
        if is_latched:
            self.kept = delivery
        for subscription in here:
            subscription.deliver(delivery)
        if has_match:
            self._remote.put(encode(message), source.encode())

    def look_again(self) -> None:
        """React to a change of the subscriptions in this process; most publishers need not."""

    def close(self) -> None:
        """Withdraw the publisher and drop its last message."""
        self._topics.publishers.remove(self.route, self)
        self._token.close()
        self._remote.close()


class Subscription(Generic[M]):
    """Passes the messages of a topic to `handler` and remembers the newest.

    It takes at most `max_rate` [Hz] from each publisher in another process; None means the limit of the QoS class.
    Messages from there beyond the `limits`, or those of the QoS class, are refused before they cost anything.
    """

    def __init__(
        self,
        topics: Topics,
        node: Participant,
        topic: str,
        message: type[M],
        qos: Qos,
        handler: Callable[[M], None],
        max_rate: float | None = None,
        *,
        limits: MessageLimits | None = None,
        waits: bool = False,
        listens: bool = True,
        is_patient: bool = False,
        is_light: bool = True,
        may_be_silent: bool = False,
    ) -> None:
        """With `waits`, hold messages until the node is open; unless it `listens`, ignore other processes.

        A light handler may run in the thread that brings a message. A patient subscription takes messages of other
        processes when half of its queue is full, or at `catch_up`: the process is not woken for each message.
        """
        endpoint = node.endpoint(EntityKind.SUBSCRIPTION, topic, message, ros_qos(qos))
        self.route, self.gid, self.owner = endpoint.route, endpoint.gid, node.owner
        self.value: M | None = None
        self.source: Attachment | None = None  # of the newest message
        self.refusals = Refusals()
        self.is_wanted: Callable[[], bool] = lambda: True  # if false, arrivals from other processes are ignored
        self._topics, self._process, self._qos = topics, node.process, qos
        self._message, self._handler, self._limits = message, handler, limits or limits_of(qos)
        self._may_be_silent = may_be_silent
        rate = max_rate or most_per_second(qos)
        self._allowances = None if rate is None or math.isinf(rate) else Allowances(rate)
        self._arrived, self._begun = -math.inf, node.process.clock.now()  # [s] of robot time
        depth = max(PATIENT_QUEUE, queue_depth(qos)) if is_patient else queue_depth(qos)
        self._patience = depth // 2 if is_patient else 1  # messages that may wait for each other
        self._has_complained = False  # in the log; diagnostics continue to count
        process = node.process
        is_lent = is_light and qos not in (Qos.LATCHED, Qos.BULK)
        self._post = process.scheduler.post_light if is_lent else process.scheduler.post
        self._bring = process.transport.bring if is_lent else process.transport.wake
        self._inbox: Inbox[_Received[M]] = Inbox(node.owner, depth, self._take, self._post)
        if waits:
            self._inbox.hold()
            node.when_open(self._inbox.go_on)
        self._key = endpoint.key
        self._remote: Closable | None = None
        if listens:
            self.listen()
        self._token = node.announce(endpoint)
        topics.subscriptions.add(self.route, self)
        self._notify_publishers()
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

    @property
    def reader(self) -> TopicReader:
        """Return what this subscription expects of publishers in other processes."""
        self.catch_up()
        type_hash = self._process.wire.hash_of(self._message)
        is_part_of_an_action = "/_" in self.route[0]  # nothing is published there until there is a goal
        speaks = expects_speech(self._qos) and not (is_part_of_an_action or self._may_be_silent)
        is_latched = self._qos is Qos.LATCHED
        return TopicReader(self.owner, self.route, type_hash, self._arrived, speaks, is_latched, self._begun)

    def listen(self) -> None:
        """Start to receive from other processes."""
        if self._remote is None:
            self._remote = self._process.transport.subscribe(self._key, self._qos, self._arrive)

    def catch_up(self) -> None:
        """Handle now the messages that a patient subscription has let wait."""
        if self._patience > 1:
            self._inbox.take_all()

    def hurry(self) -> None:
        """Stop being patient: handle each message as it arrives."""
        self._patience = 1

    def deliver(self, delivery: Delivery[M]) -> None:
        """Queue a message from this process; it is handled at the same instant."""
        self._inbox.put((self._process.clock.now(), delivery, None), self._post)

    def refuse(self, reason: RefusalReason, detail: str) -> None:
        """Count a message that is of no use; the log has the first one."""
        self.refusals.add(reason)
        if not self._has_complained:
            self._has_complained = True
            self._process.log(self.owner, f"dropped a message on {self.route[0]}: {detail}")

    def close(self) -> None:
        """Withdraw the subscription and drop its waiting messages."""
        self._topics.subscriptions.remove(self.route, self)
        self._token.close()
        if self._remote is not None:
            self._remote.close()
        self._inbox.close()
        self._notify_publishers()

    def _notify_publishers(self) -> None:
        for publisher in self._topics.publishers.at(self.route):
            publisher.look_again()

    def _arrive(self, arrival: Arrival) -> None:
        # In a thread of the transport: age is measured from here, however busy the scheduler is.
        if not self.is_wanted():
            return
        if len(arrival.payload) > self._limits.size:
            self.refusals.add(RefusalReason.TOO_LARGE)
            return
        now, source = self._process.clock.now(), None
        if self._allowances is None or (source := self._allowed(self._allowances, arrival, now)) is not None:
            self._inbox.put((now, arrival, source), self._bring, at=self._patience)

    def _allowed(self, allowances: Allowances, arrival: Arrival, now: float) -> Attachment | None:
        # Diagnostics report what is refused here: it displaces nothing and does not even wake the scheduler.
        try:
            source = decode_attachment(arrival.attachment)
        except AttachmentError:
            self.refusals.add(RefusalReason.ATTACHMENT)
            return None
        if not allowances.takes(source.gid, now):
            self.refusals.add(RefusalReason.TOO_MANY)
            return None
        return source

    def _take(self, item: _Received[M]) -> None:
        arrived, content, source = item
        delivery = content if isinstance(content, Delivery) else self._read(content, source)
        if delivery is not None:
            self._arrived, self.value, self.source = arrived, delivery.message, delivery.source
            self._handler(delivery.message)

    def _read(self, arrival: Arrival, source: Attachment | None) -> Delivery[M] | None:
        try:
            source = source or decode_attachment(arrival.attachment)
            if self._qos is Qos.LATCHED and any(
                publisher.gid == source.gid for publisher in self._topics.publishers.at(self.route)
            ):
                return None  # the history of a latched topic brings our own messages back
            message = decode(self._message, arrival.payload, self._limits.entries)
            if self._qos is Qos.COMMAND:
                require_finite(message)
        except (AttachmentError, CdrError, NotFiniteError) as error:
            self.refuse(_REASONS[type(error)], str(error))
            return None
        return Delivery(message, source)


_REASONS: dict[type[ValueError], RefusalReason] = {
    AttachmentError: RefusalReason.ATTACHMENT,
    CdrLengthError: RefusalReason.LENGTH,
    CdrLimitError: RefusalReason.TOO_LARGE,
    CdrError: RefusalReason.CONTENT,
    NotFiniteError: RefusalReason.NOT_FINITE,
}


class OrderPublisher(Publisher[M]):
    """Publishes orders for the components `servers`.

    Only these count as listeners: a recorder or a person looking on does not carry out an order.
    """

    def __init__(
        self, topics: Topics, node: Participant, topic: str, message: type[M], qos: Qos, servers: Collection[str]
    ) -> None:
        super().__init__(topics, node, topic, message, qos)
        self._servers = frozenset(servers)
        self._elsewhere: dict[str, bytes] = {}  # tokens of subscriptions in other processes, each with its GID
        self._watchers: list[Callable[[], None]] = []
        self._inbox: Inbox[Callable[[], None]] = Inbox(
            node.owner, None, lambda callback: callback(), node.process.scheduler.post
        )
        pattern = node.peers(EntityKind.SUBSCRIPTION, topic, message)
        self._tokens = node.process.transport.watch(pattern, self._token_changed)

    @property
    def listeners(self) -> frozenset[bytes]:
        """Return the GIDs of the subscriptions that would receive an order now."""
        here = {one.gid for one in self._topics.subscriptions.at(self.route) if one.owner in self._servers}
        # A token may be known before its connection can be used.
        return frozenset(here | set(self._elsewhere.values() if self.has_match else ()))

    def watch(self, changed: Callable[[], None], /) -> None:
        """Call `changed` whenever a subscriber comes or goes."""
        self._watchers.append(changed)

    def look_again(self) -> None:
        """React to a change of the subscriptions in this process."""
        self._inbox.put(self._notify, self._process.scheduler.post)

    def close(self) -> None:
        """Withdraw the publisher and stop watching."""
        super().close()
        self._tokens.close()
        self._inbox.close()

    def _token_changed(self, key: str, is_there: bool) -> None:
        # In a thread of the transport.
        token = parse_token(key)
        is_ours = session_of(key) == self._process.transport.session
        if isinstance(token, EndpointToken) and token.node.name in self._servers and not is_ours:
            self._inbox.put(partial(self._note, key, is_there), self._process.transport.wake)

    def _note(self, key: str, is_there: bool) -> None:
        if is_there:
            self._elsewhere[key] = gid(key)
        else:
            self._elsewhere.pop(key, None)
        self._notify()

    def _notify(self) -> None:
        for watcher in self._watchers:
            watcher()
