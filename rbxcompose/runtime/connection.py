"""Opening the bus of a process."""

from __future__ import annotations

from collections.abc import Callable

from rbxcompose.bus.bus import Bus
from rbxcompose.bus.zenoh_session import open_peer
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.clock import Clock
from rbxcompose.plan.model import Plan
from rbxcompose.runtime.inbox import Inbox
from rbxcompose.scheduler import Scheduler


def open_bus(
    plan: Plan, router: str, scheduler: Scheduler, clock: Clock, inbox: Inbox, log: Callable[[str, str], None]
) -> Bus:
    """Open a Zenoh session that finds the robot's other processes at `router`, and the bus over it."""
    return Bus(
        scheduler,
        clock,
        domain=plan.bus.domain,
        namespace=plan.bus.namespace,
        wire=plan.bus.wire,
        transport=ZenohTransport(open_peer(router), inbox.put),
        log=log,
    )
