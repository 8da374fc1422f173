"""The bus of one process: everything that its components declare, by component."""

from collections.abc import Callable, Collection, Sequence
from typing import Any, TypeVar

from rbxcompose.base.clock import Clock
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.actions import ActionClient, ActionServer
from rbxcompose.bus.graph import Writers
from rbxcompose.bus.local import REQUESTS, BusProcess, Gate, Inbox, Participant, Witness
from rbxcompose.bus.services import Client, ServedRequest, Server, Services, Window
from rbxcompose.bus.tokens import publishers_pattern
from rbxcompose.bus.topics import OrderPublisher, Publisher, Subscription, Topics
from rbxcompose.bus.transport import Closable, NoTransport, Transport
from rbxcompose.bus.wire import WIRE_PROFILES
from rbxcompose.msgs.types import Action, Message, Service
from rbxcompose.sdk.ports import ORDINARY, MessageLimits, Qos

M = TypeVar("M", bound=Message)
Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)
G = TypeVar("G", bound=Message)
F = TypeVar("F", bound=Message)


class Bus:
    """Connects the components of a process with each other and, over `transport`, with all others.

    An owner is a component's name; ROS knows it as a node. Names of topics, services and actions are relative to
    `namespace` unless they start with `/`. All calls and callbacks happen in the scheduler's thread. A `witness`
    receives each request and each reply, including those within the process.
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
        witness: Witness | None = None,
        log: Callable[[str, str], None],
    ) -> None:
        self._transport = transport if transport is not None else NoTransport()
        space = f"/{namespace.strip('/')}" if namespace else ""
        self._process = BusProcess(scheduler, clock, self._transport, WIRE_PROFILES[wire], domain, space, log)
        self._topics, self._services = Topics(), Services(witness=witness)
        self._nodes: dict[str, Participant] = {}

    def __len__(self) -> int:
        """Return how many publishers, subscriptions, servers and clients are declared."""
        topics, services = self._topics, self._services
        return len(topics.publishers) + len(topics.subscriptions) + len(services.servers) + len(services.clients)

    def publisher(self, owner: str, topic: str, message: type[M], qos: Qos) -> Publisher[M]:
        """Declare a publisher; call it with a message."""
        node = self._node(owner)
        return node.keep(Publisher(self._topics, node, topic, message, qos))

    def orders(self, owner: str, topic: str, message: type[M], qos: Qos, servers: Collection[str]) -> OrderPublisher[M]:
        """Declare a publisher that knows whether the components `servers` are listening."""
        node = self._node(owner)
        return node.keep(OrderPublisher(self._topics, node, topic, message, qos, servers))

    def subscribe(
        self,
        owner: str,
        topic: str,
        message: type[M],
        qos: Qos,
        handler: Callable[[M], None],
        *,
        max_rate: float | None = None,
        limits: MessageLimits | None = None,
        waits: bool = False,
        is_patient: bool = False,
        is_light: bool = True,
        may_be_silent: bool = False,
    ) -> Subscription[M]:
        """Call `handler` with each message of a topic; with `waits`, not before `open`.

        Takes at most `max_rate` [Hz] from each publisher of another process (all messages if infinite); None means the
        limit of the QoS class. Refuses their messages beyond the `limits`. A patient subscription is for topics
        that are published often and read rarely. A light handler may run in the thread that brings a message. Whoever
        `may_be_silent` is not missed.
        """
        node = self._node(owner)
        kinds = {"waits": waits, "is_patient": is_patient, "is_light": is_light, "may_be_silent": may_be_silent}
        made = Subscription(self._topics, node, topic, message, qos, handler, max_rate, limits=limits, **kinds)
        return node.keep(made)

    def serve(self, owner: str, name: str, service: type[Service[Q, R]], handler: Callable[[Q], R]) -> None:
        """Answer requests with what `handler` returns; if it raises, the caller gets the error instead.

        `Refused` is not an error of the handler; any other exception also goes to the scheduler's `on_error`.
        """
        node = self._node(owner)
        node.keep(Server(self._services, node, name, service, lambda asked: asked.reply(handler(asked.message))))

    def serve_later(
        self,
        owner: str,
        name: str,
        service: type[Service[Q, R]],
        handle: Callable[[ServedRequest[Q, R]], None],
        *,
        client_left: Callable[[bytes], None] | None = None,
        waits: bool = False,
        rate: float = REQUESTS,
        limits: MessageLimits = ORDINARY,
    ) -> Server[Q, R]:
        """Call `handle` with each request, to be answered now or later; with `waits`, none before `open`.

        Takes at most `rate` [Hz] from each client elsewhere, and none of their requests beyond the `limits`.
        `client_left` gets the GID of each client that is gone.
        """
        node = self._node(owner)
        return node.keep(
            Server(self._services, node, name, service, handle, client_left, waits=waits, rate=rate, limits=limits)
        )

    def client(self, owner: str, name: str, service: type[Service[Q, R]]) -> Client[Q, R]:
        """Declare a client of a service; call it with a request."""
        node = self._node(owner)
        return node.keep(Client(self._services, node, name, service))

    def serve_action(
        self,
        owner: str,
        name: str,
        action: type[Action[G, R, F]],
        accept: Callable[[G], str],
        *,
        waits: bool = False,
        limits: MessageLimits = ORDINARY,
    ) -> ActionServer[G, R, F]:
        """Carry out goals; with `waits`, none before `open`. `accept` returns why it refuses a goal, or nothing.

        Goals of other processes beyond the `limits` are refused before that.
        """
        node = self._node(owner)
        return node.keep(
            ActionServer(self._topics, self._services, node, name, action, accept, waits=waits, limits=limits)
        )

    def action_client(self, owner: str, name: str, action: type[Action[G, R, F]]) -> ActionClient[G, R, F]:
        """Declare a client of an action; call it with a goal."""
        node = self._node(owner)
        return node.keep(ActionClient(self._topics, self._services, node, name, action))

    @property
    def subscriptions(self) -> Sequence[Subscription[Any]]:
        """Return all subscriptions."""
        return list(self._topics.subscriptions)

    @property
    def gates(self) -> Sequence[Gate]:
        """Return the gates through which requests of other processes come."""
        return list(self._process.gates)

    def watch_writers(self, owner: str) -> Writers:
        """Follow the publishers of other processes."""
        process, transport, writers = self._process, self._transport, Writers(self._transport.session)

        def take(change: tuple[str, bool]) -> None:
            writers.apply(change[0], process.clock.now(), is_there=change[1])

        inbox = Inbox(owner, None, take, process.scheduler.post)
        pattern = publishers_pattern(process.domain)
        watched = transport.watch(pattern, lambda key, is_there: inbox.put((key, is_there), transport.wake))
        self._node(owner).keep(watched)
        return writers

    def window(self, owner: str, key: str, answer: Callable[[], object]) -> Window:
        """Show tools outside a part of a component's state at a key; `answer` returns all of it as JSON."""
        node = self._node(owner)
        return node.keep(Window(node, key, answer))

    def open(self, owner: str) -> None:
        """Deliver to a component the requests and goals that have waited for it."""
        self._node(owner).open()

    def withdraw(self, owner: str, end: Closable) -> None:
        """Close one end that a component declared, before the others."""
        self._node(owner).withdraw(end)

    def close_owner(self, owner: str) -> None:
        """Withdraw all that a component declared: its goals end as aborted, and their clients learn that it is lost."""
        node = self._nodes.pop(owner, None)
        if node is not None:
            node.close()

    def close(self) -> None:
        """Withdraw everything and leave the transport."""
        for owner in list(self._nodes):
            self.close_owner(owner)
        self._transport.close()

    def _node(self, owner: str) -> Participant:
        if owner not in self._nodes:
            self._nodes[owner] = Participant(self._process, owner)
        return self._nodes[owner]
