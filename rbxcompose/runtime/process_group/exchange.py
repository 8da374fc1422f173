"""Carries between the bus of a robot and those of other robots what is shared, and nothing else."""

from __future__ import annotations

from collections.abc import Callable

from rbxcompose.bus.access_control import AllowedHost, exchange_access
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.names import EXCHANGE_DOMAIN
from rbxcompose.bus.zenoh_session import RouterLink, open_exchange, tls_settings
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.clock import Clock
from rbxcompose.msgs import registry
from rbxcompose.plan.model import BusPlan, Exchange
from rbxcompose.qos import Qos
from rbxcompose.runtime.process_group.carriers import OWNER, CarriedAction, Way, carry_service, carry_topic
from rbxcompose.runtime.process_group.inbox import CallbackInbox
from rbxcompose.scheduler import Scheduler


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
        for one in exchange.gives:
            _carry(Way(own, one.own, self._others, one.shared), one.type, one.qos)
        for one in exchange.takes:
            _carry(Way(self._others, one.shared, own, one.own), one.type, one.qos)

    def close(self) -> None:
        """Leave the other robots; the robot's own bus is closed by whoever opened it."""
        self._own.close_owner(OWNER)
        self._others.close()


def _link(exchange: Exchange) -> RouterLink:
    own = exchange.tls
    tls = tls_settings(own.authority, own.certificate, own.key, mutual=own.mutual) if own else {}
    gives, takes = ([one.pattern for one in each] for each in (exchange.gives, exchange.takes))
    allowed = [AllowedHost(one.certificate, one.gives, one.takes, ()) for one in exchange.access]
    return RouterLink(
        exchange.listen, exchange.connect, tls, exchange_access(gives, takes, allowed), lease=exchange.lease
    )


def _carry(way: Way, type_: str, qos: str) -> None:
    match type_.split("/")[1]:
        case "srv":
            carry_service(way, registry.service(type_))
        case "action":
            CarriedAction(way, registry.action(type_))
        case _:
            carry_topic(way, registry.message(type_), Qos(qos))
