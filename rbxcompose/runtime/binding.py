"""Binding: each declared port of a component becomes a live end on the bus."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

from rbxcompose.body.transforms import TransformTree
from rbxcompose.bus.bus import Bus
from rbxcompose.plan.model import Instance
from rbxcompose.runtime.frames import Lookup
from rbxcompose.sdk.bound import Refused
from rbxcompose.sdk.component import Component
from rbxcompose.sdk.ports import Calls, CallsAction, In, Looks, Out, Port, Serves, ServesAction

Refusal = Callable[[Port[Any]], str]  # why a goal or request cannot be taken now; empty if it can


def bind(component: Component[Any], instance: Instance, bus: Bus, tree: TransformTree, refusal: Refusal) -> None:
    """Fill `component.bound`; what arrives goes to its handlers unless `refusal` has a reason."""
    for name, port in type(component).ports(component.config).items():
        component.bound[name] = _end(component, instance, name, port, bus, tree, refusal)


def _end(
    component: Component[Any],
    instance: Instance,
    name: str,
    port: Port[Any],
    bus: Bus,
    tree: TransformTree,
    refusal: Refusal,
) -> object:
    owner, interface = instance.name, cast(Any, port.interface)
    match port:
        case Looks():
            return Lookup(tree, port.target, port.source)
        case Out():
            return bus.publisher(owner, instance.topic(name), interface, port.qos)
        case In():
            handler = _on_message(component, name, port, refusal)
            return bus.subscribe(owner, instance.topic(name), interface, port.qos, handler)
        case Serves():
            bus.serve(owner, instance.topic(name), interface, _on_request(component, name, port, refusal))
            return None
        case Calls():
            return bus.client(owner, instance.topic(name), interface)
        case ServesAction():
            return bus.serve_action(owner, instance.topic(name), interface, _on_goal(component, name, port, refusal))
        case CallsAction():
            return bus.action_client(owner, instance.topic(name), interface)
        case _:
            raise TypeError(f"'{instance.type}' has a port of an unknown kind: {port!r}")


def _on_message(component: Component[Any], name: str, port: Port[Any], refusal: Refusal) -> Callable[[Any], None]:
    own = getattr(component, f"on_{name}", None)

    def take(message: Any) -> None:
        if refusal(port):
            return  # it stays the newest value, for who asks
        if own is not None:
            own(message)
        else:
            component.received(name, message)

    return take


def _on_request(component: Component[Any], name: str, port: Port[Any], refusal: Refusal) -> Callable[[Any], Any]:
    answer = getattr(component, f"on_{name}")

    def serve(request: Any) -> Any:
        if reason := refusal(port):
            raise Refused(reason)
        return answer(request)

    return serve


def _on_goal(component: Component[Any], name: str, port: Port[Any], refusal: Refusal) -> Callable[[Any], str]:
    accept: Callable[[Any], str] = getattr(component, f"accept_{name}", lambda goal: "")
    return lambda goal: refusal(port) or accept(goal)
