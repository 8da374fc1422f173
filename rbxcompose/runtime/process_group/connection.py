"""Opens the bus of a process, over a session that is reopened when it is stuck."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TYPE_CHECKING

import zenoh

from rbxcompose.bus import shared_memory
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.renewal import RenewableTransport
from rbxcompose.bus.transport import Transport
from rbxcompose.bus.zenoh_session import open_lone, open_peer
from rbxcompose.bus.zenoh_transport import ZenohTransport
from rbxcompose.clock import Clock
from rbxcompose.dataclass import dataclass
from rbxcompose.plan.model import Plan
from rbxcompose.runtime.process_group.inbox import CallbackInbox
from rbxcompose.runtime.process_group.lifeline import Lifeline
from rbxcompose.runtime.process_group.roll_caller import RollCaller
from rbxcompose.runtime.process_group.turns import Turns
from rbxcompose.runtime.processes import longest_wait, waits_of
from rbxcompose.scheduler import Scheduler

if TYPE_CHECKING:
    from rbxcompose.recording.tape import Tape


_STARVED = 1.0  # [s] of waiting for a processor, after which a router that does not answer may be late as well


@dataclass(frozen=True, slots=True)
class Connection:
    """The bus of a process, and the watch over its session."""

    bus: Bus
    lifeline: Lifeline
    transport: Transport


def open_bus(
    plan: Plan,
    name: str,
    router: str,
    scheduler: Scheduler,
    clock: Clock,
    inbox: CallbackInbox,
    turns: Turns,
    log: Callable[[str, str], None],
    tape: Tape | None = None,
) -> Connection:
    """Open the Zenoh session of process `name`, which finds the robot's others at `router`, and the bus over it."""

    is_lone = plan.bus.links == "router"

    def opened() -> ZenohTransport:
        session = _open_lone(router) if is_lone else open_peer(router)
        return ZenohTransport(session, inbox.put, turns)

    if reason := shared_memory.problem():
        log("robot", f"large messages are sent without shared memory: {reason}")
    transport = RenewableTransport(opened())
    bus = Bus(
        scheduler,
        clock,
        domain=plan.bus.domain,
        namespace=plan.bus.namespace,
        wire=plan.bus.wire,
        transport=tape.around(transport) if tape else transport,
        witness=tape.witness if tape else None,
        log=log,
    )
    lifeline = Lifeline(
        plan.robot,
        transport,
        opened,
        router,
        roll=None if is_lone else RollCaller(transport, plan.robot, plan.share.host if plan.share else "", name),
        owns_router=plan.bus.router is None,
        post=inbox.put,
        log=lambda text: log("robot", text),
    )
    return Connection(bus, lifeline, transport)


def _open_lone(router: str) -> zenoh.Session:
    """Open a session at `router`; as often as it takes, while this machine has too much to do.

    Raises:
        OSError: if the router does not answer.
    """
    while True:
        before = waits_of(os.getpid())
        try:
            return open_lone(router)
        except OSError:
            if longest_wait(before, waits_of(os.getpid())) < _STARVED:
                raise
