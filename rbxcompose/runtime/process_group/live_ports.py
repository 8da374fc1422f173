"""Binding: each declared port of a component becomes a live end on the bus."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any, Protocol, cast

from rbxcompose.bus.action_server import ActionServer
from rbxcompose.bus.bus import Bus
from rbxcompose.bus.classes import queue_depth
from rbxcompose.bus.services import ServedRequest
from rbxcompose.clock import Clock
from rbxcompose.diagnostics.updater import DiagnosticTask
from rbxcompose.levels import Level
from rbxcompose.missions.program.sources import PAUSE
from rbxcompose.msgs.std_srvs import SetBool
from rbxcompose.plan.model import Instance
from rbxcompose.requests import Refused
from rbxcompose.runtime.process_group.frames import Frames, Lookup
from rbxcompose.runtime.process_group.paced import paced
from rbxcompose.runtime.process_group.worker import Call, Worker
from rbxcompose.sdk.bound import Later
from rbxcompose.sdk.component import Component
from rbxcompose.sdk.ports import (
    Calls,
    CallsAction,
    In,
    Looks,
    Out,
    Port,
    SendsOrders,
    Serves,
    ServesAction,
    ServesTopic,
)


class Handling(Protocol):
    """What runs the handlers of a component."""

    clock: Clock

    @property
    def worker(self) -> Worker | None:
        """Return the component's own thread, if it has one."""
        ...

    def refusal(self, port: Port[Any]) -> str:
        """Return why a message, request or goal cannot be taken now; empty if it can."""
        ...

    def do(self, label: str, call: Callable[[], None], *, depth: int | None = None) -> None:
        """Run `call` in the thread that the component belongs to."""
        ...

    def log(self, level: Level, text: str) -> None:
        """Write one event of the robot's story."""
        ...

    def watch(self, name: str, task: DiagnosticTask) -> None:
        """Report how `task` stands to diagnostics."""
        ...


def bind(component: Component[Any], instance: Instance, bus: Bus, frames: Frames | None, handling: Handling) -> None:
    """Fill `component.bound`; incoming data go to its handlers unless there is a reason to refuse them."""
    for name, port in type(component).ports(component.config).items():
        component.bound[name] = _end(component, instance, name, port, bus, frames, handling)


def subscribe(component: Component[Any], owner: str, topic: str, port: In[Any], bus: Bus, handling: Handling) -> Any:
    """Subscribe to a topic; its messages go to the handler of the port."""
    handler = _on_message(component, port.name, port, handling)
    waits = isinstance(port, ServesTopic)  # like goals: a sender that waits for a listener relies on it
    is_light, interface = handling.worker is None, cast(Any, port.interface)
    return bus.subscribe(
        owner,
        topic,
        interface,
        port.qos,
        handler,
        max_rate=port.max_rate,
        max_size=math.inf if port.max_size is None else port.max_size,
        waits=waits,
        is_light=is_light,
        may_be_silent=port.may_be_silent,
    )


def _end(
    component: Component[Any],
    instance: Instance,
    name: str,
    port: Port[Any],
    bus: Bus,
    frames: Frames | None,
    handling: Handling,
) -> object:
    owner, interface = instance.name, cast(Any, port.interface)
    match port:
        case Looks():
            return _lookup(port, frames, handling)
        case SendsOrders():
            return bus.orders(owner, instance.topic(name), interface, port.qos, port.servers)
        case Out():
            publisher = bus.publisher(owner, instance.topic(name), interface, port.qos)
            return paced(publisher, port, handling.clock, handling.watch)
        case In():
            return subscribe(component, owner, instance.topic(name), port, bus, handling)
        case Serves():
            serve = _on_request(component, name, port, handling)
            bus.serve_later(owner, instance.topic(name), interface, serve, waits=True)
            return None
        case Calls():
            return bus.client(owner, instance.topic(name), interface)
        case ServesAction():
            topic = instance.topic(name)
            accept = _on_goal(component, name, port, handling)
            server = bus.serve_action(owner, topic, interface, accept, waits=True)
            if port.pausable:
                bus.serve(owner, f"{topic}/{PAUSE}", SetBool, partial(_pause, server, port, handling))
            return server
        case CallsAction():
            return bus.action_client(owner, instance.topic(name), interface)
        case _:
            raise TypeError(f"'{instance.type}' has a port of an unknown kind: {port!r}")


def _lookup(port: Looks, frames: Frames | None, handling: Handling) -> Lookup:
    if frames is None:
        raise RuntimeError("a process with components that look keeps frames")
    if handling.worker is not None:
        frames.hurry()
    return Lookup(frames, port.target, port.source)


def _pause(
    server: ActionServer[Any, Any, Any], port: Port[Any], handling: Handling, request: SetBool.Request
) -> SetBool.Response:
    """Pause or resume the current goal; while the robot is stopped, nothing resumes."""
    goal = server.current
    if goal is None:
        return SetBool.Response(success=False, message="no goal is being carried out")
    if not request.data and (reason := handling.refusal(port)):
        return SetBool.Response(success=False, message=reason)
    goal.is_paused = request.data
    return SetBool.Response(success=True)


def _on_message(component: Component[Any], name: str, port: In[Any], handling: Handling) -> Callable[[Any], None]:
    own = getattr(component, f"on_{name}", None)
    handler: Callable[[Any], None] = own if own is not None else partial(component.received, name)
    label, depth = f"on_{name}", queue_depth(port.qos)

    def take(message: Any) -> None:
        reason = handling.refusal(port)
        if not reason:  # else it only stays the newest value, for whoever reads it
            handling.do(label, partial(handler, message), depth=depth)
        elif isinstance(port, ServesTopic):
            handling.log(Level.WARN, f"an order to {name} is not carried out: {reason}")

    return take


def _on_request(
    component: Component[Any], name: str, port: Port[Any], handling: Handling
) -> Callable[[ServedRequest[Any, Any]], None]:
    answer = getattr(component, f"on_{name}")

    def serve(request: ServedRequest[Any, Any]) -> None:
        if reason := handling.refusal(port):
            raise Refused(reason)
        worker = handling.worker
        send = worker.send if worker is not None else _at_once
        handling.do(f"on_{name}", partial(_answer, request, answer, send))

    return serve


def _answer(request: ServedRequest[Any, Any], answer: Callable[[Any], Any], send: Callable[[Call], None]) -> None:
    try:
        response = answer(request.message)
    except Refused as refusal:
        send(partial(request.fail, str(refusal)))
    except Exception as error:
        send(partial(request.fail, f"{type(error).__name__}: {error}"))
        raise
    else:
        reply = response.then if isinstance(response, Later) else lambda then: then(response)
        reply(lambda told: send(partial(request.reply, told)))


def _at_once(call: Call) -> None:
    call()


def _on_goal(component: Component[Any], name: str, port: Port[Any], handling: Handling) -> Callable[[Any], str]:
    accept: Callable[[Any], str] = getattr(component, f"accept_{name}", lambda goal: "")
    return lambda goal: handling.refusal(port) or accept(goal)
