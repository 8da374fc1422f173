"""A network of processes in virtual time: a transport for each, and weather that delays, drops, doubles and cuts."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Protocol, TypeVar

from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.local import Post
from rbxcompose.bus.transport import Arrival, OnReply, Question, TransportReply
from rbxcompose.bus.zenoh_transport import GONE
from rbxcompose.sdk.ports import Qos

E = TypeVar("E")
OWNER = "network"
MAY_BE_LOST = (Qos.COMMAND, Qos.STATE, Qos.BULK)  # what a congested link drops; all else is sent again


class Weather(Protocol):
    """What becomes of what is sent."""

    def delay(self) -> float:
        """Return how long the next thing is on its way [s]."""
        ...

    def copies(self) -> int:
        """Return how often a message arrives that may be lost: 0, 1 or 2 times."""
        ...


class Calm:
    """Weather in which everything arrives at once."""

    def delay(self) -> float:
        return 0.0

    def copies(self) -> int:
        return 1


@dataclass(frozen=True, slots=True)
class Sample:
    """Bytes on their way."""

    payload: bytes
    attachment: bytes


@cache
def _matcher(pattern: str) -> re.Pattern[str]:
    """Return what a key expression matches: `*` is one chunk, `**` any number of them."""
    text = re.escape(pattern).replace(r"/\*\*", "(/.*)?").replace(r"\*", "[^/]*")
    return re.compile(text)


class Network:
    """All transports, and the links between them. Between two of them what must not be lost keeps its order."""

    def __init__(self, scheduler: Scheduler, weather: Weather) -> None:
        self.weather = weather
        self.lost = self.doubled = 0
        self._scheduler = scheduler
        self._members: dict[str, SimulatedTransport] = {}
        self._busy_until: dict[tuple[str, str], float] = {}
        self._cuts: dict[frozenset[str], int] = {}

    def join(self, session: str, post: Post) -> SimulatedTransport:
        """Return the transport of a new process."""
        made = self._members[session] = SimulatedTransport(self, session, post)
        return made

    def leave(self, session: str) -> None:
        """Take a process out; the others see its tokens go, and nothing of it is on its way to be served."""
        gone = self._members.pop(session, None)
        if gone is None:
            return
        gone.is_there = False
        for other in list(self._members.values()):
            self._part(gone, other)

    def cut(self, text: str, other: str, seconds: float) -> None:
        """Let two processes not reach each other for a while; each takes the other for gone."""
        pair, (near, far) = frozenset((text, other)), (self._members.get(text), self._members.get(other))
        if near is None or far is None or text == other:
            return
        self._cuts[pair] = self._cuts.get(pair, 0) + 1
        if self._cuts[pair] == 1:
            self._part(near, far)
            self._part(far, near)
        self._scheduler.at(self._scheduler.now + seconds, OWNER, lambda: self._mend(pair))

    def others(self, session: str) -> list[SimulatedTransport]:
        """Return whom a process reaches."""
        return [member for name, member in self._members.items() if name != session and self._is_whole(session, name)]

    def carry(self, source: str, sink: str, arrive: Callable[[], None], *, may_be_lost: bool = False) -> None:
        """Bring something from one process to another, as the weather has it."""
        copies = self.weather.copies() if may_be_lost else 1
        self.lost, self.doubled = self.lost + (copies == 0), self.doubled + (copies > 1)
        for _ in range(copies):
            due = self._scheduler.now + self.weather.delay()
            if not may_be_lost:
                due = max(due, self._busy_until.get((source, sink), 0.0))
                self._busy_until[source, sink] = due
            self._scheduler.at(due, OWNER, lambda: self._arrive(source, sink, arrive, may_be_lost=may_be_lost))

    def _arrive(self, source: str, sink: str, arrive: Callable[[], None], *, may_be_lost: bool) -> None:
        if sink in self._members and not (may_be_lost and not self._is_whole(source, sink)):
            arrive()

    def _is_whole(self, text: str, other: str) -> bool:
        return frozenset((text, other)) not in self._cuts

    def _mend(self, pair: frozenset[str]) -> None:
        self._cuts[pair] -= 1
        if self._cuts[pair]:
            return
        del self._cuts[pair]
        found = [self._members[name] for name in sorted(pair) if name in self._members]
        if len(found) == 2:
            self._meet(*found)
            self._meet(*reversed(found))

    def _meet(self, known: SimulatedTransport, other: SimulatedTransport) -> None:
        """Let `other` see the tokens of `known` again, and hear what that has kept."""
        for token in known.tokens:
            other.see(known.session, token, is_there=True)
        for publisher in known.publishers:
            for subscription in other.listening(publisher.key):
                publisher.repeat(subscription)

    def _part(self, gone: SimulatedTransport, other: SimulatedTransport) -> None:
        """Let `other` see that the tokens of `gone` have gone, and give up what it has asked there."""
        for token in gone.tokens:
            other.see(gone.session, token, is_there=False)
        for asked in [one for one in other.asked if gone.session in one.servers]:
            asked.lose(gone.session)


@dataclass(eq=False)
class _Publisher:
    transport: SimulatedTransport
    key: str
    qos: Qos
    kept: Sample | None = None

    @property
    def has_match(self) -> bool:
        return self.qos is Qos.LATCHED or any(peer.listening(self.key) for peer in self.transport.peers)

    def put(self, payload: bytes, attachment: bytes) -> None:
        sample = Sample(payload, attachment)
        self.kept = sample if self.qos is Qos.LATCHED else None
        for peer in self.transport.peers:
            for subscription in peer.listening(self.key):
                self._send(subscription, sample)

    def repeat(self, listener: _Subscription) -> None:
        """Send to one listener what is kept, if anything is."""
        if self.kept is not None:
            self._send(listener, self.kept)

    def _send(self, listener: _Subscription, sample: Sample) -> None:
        self.transport.send(listener.transport, lambda: listener.hear(sample), may_be_lost=self.qos in MAY_BE_LOST)

    def close(self) -> None:
        self.transport.forget(self.transport.publishers, self)


@dataclass(eq=False)
class _Subscription:
    transport: SimulatedTransport
    key: str
    arrived: Callable[[Arrival], None]
    is_open: bool = True

    def hear(self, sample: Sample) -> None:
        if self.is_open:
            self.arrived(sample)

    def close(self) -> None:
        self.is_open = False
        self.transport.forget(self.transport.subscriptions, self)


@dataclass(eq=False)
class _Server:
    transport: SimulatedTransport
    key: str
    asked: Callable[[Question], None]

    def close(self) -> None:
        self.transport.forget(self.transport.servers, self)


@dataclass(eq=False)
class _Token:
    transport: SimulatedTransport
    text: str

    def close(self) -> None:
        if self.text in self.transport.tokens:
            self.transport.tokens.remove(self.text)
            for peer in self.transport.peers:
                peer.see(self.transport.session, self.text, is_there=False)


@dataclass(eq=False)
class _Watch:
    transport: SimulatedTransport
    pattern: str
    changed: Callable[[str, bool], None]

    def close(self) -> None:
        self.transport.forget(self.transport.watches, self)


@dataclass(eq=False)
class _Asked:
    """A request that waits for those that serve it."""

    transport: SimulatedTransport
    answered: OnReply
    servers: list[str] = field(default_factory=list)  # sessions that have not answered

    def take(self, session: str, answer: TransportReply) -> None:
        if session in self.servers and self in self.transport.asked:
            self.servers.remove(session)
            self.answered(answer)
            self._look()

    def lose(self, session: str) -> None:
        self.servers = [server for server in self.servers if server != session]
        self._look()

    def close(self) -> None:
        self.transport.forget(self.transport.asked, self)

    def _look(self) -> None:
        if not self.servers and self in self.transport.asked:  # as Zenoh does: the end of all answers is told, too
            self.close()
            self.answered(TransportReply(error=GONE))


@dataclass(frozen=True, slots=True)
class _Question:
    """A request as it is served; the answer goes back over the same link."""

    server: SimulatedTransport
    asked: _Asked
    payload: bytes
    attachment: bytes

    def reply(self, payload: bytes, attachment: bytes, reason: str = "") -> None:
        self._send(TransportReply(payload, reason=reason))

    def fail(self, error: str) -> None:
        self._send(TransportReply(error=error))

    def _send(self, answer: TransportReply) -> None:
        session = self.server.session
        self.server.send(self.asked.transport, lambda: self.asked.take(session, answer))


class SimulatedTransport:
    """What one process has declared."""

    def __init__(self, network: Network, session: str, post: Post) -> None:
        self.session = session
        self.is_there = True
        self.publishers: list[_Publisher] = []
        self.subscriptions: list[_Subscription] = []
        self.servers: list[_Server] = []
        self.watches: list[_Watch] = []
        self.tokens: list[str] = []
        self.asked: list[_Asked] = []
        self._network, self._post = network, post

    @property
    def peers(self) -> list[SimulatedTransport]:
        """Return whom this process reaches."""
        return self._network.others(self.session) if self.is_there else []

    def listening(self, key: str) -> list[_Subscription]:
        """Return the subscriptions to a key."""
        return [subscription for subscription in self.subscriptions if subscription.key == key]

    def send(self, sink: SimulatedTransport, arrive: Callable[[], None], *, may_be_lost: bool = False) -> None:
        """Bring something to another process."""
        if self.is_there:
            self._network.carry(self.session, sink.session, arrive, may_be_lost=may_be_lost)

    def see(self, session: str, token: str, *, is_there: bool) -> None:
        """Have a token of another process come or go."""
        for watch in self.watches:
            if _matcher(watch.pattern).fullmatch(token):
                self._network.carry(session, self.session, lambda watch=watch: self._tell(watch, token, is_there))  # type: ignore[misc]

    def _tell(self, watch: _Watch, token: str, is_there: bool) -> None:
        if watch in self.watches:
            watch.changed(token, is_there)

    def forget(self, ends: list[E], end: E) -> None:
        """Take an end out of its list, if it is there."""
        if end in ends:
            ends.remove(end)

    # The transport as the bus knows it

    def wake(self, owner: str, callback: Callable[[], None]) -> None:
        self._post(owner, callback)

    bring = wake

    def publisher(self, key: str, qos: Qos) -> _Publisher:
        self.publishers.append(_Publisher(self, key, qos))
        return self.publishers[-1]

    def subscribe(self, key: str, qos: Qos, arrived: Callable[[Arrival], None]) -> _Subscription:
        made = _Subscription(self, key, arrived)
        self.subscriptions.append(made)
        if qos is Qos.LATCHED:
            for peer in self.peers:
                for publisher in peer.publishers:
                    if publisher.key == key:
                        publisher.repeat(made)
        return made

    def serve(self, key: str, asked: Callable[[Question], None]) -> _Server:
        self.servers.append(_Server(self, key, asked))
        return self.servers[-1]

    def ask(
        self, key: str, payload: bytes, attachment: bytes, answered: OnReply, *, of_all: bool, within: float
    ) -> _Asked:
        asked = _Asked(self, answered)
        self.asked.append(asked)
        for peer in self.peers:
            for server in [one for one in peer.servers if one.key == key]:
                asked.servers.append(peer.session)
                question = _Question(peer, asked, payload, attachment)
                self.send(peer, lambda one=server, question=question: one.asked(question))  # type: ignore[misc]
        if not asked.servers:
            asked.servers.append(self.session)
            self._post("", lambda: asked.lose(self.session))
        return asked

    def announce(self, token: str) -> _Token:
        self.tokens.append(token)
        for peer in self.peers:
            peer.see(self.session, token, is_there=True)
        return _Token(self, token)

    def watch(self, pattern: str, changed: Callable[[str, bool], None]) -> _Watch:
        made = _Watch(self, pattern, changed)
        self.watches.append(made)
        for peer in self.peers:
            for token in peer.tokens:
                if _matcher(pattern).fullmatch(token):
                    send = lambda token=token: self._tell(made, token, True)  # noqa: E731
                    peer.send(self, send)
        return made

    def close(self) -> None:
        self._network.leave(self.session)
