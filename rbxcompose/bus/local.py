"""State shared by the ends of one process, and the gates through which messages come in."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import field
from enum import StrEnum
from itertools import chain, count
from typing import Any, Generic, TypeVar

from rbxcompose.base.clock import Clock
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.names import AttachmentError, data_key, dds_type, decode_attachment, resolve
from rbxcompose.bus.tokens import EntityKind, NodeToken, endpoint_pattern, gid
from rbxcompose.bus.transport import Closable, Question, Transport
from rbxcompose.bus.wire import RosQos, WireProfile
from rbxcompose.msgs.types import Interface, Message, Service

BURST = 0.1  # [s]; what may come in this time may also come all at once
MOST_SOURCES = 16  # sources with an allowance of their own
QUIET = 1.0  # [s] of silence after which a source makes room for another one


class Allowance:
    """A token bucket: at most `rate` messages a second [Hz] in the long run."""

    def __init__(self, rate: float, burst: float = BURST) -> None:
        self.rate = rate
        self._most = max(1.0, rate * burst)
        self._left = self._most
        self._filled = -math.inf

    def is_quiet(self, now: float) -> bool:
        """Return whether nothing has come for a while."""
        return now - self._filled > QUIET

    def takes(self, now: float) -> bool:
        """Return whether to take a message that arrives at `now` [s]."""
        self._left = min(self._most, self._left + max(0.0, now - self._filled) * self.rate)
        self._filled = now
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True


class Allowances:
    """An allowance for each source, so that one that sends too much costs the others nothing.

    Beyond `MOST_SOURCES`, new sources share one; else a sender could evade the limit with a new name for each message.
    """

    def __init__(self, rate: float, burst: float = BURST) -> None:
        self._rate, self._burst = rate, burst
        self._strangers = Allowance(rate, burst)
        self._own: dict[bytes, Allowance] = {}

    def takes(self, source: bytes, now: float) -> bool:
        """Return whether to take a message of a source that arrives at `now` [s]."""
        return (self._own.get(source) or self._of_new(source, now)).takes(now)

    def _of_new(self, source: bytes, now: float) -> Allowance:
        if len(self._own) >= MOST_SOURCES:
            self._own = {name: allowance for name, allowance in self._own.items() if not allowance.is_quiet(now)}
        if len(self._own) >= MOST_SOURCES:
            return self._strangers
        return self._own.setdefault(source, Allowance(self._rate, self._burst))


class RefusalReason(StrEnum):
    """Why a message is refused; the words complete the sentence `12 messages were refused: ...`."""

    TOO_MANY = "too many at once"
    TOO_LARGE = "too large"
    ATTACHMENT = "no ROS attachment"
    LENGTH = "wrong length"
    CONTENT = "unreadable content"
    NOT_FINITE = "a number is not finite"


class Refusals:
    """Counts refusals. Any thread may call `add`; only the scheduler's may call the rest."""

    def __init__(self) -> None:
        self._numbers = {reason: count(1) for reason in RefusalReason}  # `next` is atomic
        self._counted = dict.fromkeys(RefusalReason, 0)
        self._reported = dict.fromkeys(RefusalReason, 0)
        self._reported_total = 0

    def add(self, reason: RefusalReason) -> None:
        """Count one more."""
        self._counted[reason] = next(self._numbers[reason])

    @property
    def total(self) -> int:
        """Return how many messages have been refused."""
        return sum(self._counted.values())

    def news(self) -> dict[RefusalReason, int]:
        """Return how many messages were refused since the last call, by reason."""
        if self.total == self._reported_total:
            return {}
        counted = dict(self._counted)
        new = {reason: counted[reason] - self._reported[reason] for reason in RefusalReason}
        self._reported, self._reported_total = counted, sum(counted.values())
        return {reason: number for reason, number in new.items() if number > 0}


def sentence(name: str, news: dict[RefusalReason, int], what: str = "message") -> str:
    """Return a sentence on what a topic or service has refused."""
    total = sum(news.values())
    messages = f"1 {what} was" if total == 1 else f"{total} {what}s were"
    reasons = [reason if len(news) == 1 else f"{number} {reason}" for reason, number in news.items()]
    return f"{messages} refused on {name}: {', '.join(reasons)}"


@dataclass(frozen=True, slots=True)
class WitnessedCall:
    """A request, or the reply to one, as it leaves `node`."""

    node: str  # the client's for a request, the server's for a reply
    name: str  # of the service, with its leading slash
    service: type[Service[Any, Any]]
    client: bytes  # GID
    sequence: int  # of the request among those of its client; a reply has the same
    is_reply: bool
    message: Message | None  # None: a reply without a response, since the request was refused or failed
    reason: str = ""  # why a reply refuses the request, or has no response


Witness = Callable[[WitnessedCall], None]


T = TypeVar("T")
C = TypeVar("C", bound=Closable)
Post = Callable[[str, Callable[[], None]], object]  # makes the scheduler run a callback for an owner, soon


class Inbox(Generic[T]):
    """A bounded queue that keeps the newest items; any thread may call `put`, only the scheduler's the rest."""

    def __init__(self, owner: str, depth: int | None, handle: Callable[[T], None], post: Post) -> None:
        """Call `handle` for `owner` once per item; without a `depth`, nothing is ever dropped."""
        self._owner, self._handle, self._post = owner, handle, post
        self._items: deque[T] = deque(maxlen=depth)
        self._is_posted = False
        self._arrivals = count(1)  # unlike `+= 1`, its `next` is atomic
        self._arrived = 0
        self._taken = 0

    def put(self, item: T, post: Post, *, at: int = 1) -> None:
        """Put in an item. `post` must suit the calling thread; it is called once `at` items wait."""
        self._items.append(item)
        self._arrived = next(self._arrivals)
        # One wake-up suffices, however much arrives before it takes effect.
        if not self._is_posted and len(self._items) >= at:
            self._is_posted = True
            post(self._owner, self._take)

    def take_all(self) -> None:
        """Handle all waiting items immediately."""
        while self._items:
            self._taken += 1
            self._handle(self._items.popleft())

    def hold(self) -> None:
        """Keep arriving items waiting until `go_on`."""
        self._is_posted = True  # as if the items were about to be taken

    def go_on(self) -> None:
        """Handle the waiting items, and new ones as they arrive."""
        self._is_posted = bool(self._items)
        if self._is_posted:
            self._post(self._owner, self._take)

    @property
    def dropped(self) -> int:
        """Return how many items had to make room for newer ones."""
        return max(0, self._arrived - self._taken - len(self._items))

    def close(self) -> list[T]:
        """Handle no more items and return those left."""
        left = list(self._items)
        self._items = deque(maxlen=0)
        return left

    def _take(self) -> None:
        self._is_posted = False  # before looking: later arrivals post again
        if not self._items:
            return
        item = self._items.popleft()
        self._taken += 1
        if self._items and not self._is_posted:
            # One item per event: a busy inbox takes turns with the others, and an exception loses only one item.
            self._is_posted = True
            self._post(self._owner, self._take)
        self._handle(item)


Route = tuple[str, str]  # full name and ROS type: only ends where both agree are connected


class Registry(Generic[T]):
    """The ends of one kind in this process, by route, in the order in which they were declared."""

    def __init__(self) -> None:
        self._ends: dict[Route, list[T]] = {}

    def __len__(self) -> int:
        return sum(map(len, self._ends.values()))

    def __iter__(self) -> Iterator[T]:
        return chain.from_iterable(self._ends.values())

    def at(self, route: Route) -> list[T]:
        """Return the ends of `route`."""
        return self._ends.get(route, [])

    def add(self, route: Route, end: T) -> None:
        """Enter an end."""
        # A new list, since a loop over the old one may have created this end.
        self._ends[route] = [*self.at(route), end]

    def remove(self, route: Route, end: T) -> None:
        """Take an end out."""
        self._ends[route] = [other for other in self._ends[route] if other is not end]
        if not self._ends[route]:
            del self._ends[route]


@dataclass(frozen=True, slots=True)
class BusProcess:
    """What all ends of a process have in common."""

    scheduler: Scheduler
    clock: Clock
    transport: Transport
    wire: WireProfile
    domain: int
    namespace: str  # empty, or with a leading slash
    log: Callable[[str, str], None]  # owner, text
    ids: count[int] = field(default_factory=count)
    gates: dict[Gate, None] = field(default_factory=dict)  # an ordered set


@dataclass(frozen=True, slots=True)
class Endpoint:
    """The identity of one end: its route in the process, its key on the wire, and its token and GID there."""

    route: Route
    key: str
    token: str
    gid: bytes


class Participant:
    """A component as a participant: it announces itself, and closing it closes all that it declared."""

    def __init__(self, process: BusProcess, owner: str) -> None:
        self.process = process
        self.owner = owner
        self._token = NodeToken(process.domain, process.transport.session, next(process.ids), owner, process.namespace)
        self._declared: list[Closable] = [process.transport.announce(self._token.key)]
        self._closed_doors: list[Callable[[], None]] = []  # the callbacks that open them
        self._is_open = False

    def endpoint(self, kind: EntityKind, name: str, interface: type[Interface], qos: RosQos) -> Endpoint:
        """Return the identity of a new end of this node."""
        process, full_name = self.process, resolve(name, self.process.namespace)
        type_hash = process.wire.hash_of(interface)
        token = self._token.endpoint_key(
            kind, next(process.ids), full_name, dds_type(interface.TYPE), type_hash, process.wire.qos_text(qos)
        )
        key = data_key(process.domain, full_name, interface.TYPE, type_hash)
        return Endpoint((full_name, interface.TYPE), key, token, gid(token))

    def peers(self, kind: EntityKind, name: str, interface: type[Interface]) -> str:
        """Return the key expression that matches the tokens of all ends of one kind with this name and type."""
        full_name = resolve(name, self.process.namespace)
        type_hash = self.process.wire.hash_of(interface)
        return endpoint_pattern(self.process.domain, kind, full_name, dds_type(interface.TYPE), type_hash)

    def announce(self, endpoint: Endpoint) -> Closable:
        """Announce an end to other processes; it must be ready."""
        return self.process.transport.announce(endpoint.token)

    def keep(self, end: C) -> C:
        """Close `end` together with the node, and return it."""
        self._declared.append(end)
        return end

    def withdraw(self, end: Closable) -> None:
        """Close `end` now."""
        self._declared.remove(end)
        end.close()

    def when_open(self, callback: Callable[[], None]) -> None:
        """Call `callback` at `open`; now if the node is open."""
        self._closed_doors.append(callback)
        if self._is_open:
            self.open()

    def open(self) -> None:
        """Admit what has waited, and all that comes."""
        self._is_open = True
        while self._closed_doors:
            self._closed_doors.pop(0)()

    def close(self) -> None:
        """Withdraw all that was declared, last first."""
        while self._declared:
            self._declared.pop().close()


REQUESTS = 1000.0  # [Hz] per client, for services
GOALS = 50.0  # [Hz] per client: a new goal replaces the one before, which costs more than a request
QUESTIONS = 100.0  # [Hz] to a window
GATE_BURST = 1.0  # [s]; the requests allowed in this time may also come all at once

SOMEBODY = b""  # a client that does not identify itself


class Gate:
    """Lets in what each client may request. It runs in threads of the transport and wakes nobody for the rest."""

    def __init__(self, node: Participant, name: str, rate: float, put: Callable[[Question], None]) -> None:
        """Pass at most `rate` requests per second [Hz] of each client to `put`; `name` is used in findings."""
        self.owner, self.name = node.owner, name
        self.refusals = Refusals()
        self._clock, self._rate, self._put = node.process.clock, rate, put
        self._allowances = Allowances(rate, GATE_BURST)
        self._gates = node.process.gates
        self._gates[self] = None

    def __call__(self, question: Question) -> None:
        """Let a request in, or refuse it."""
        try:
            asker = decode_attachment(question.attachment).gid
        except AttachmentError:  # a tool at a window; a service refuses such a request when it reads it
            asker = SOMEBODY
        if self._allowances.takes(asker, self._clock.now()):
            self._put(question)
        else:
            self.refusals.add(RefusalReason.TOO_MANY)
            question.fail(f"more than {self._rate:g} requests a second")

    def close(self) -> None:
        """Remove the gate; no more requests may arrive."""
        self._gates.pop(self, None)
