"""The bus of one process: everything that its components declare, by component."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from rbxcompose.bus.action_client import ActionClient
from rbxcompose.bus.action_server import ActionServer
from rbxcompose.bus.local import Node, Process
from rbxcompose.bus.services import Client, Server, Services
from rbxcompose.bus.topics import Publisher, Subscription, Topics
from rbxcompose.bus.transport import Closable, Nowhere, Transport
from rbxcompose.bus.wire import WIRE_PROFILES
from rbxcompose.clock import Clock
from rbxcompose.msgs.types import Action, Message, Service
from rbxcompose.qos import Qos
from rbxcompose.scheduler import Scheduler

M = TypeVar("M", bound=Message)
Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)
G = TypeVar("G", bound=Message)
F = TypeVar("F", bound=Message)
C = TypeVar("C", bound=Closable)


class Bus:
    """Connects the components of a process with each other and, over `transport`, with all others.

    An owner is a component's name; ROS knows it as a node. Names of topics, services and actions are relative to
    `namespace` unless they start with `/`. Everything is called, and calls back, in the scheduler's thread.
    """

    def __init__(
        self,
        scheduler: Scheduler,
        clock: Clock,
        *,
        domain: int = 0,
        namespace: str = "",
        wire: str = "jazzy",
        transport: Transport | None = None,
        log: Callable[[str, str], None],
    ) -> None:
        self._transport = transport if transport is not None else Nowhere()
        space = f"/{namespace.strip('/')}" if namespace else ""
        self._process = Process(scheduler, clock, self._transport, WIRE_PROFILES[wire], domain, space, log)
        self._topics, self._services = Topics(), Services()
        self._nodes: dict[str, Node] = {}

    def __len__(self) -> int:
        """Return how many publishers, subscriptions, servers and clients are declared."""
        topics, services = self._topics, self._services
        return len(topics.publishers) + len(topics.subscriptions) + len(services.servers) + len(services.clients)

    def publisher(self, owner: str, topic: str, message: type[M], qos: Qos) -> Publisher[M]:
        """Declare a publisher; call it with a message."""
        node = self._node(owner)
        return _kept(node, Publisher(self._topics, node, topic, message, qos))

    def subscribe(
        self, owner: str, topic: str, message: type[M], qos: Qos, handler: Callable[[M], None]
    ) -> Subscription[M]:
        """Have `handler` called with each message of a topic."""
        node = self._node(owner)
        return _kept(node, Subscription(self._topics, node, topic, message, qos, handler))

    def serve(self, owner: str, name: str, service: type[Service[Q, R]], handler: Callable[[Q], R]) -> None:
        """Answer requests with what `handler` returns; if it raises, the caller gets the error instead.

        `Refused` is no error of the handler's, anything else goes to the scheduler's `on_error` as well.
        """
        node = self._node(owner)
        _kept(node, Server(self._services, node, name, service, lambda asked: asked.reply(handler(asked.message))))

    def client(self, owner: str, name: str, service: type[Service[Q, R]]) -> Client[Q, R]:
        """Declare a client of a service; call it with a request."""
        node = self._node(owner)
        return _kept(node, Client(self._services, node, name, service))

    def serve_action(
        self, owner: str, name: str, action: type[Action[G, R, F]], accept: Callable[[G], str]
    ) -> ActionServer[G, R, F]:
        """Carry out goals; `accept` returns why it refuses one, or nothing."""
        node = self._node(owner)
        return _kept(node, ActionServer(self._topics, self._services, node, name, action, accept))

    def action_client(self, owner: str, name: str, action: type[Action[G, R, F]]) -> ActionClient[G, R, F]:
        """Declare a client of an action; call it with a goal."""
        node = self._node(owner)
        return _kept(node, ActionClient(self._topics, self._services, node, name, action))

    def close_owner(self, owner: str) -> None:
        """Withdraw all that a component declared: its goals end as aborted, their clients hear that it is lost."""
        node = self._nodes.pop(owner, None)
        if node is not None:
            node.close()

    def close(self) -> None:
        """Withdraw everything and leave the transport."""
        for owner in list(self._nodes):
            self.close_owner(owner)
        self._transport.close()

    def _node(self, owner: str) -> Node:
        if owner not in self._nodes:
            self._nodes[owner] = Node(self._process, owner)
        return self._nodes[owner]


def _kept(node: Node, end: C) -> C:
    node.keep(end)
    return end
