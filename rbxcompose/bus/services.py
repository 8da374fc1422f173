"""Services: requests go by reference within the process and over the transport to others; answers may come later.

Windows show state of a component to tools outside, at a key of the robot's own rather than a ROS 2 topic. A subscriber
at the key receives updates, a query there returns the whole state. Both are JSON of one shape (`SCHEMA`): `source`
names the window, `sequence` counts the updates from one, so that a subscriber notices what it missed, and `value` is
the component's data. A whole state has the sequence of the last update that it contains. `missions/view/replica.py` is
the other side.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import field
from functools import partial
from itertools import count
from typing import Any, Generic, TypeVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import Refused
from rbxcompose.base.scheduler import ScheduledCallback
from rbxcompose.bus.local import QUESTIONS, REQUESTS, Gate, Inbox, Participant, Registry, Witness, WitnessedCall
from rbxcompose.bus.names import Attachment, decode_attachment
from rbxcompose.bus.tokens import EntityKind, gid, session_of
from rbxcompose.bus.transport import LONGEST_WAIT, Closable, Question, TransportReply
from rbxcompose.bus.wire import SERVICE_QOS
from rbxcompose.msgs.cdr import CdrLimitError, decode, encode
from rbxcompose.msgs.fields import require_type
from rbxcompose.msgs.types import Message, Service
from rbxcompose.sdk.bound import Reply
from rbxcompose.sdk.ports import ORDINARY, MessageLimits, Qos

Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)

LONGEST_QUEUE = 100  # requests that wait for a server
LOST = "the server is gone"


WhenAnswered = Callable[[Reply[R]], None]


@dataclass(frozen=True, slots=True)
class Services:
    """The servers and clients of one process."""

    servers: Registry[Server[Any, Any]] = field(default_factory=Registry)
    clients: Registry[Client[Any, Any]] = field(default_factory=Registry)
    witness: Witness | None = None


class ServedRequest(Generic[Q, R]):
    """A request as its server sees it, to be answered once, now or later."""

    def __init__(self, message: Q, client: bytes, sequence: int, answer: WhenAnswered[R]) -> None:
        self.message = message
        self.client = client  # GID
        self.sequence = sequence  # among the requests of its client
        self.witness: WhenAnswered[R] | None = None  # receives the answer first
        self.require: Callable[[R], None] = lambda response: None  # raises TypeError for what its server may not answer
        self._answer: WhenAnswered[R] | None = answer

    @property
    def is_open(self) -> bool:
        """Return whether it is still unanswered."""
        return self._answer is not None

    def reply(self, response: R, reason: str = "") -> None:
        """Answer the request, with the `reason` if the response refuses it.

        Raises:
            TypeError: if `response` has not the type of the service.
        """
        self.require(response)
        self._end(Reply(response, reason))

    def fail(self, error: str) -> None:
        """Report that there will be no answer, and why."""
        self._end(Reply(None, error))

    def _end(self, reply: Reply[R]) -> None:
        if self._answer is not None:
            answer, self._answer = self._answer, None
            if self.witness is not None:
                self.witness(reply)
            answer(reply)


class Server(Generic[Q, R]):
    """Answers requests by `handle`, and calls `client_left` with the GID of each client that is gone."""

    def __init__(
        self,
        services: Services,
        node: Participant,
        name: str,
        service: type[Service[Q, R]],
        handle: Callable[[ServedRequest[Q, R]], None],
        client_left: Callable[[bytes], None] | None = None,
        *,
        waits: bool = False,
        rate: float = REQUESTS,
        limits: MessageLimits = ORDINARY,
    ) -> None:
        """With `waits`, hold requests until the node is open; take at most `rate` [Hz] from each client elsewhere.

        Requests from there beyond the `limits` are refused.
        """
        self._limits = limits
        endpoint = node.endpoint(EntityKind.SERVER, name, service, SERVICE_QOS)
        self.route = endpoint.route
        self.malformed = 0  # requests that could not be read
        self._services, self._process, self._owner, self._service = services, node.process, node.owner, service
        self._handle = handle
        self._require: Callable[[R], None] = partial(require_type, wanted=service.Response, name=self.route[0])
        self._open: list[ServedRequest[Q, R]] = []
        post, transport = self._process.scheduler.post, self._process.transport
        self._inbox: Inbox[ServedRequest[Q, R] | Question] = Inbox(node.owner, LONGEST_QUEUE, self._take, post)
        self._left: Inbox[bytes] = Inbox(node.owner, None, client_left or (lambda client: None), post)
        if waits:
            self._inbox.hold()
            node.when_open(self._inbox.go_on)
        gate = Gate(node, endpoint.route[0], rate, lambda asked: self._inbox.put(asked, transport.wake))
        self._declared: list[Closable] = [gate, transport.serve(endpoint.key, gate)]
        if client_left is not None:
            clients = node.peers(EntityKind.CLIENT, name, service)
            self._declared.append(transport.watch(clients, self._client_changed))
        self._declared.append(node.announce(endpoint))  # last: a client that sees it may send a request
        services.servers.add(self.route, self)
        self._notify_clients()

    def ask(self, request: ServedRequest[Q, R]) -> None:
        """Queue a request from this process; it is handled at the same instant."""
        self._inbox.put(request, self._process.scheduler.post)

    def leave(self, client: bytes) -> None:
        """Handle the departure of a client in this process."""
        self._left.put(client, self._process.scheduler.post)

    def close(self) -> None:
        """Withdraw the server; clients that wait for an answer learn that it is gone."""
        self._services.servers.remove(self.route, self)
        while self._declared:
            self._declared.pop().close()
        self._left.close()
        for waiting in (*self._open, *self._inbox.close()):
            waiting.fail(LOST)
        self._notify_clients()

    def _notify_clients(self) -> None:
        for client in self._services.clients.at(self.route):
            client.look_again()

    def _client_changed(self, token: str, is_there: bool) -> None:
        transport = self._process.transport
        if not is_there and session_of(token) != transport.session:
            self._left.put(gid(token), transport.wake)

    def _take(self, item: ServedRequest[Q, R] | Question) -> None:
        request = item if isinstance(item, ServedRequest) else self._read(item)
        if request is not None:
            self._open = [earlier for earlier in self._open if earlier.is_open]
            self._open.append(request)
            request.require = self._require
            if self._services.witness is not None:
                request.witness = partial(self._report, self._services.witness, request)
            try:
                self._handle(request)
            except Refused as refusal:
                request.fail(str(refusal))
            except (Exception, SystemExit) as error:
                request.fail(f"{type(error).__name__}: {error}")
                raise

    def _read(self, question: Question) -> ServedRequest[Q, R] | None:
        try:
            asker = decode_attachment(question.attachment)
            if len(question.payload) > self._limits.size:
                raise CdrLimitError(f"{len(question.payload)} bytes, at most {self._limits.size} are taken")
            message = decode(self._service.Request, question.payload, self._limits.entries)
            return ServedRequest(message, asker.gid, asker.sequence, partial(self._answer, question, asker))
        except ValueError as error:
            question.fail(f"malformed request: {error}")
            self.malformed += 1
            if self.malformed == 1:
                self._process.log(self._owner, f"dropped a request to {self.route[0]}: {error}")
            return None

    def _report(self, witness: Witness, request: ServedRequest[Q, R], reply: Reply[R]) -> None:
        sent = (request.client, request.sequence, True, reply.response, reply.error)
        witness(WitnessedCall(self._owner, self.route[0], self._service, *sent))

    def _answer(self, question: Question, asker: Attachment, reply: Reply[R]) -> None:
        if reply.response is None:
            question.fail(reply.error)
        else:
            # By the client's sequence number and GID, ROS matches the reply with its request.
            attachment = asker._replace(stamp=self._process.clock.stamp()).encode()
            question.reply(encode(reply.response), attachment, reply.error)


@dataclass(slots=True)
class _Waiting(Generic[R]):
    """A request that was sent and is still unanswered."""

    then: WhenAnswered[R]
    servers: frozenset[str] = frozenset()  # tokens of the servers in other processes that received it
    timer: ScheduledCallback | None = None
    remote: Closable | None = None

    def forget(self) -> None:
        if self.timer is not None:
            self.timer.cancel()
        if self.remote is not None:
            self.remote.close()


class Client(Generic[Q, R]):
    """Calls a service. It prefers a server in the same process; the scheduler delivers replies."""

    def __init__(self, services: Services, node: Participant, name: str, service: type[Service[Q, R]]) -> None:
        endpoint = node.endpoint(EntityKind.CLIENT, name, service, SERVICE_QOS)
        self.route, self.gid = endpoint.route, endpoint.gid
        self._services, self._process, self._owner = services, node.process, node.owner
        self._key, self._service = endpoint.key, service
        self._sequence = count(1)
        self._waiting: dict[int, _Waiting[R]] = {}
        self._servers: set[str] = set()  # tokens of servers in other processes
        self._watchers: list[Callable[[bool], None]] = []
        self._inbox: Inbox[Callable[[], None]] = Inbox(
            node.owner, None, lambda callback: callback(), self._process.scheduler.post
        )
        self._tokens = self._process.transport.watch(node.peers(EntityKind.SERVER, name, service), self._server_changed)
        self._token = node.announce(endpoint)
        services.clients.add(self.route, self)
        self._was_available = self.is_available

    @property
    def is_available(self) -> bool:
        """Return whether a server is known."""
        return bool(self._services.servers.at(self.route) or self._servers)

    def watch(self, changed: Callable[[bool], None]) -> None:
        """Call `changed` whenever a server appears, and when the last one is gone."""
        self._watchers.append(changed)

    def __call__(self, request: Q, then: WhenAnswered[R], /, *, timeout: float = 5.0) -> None:
        """Send `request`; `then` receives the reply, or an error after `timeout` [s] or if there is no server.

        Raises:
            TypeError: if `request` has not the type of the service.
        """
        require_type(request, self._service.Request, self.route[0])
        sequence = next(self._sequence)
        waiting = self._waiting[sequence] = _Waiting(then, frozenset(self._servers))
        if math.isfinite(timeout):
            late = partial(self._end, sequence, Reply(None, f"no reply within {timeout:g} s"))
            waiting.timer = self._process.scheduler.at(self._process.scheduler.now + timeout, self._owner, late)
        if self._services.witness is not None:
            self._services.witness(
                WitnessedCall(self._owner, self.route[0], self._service, self.gid, sequence, False, request)
            )
        if local := self._services.servers.at(self.route):
            waiting.servers = frozenset()
            local[0].ask(ServedRequest(request, self.gid, sequence, partial(self._answered, sequence)))
        elif self._servers:
            source = Attachment(sequence, self._process.clock.stamp(), self.gid)
            replied = partial(self._answered_from_afar, sequence)
            waiting.remote = self._process.transport.ask(
                self._key, encode(request), source.encode(), replied, of_all=True, within=LONGEST_WAIT
            )
        else:
            self._answered(sequence, Reply(None, f"no server of {self.route[0]} is known"))

    def look_again(self) -> None:
        """React to a change of the servers in this process."""
        self._inbox.put(self._look, self._process.scheduler.post)

    def close(self) -> None:
        """Withdraw the client and forget its requests; servers learn that it is gone."""
        self._services.clients.remove(self.route, self)
        self._token.close()
        self._tokens.close()
        self._inbox.close()
        while self._waiting:
            self._waiting.popitem()[1].forget()
        for server in self._services.servers.at(self.route):
            server.leave(self.gid)

    def _answered(self, sequence: int, reply: Reply[R]) -> None:
        self._inbox.put(partial(self._end, sequence, reply), self._process.scheduler.post)

    def _answered_from_afar(self, sequence: int, answer: TransportReply) -> None:
        self._inbox.put(partial(self._read, sequence, answer), self._process.transport.wake)

    def _server_changed(self, token: str, is_there: bool) -> None:
        transport = self._process.transport
        if session_of(token) != transport.session:
            self._inbox.put(partial(self._note, token, is_there), transport.wake)

    def _note(self, token: str, is_there: bool) -> None:
        if is_there:
            self._servers.add(token)
        else:
            self._servers.discard(token)
            for sequence, waiting in list(self._waiting.items()):
                if token in waiting.servers:
                    self._end(sequence, Reply(None, LOST))
        self._look()

    def _look(self) -> None:
        if self._was_available != self.is_available:
            self._was_available = self.is_available
            for watcher in self._watchers:
                watcher(self._was_available)

    def _read(self, sequence: int, answer: TransportReply) -> None:
        if answer.error:
            self._end(sequence, Reply(None, answer.error))
            return
        try:
            self._end(sequence, Reply(decode(self._service.Response, answer.payload), answer.reason))
        except ValueError as error:
            self._end(sequence, Reply(None, f"malformed reply: {error}"))

    def _end(self, sequence: int, reply: Reply[R]) -> None:
        waiting = self._waiting.pop(sequence, None)
        if waiting is not None:
            waiting.forget()
            waiting.then(reply)


SCHEMA = 1
GRACE = 2.0  # [s] after a query in which somebody counts as listening: the transport may report a listener late


class Window:
    """Sends updates to subscribers; `answer` returns the whole state as data for JSON, or raises Refused."""

    def __init__(self, node: Participant, key: str, answer: Callable[[], object]) -> None:
        process, transport = node.process, node.process.transport
        self._source = f"{transport.session}/{next(process.ids)}"
        self._clock, self._answer = process.clock, answer
        self._sequence = 0
        self._asked_at: float | None = None  # [s]
        self._remote = transport.publisher(key, Qos.STATE)  # a slow viewer must not hold us up
        inbox: Inbox[Question] = Inbox(node.owner, None, self._asked, process.scheduler.post)
        gate = Gate(node, key, QUESTIONS, lambda question: inbox.put(question, transport.wake))
        self._declared: list[Closable] = [gate, transport.serve(key, gate), self._remote]

    @property
    def is_watched(self) -> bool:
        """Return whether anybody would receive updates."""
        if self._remote.has_match:
            return True
        return self._asked_at is not None and self._clock.now() - self._asked_at <= GRACE

    def put(self, value: object) -> None:
        """Send an update, as data for JSON."""
        self._sequence += 1
        self._remote.put(self._message(value), b"")

    def close(self) -> None:
        """Withdraw the window."""
        for closable in self._declared:
            closable.close()

    def _asked(self, question: Question) -> None:
        self._asked_at = self._clock.now()
        try:
            message = self._message(self._answer())
        except Refused as refusal:
            question.fail(str(refusal))
        except (Exception, SystemExit) as error:
            question.fail(f"{type(error).__name__}: {error}")
            raise
        else:
            question.reply(message, b"")

    def _message(self, value: object) -> bytes:
        message = {"schema": SCHEMA, "source": self._source, "sequence": self._sequence, "value": value}
        return json.dumps(message).encode()
