"""State shared by the ends of one process: who serves a name here, and all that is needed to declare an end."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import field
from itertools import chain, count
from typing import Generic, Protocol, TypeVar

from rbxcompose.bus.names import data_key, dds_type, resolve
from rbxcompose.bus.refusals import Refusals
from rbxcompose.bus.tokens import EntityKind, NodeToken, endpoint_pattern, gid
from rbxcompose.bus.transport import Closable, Transport
from rbxcompose.bus.wire import RosQos, WireProfile
from rbxcompose.clock import Clock
from rbxcompose.dataclass import dataclass
from rbxcompose.msgs.types import Interface
from rbxcompose.scheduler import Scheduler

T = TypeVar("T")
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


class Refusing(Protocol):
    """A place that refuses requests of other processes: its owner, its name, and its counts."""

    owner: str
    name: str
    refusals: Refusals


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
    gates: dict[Refusing, None] = field(default_factory=dict)  # an ordered set


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

    def keep(self, end: Closable) -> None:
        """Close `end` together with the node."""
        self._declared.append(end)

    def withdraw(self, end: Closable) -> None:
        """Close `end` now."""
        self._declared.remove(end)
        end.close()

    def when_open(self, callback: Callable[[], None]) -> None:
        """Let `open` call `callback`."""
        self._closed_doors.append(callback)

    def open(self) -> None:
        """Admit the requests that have waited, and new ones."""
        while self._closed_doors:
            self._closed_doors.pop(0)()

    def close(self) -> None:
        """Withdraw all that was declared, last first."""
        while self._declared:
            self._declared.pop().close()
