"""Carries topics, services and actions between the buses of robots: what is shared, and nothing else."""

import math
from collections.abc import Callable
from typing import Any

from rbxcompose.base.clock import Clock
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.scheduler import Scheduler
from rbxcompose.bus.access_control import AllowedHost, exchange_access
from rbxcompose.bus.actions import MOST_KEPT, CancelCode, GoalState
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.local import GOALS
from rbxcompose.bus.names import EXCHANGE_DOMAIN, ActionNames
from rbxcompose.bus.services import Client, ServedRequest, Server
from rbxcompose.bus.transport import EXPIRED
from rbxcompose.bus.zenoh_session import RouterLink, open_exchange, tls_settings
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.compiler.plan.model import BusPlan, Exchange
from rbxcompose.msgs import registry
from rbxcompose.msgs.action_msgs import CancelGoal, GoalInfo, GoalStatusArray
from rbxcompose.msgs.types import Action, Message, Service
from rbxcompose.msgs.unique_identifier_msgs import UUID
from rbxcompose.runtime.process_group.connection import CallbackInbox
from rbxcompose.sdk.bound import Reply
from rbxcompose.sdk.ports import Qos

OWNER = "other_robots"  # as the robot's own nodes see it

Handle = Callable[[ServedRequest[Any, Any]], None]


@dataclass(frozen=True, slots=True)
class Way:
    """From the bus where somebody gives something to the bus where somebody takes it, with its name on each."""

    source: Bus
    source_name: str
    sink: Bus
    sink_name: str


def carry_topic(way: Way, message: type[Message], qos: Qos) -> None:
    """Publish for others what is heard."""
    publisher = way.sink.publisher(OWNER, way.sink_name, message, qos)
    way.source.subscribe(OWNER, way.source_name, message, qos, publisher, may_be_silent=True)


def carry_service(way: Way, service: type[Service[Any, Any]]) -> None:
    """Serve what is served elsewhere, for as long as it is."""
    client = way.source.client(OWNER, way.source_name, service)

    def pass_on(request: ServedRequest[Any, Any]) -> None:
        client(request.message, lambda reply: answer(request, reply), timeout=math.inf)  # its client knows how long

    def serve() -> Server[Any, Any]:
        return way.sink.serve_later(OWNER, way.sink_name, service, pass_on)

    _While(client, way.sink, lambda: [serve()])


def answer(request: ServedRequest[Any, Any], reply: Reply[Any]) -> None:
    """Answer a request as its server did, or with the reason why it did not."""
    if reply.response is None:
        request.fail(reply.error)
    else:
        request.reply(reply.response, reply.error)


class _While:
    """Has servers on a bus while a client on another one knows one."""

    def __init__(self, client: Client[Any, Any], sink: Bus, serve: Callable[[], list[Server[Any, Any]]]) -> None:
        self._sink, self._serve = sink, serve
        self._servers: list[Server[Any, Any]] = []
        client.watch(self._changed)
        self._changed(client.is_available)

    def _changed(self, is_there: bool) -> None:
        while self._servers:
            self._sink.withdraw(OWNER, self._servers.pop())
        if is_there:
            self._servers = self._serve()


class CarriedAction:
    """Takes goals for an action that is served elsewhere.

    A goal whose client is gone is cancelled there, and so is one of which nobody here knows the end because the way to
    its server was interrupted. Only goals that came through here can be cancelled through here.
    """

    def __init__(self, way: Way, action: type[Action[Any, Any, Any]]) -> None:
        source_names, self._sink_names = ActionNames.of(way.source_name), ActionNames.of(way.sink_name)
        self._way, self._action = way, action
        self._goals: dict[bytes, bytes] = {}  # GID of the client, by goal that may not have ended
        self._lost: list[bytes] = []  # goals whose server was lost
        carry_topic(
            Way(way.source, source_names.feedback, way.sink, self._sink_names.feedback),
            action.FeedbackMessage,
            Qos.STATE,
        )
        carry_topic(
            Way(way.source, source_names.status, way.sink, self._sink_names.status), GoalStatusArray, Qos.LATCHED
        )
        self._cancel = way.source.client(OWNER, source_names.cancel_goal, CancelGoal)
        self._result: Client[Any, Any] = way.source.client(OWNER, source_names.get_result, action.GetResult)
        self._send: Client[Any, Any] = way.source.client(OWNER, source_names.send_goal, action.SendGoal)  # served last
        _While(self._send, way.sink, self._serve)

    def _serve(self) -> list[Server[Any, Any]]:
        while self._lost:
            self._ask_to_cancel(self._lost.pop())
        sink, sink_names, action = self._way.sink, self._sink_names, self._action
        return [
            sink.serve_later(OWNER, sink_names.cancel_goal, CancelGoal, self._on_cancel, rate=GOALS),
            sink.serve_later(OWNER, sink_names.get_result, action.GetResult, self._on_get_result),
            sink.serve_later(
                OWNER, sink_names.send_goal, action.SendGoal, self._on_send, client_left=self._client_left, rate=GOALS
            ),
        ]

    def _on_send(self, request: ServedRequest[Any, Any]) -> None:
        id_ = request.message.goal_id.uuid

        def replied(reply: Reply[Any]) -> None:
            if reply.response is None:
                self._lose(id_)
            elif not reply.response.accepted:
                self._goals.pop(id_, None)
            answer(request, reply)

        if id_ not in self._goals:
            self._goals[id_] = request.client
        if len(self._goals) > MOST_KEPT:  # of clients that never ask for results
            del self._goals[next(iter(self._goals))]
        self._send(request.message, replied)

    def _on_get_result(self, request: ServedRequest[Any, Any]) -> None:
        id_ = request.message.goal_id.uuid

        def replied(reply: Reply[Any]) -> None:
            if reply.response is None:
                if reply.error != EXPIRED:  # a goal may take longer than any request may; its client asks again
                    self._lose(id_)
            elif reply.response.status == GoalState.UNKNOWN or GoalState(reply.response.status).is_end:
                self._goals.pop(id_, None)
            answer(request, reply)

        self._result(request.message, replied, timeout=math.inf)

    def _on_cancel(self, request: ServedRequest[CancelGoal.Request, CancelGoal.Response]) -> None:
        if request.message.goal_info.goal_id.uuid in self._goals:
            self._cancel(request.message, lambda reply: answer(request, reply))
        else:
            request.reply(CancelGoal.Response(return_code=CancelCode.REJECTED))

    def _client_left(self, client: bytes) -> None:
        for id_ in [name for name, sender in self._goals.items() if sender == client]:
            del self._goals[id_]
            self._ask_to_cancel(id_)

    def _lose(self, id_: bytes) -> None:
        """Cancel a goal whose end nobody here will know, as soon as its server is there."""
        if self._goals.pop(id_, None) is not None:
            if self._send.is_available:
                self._ask_to_cancel(id_)
            else:
                self._lost.append(id_)

    def _ask_to_cancel(self, id_: bytes) -> None:
        self._cancel(CancelGoal.Request(goal_info=GoalInfo(goal_id=UUID(id_))), lambda reply: None)


class RobotExchange:
    """Takes what a robot gives from its bus, and gives it to others; and the other way round."""

    def __init__(
        self,
        exchange: Exchange,
        bus: BusPlan,
        transport: ZenohTransport,
        loop: tuple[Scheduler, Clock, CallbackInbox],
        log: Callable[[str, str], None],
    ) -> None:
        """Take the `transport` of the robot's own bus.

        Raises:
            OSError: if its endpoint is taken.
        """
        scheduler, clock, inbox = loop
        session = open_exchange(_link(exchange))
        self._own = own = Bus(scheduler, clock, domain=bus.domain, wire=bus.wire, transport=transport, log=log)
        outside = ZenohTransport(session, inbox.put)
        self._others = Bus(scheduler, clock, domain=EXCHANGE_DOMAIN, transport=outside, log=log)
        for wire in exchange.gives:
            carry(Way(own, wire.own, self._others, wire.shared), wire.type, wire.qos)
        for wire in exchange.takes:
            carry(Way(self._others, wire.shared, own, wire.own), wire.type, wire.qos)

    def close(self) -> None:
        """Leave the other robots; the robot's own bus is closed by whoever opened it."""
        self._own.close_owner(OWNER)
        self._others.close()


def _link(exchange: Exchange) -> RouterLink:
    own = exchange.tls
    tls = tls_settings(own.authority, own.certificate, own.key, mutual=own.mutual) if own else {}
    gives, takes = ([wire.pattern for wire in each] for each in (exchange.gives, exchange.takes))
    allowed = [AllowedHost(access.certificate, access.gives, access.takes, ()) for access in exchange.access]
    return RouterLink(
        exchange.listen, exchange.connect, tls, exchange_access(gives, takes, allowed), lease=exchange.lease
    )


def carry(way: Way, type_: str, qos: str) -> None:
    """Carry a topic, a service or an action, as its type says."""
    match type_.split("/")[1]:
        case "srv":
            carry_service(way, registry.service(type_))
        case "action":
            CarriedAction(way, registry.action(type_))
        case _:
            carry_topic(way, registry.message(type_), Qos(qos))
