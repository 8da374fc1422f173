"""Why a port of a component has its topic, and what is at the other end."""

from __future__ import annotations

from rbxcompose.inspection.answer import PathAnswer
from rbxcompose.inspection.wire_keys import does, keys_of, qos_of
from rbxcompose.manifest.tree import KeyPath, at
from rbxcompose.model.robot import Robot, RobotComponent
from rbxcompose.model.wires import PortEnd, resolve
from rbxcompose.plan.model import BusPlan
from rbxcompose.sdk.ports import Calls, CallsAction, In, Looks, Out, Serves, ServesAction, ServesTopic

_OTHER = {  # the first one that matches a port counts
    ServesTopic: (Out, "ordered by"),
    Out: (In, "read by"),
    In: (Out, "sent by"),
    Serves: (Calls, "called by"),
    Calls: (Serves, "served by"),
    ServesAction: (CallsAction, "asked by"),
    CallsAction: (ServesAction, "served by"),
}


def why_port(robot: Robot, path: KeyPath) -> PathAnswer | None:
    """Return what is known about a component (`transforms`) or its port (`go_to.cmd_vel`), None if there is none."""
    name, *rest = [str(key) for key in (path[1:] if path[0] in ("components", "muxes") else path)] or [""]
    component = robot.components.get(name)
    if component is None or len(rest) > 1:
        return None
    if not rest:
        about = (component.cls.__doc__ or "").strip().partition("\n")[0]
        is_written = at(robot.manifest.root, component.path) is not None
        place = str(robot.component_span(name)) if is_written else "every robot runs it"
        return PathAnswer(name, f"type {component.type_name}", about, hints=(("where", place),))
    end = component.end(rest[0])
    return _port(robot, component, end) if end else None


def _port(robot: Robot, component: RobotComponent, end: PortEnd) -> PathAnswer:
    path = f"{end.instance}.{end.name}"
    if isinstance(end.port, Looks):
        return PathAnswer(path, f"looks up '{end.port.source}' in '{end.port.target}'")
    qos = qos_of(end.port)
    value = f"{does(end.port)} {end.type_name} at {end.topic}" + (f", as {qos}" if qos else "")
    bus = robot.manifest.bus
    keys = keys_of(end.port, end.topic, BusPlan(bus.domain, bus.namespace or "", bus.port, bus.wire, bus.router))
    hints = [("because", _reason(robot, component, end)), _others(robot, end)]
    return PathAnswer(path, value, hints=(*hints, *((label if len(keys) > 1 else "key", key) for label, key in keys)))


def _reason(robot: Robot, component: RobotComponent, end: PortEnd) -> str:
    namespace = robot.manifest.bus.namespace or ""
    for mux, entry in robot.manifest.muxes.items():
        for name, source in entry.inputs.items():
            is_taken = (source.source or "").partition(".")[0] == component.name and isinstance(end.port, Out)
            if is_taken and end.topic == resolve(source.topic or f"{mux}/{name}", namespace):
                place = robot.value("muxes", mux, "inputs", name, "from")
                return f"mux '{mux}' takes it as its input '{name}' ({place})"
    connected = (*component.path, "connect", end.name)
    if at(robot.manifest.root, connected) is not None:
        return f"'connect' says so ({robot.value(*connected)})"
    if component.path[:1] == ("muxes",):
        return f"a mux and its inputs are named so ({robot.component_span(component.name)})"
    if namespace and not end.port.topic.startswith("/"):
        return f"that is its own name in the namespace '{namespace}' ({robot.value('bus', 'namespace')})"
    return f"that is its own name; 'connect: {{{end.name}: ...}}' gives it another one"


def _others(robot: Robot, end: PortEnd) -> tuple[str, str]:
    other, words = next(pair for kind, pair in _OTHER.items() if isinstance(end.port, kind))
    names = [
        f"{one.instance}.{one.name}" for one in robot.ends if one.topic == end.topic and isinstance(one.port, other)
    ]
    outside = "anything outside" if isinstance(end.port, In) and end.port.is_open else "nothing here"
    return words, ", ".join(names) or outside
