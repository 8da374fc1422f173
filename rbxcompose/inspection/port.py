"""Why a port of a component has its topic, and what is at the other end."""

from __future__ import annotations

from rbxcompose.inspection.answer import Answer
from rbxcompose.inspection.wire_keys import does, keys_of, qos_of
from rbxcompose.manifest.tree import Path, at
from rbxcompose.model.robot import Part, Robot
from rbxcompose.model.wires import End, resolve
from rbxcompose.plan.model import BusPlan
from rbxcompose.sdk.ports import Calls, CallsAction, In, Looks, Out, Serves, ServesAction, ServesTopic

_OTHER = {  # the first that a port is an instance of counts
    ServesTopic: (Out, "ordered by"),
    Out: (In, "read by"),
    In: (Out, "sent by"),
    Serves: (Calls, "called by"),
    Calls: (Serves, "served by"),
    ServesAction: (CallsAction, "asked by"),
    CallsAction: (ServesAction, "served by"),
}


def why_port(robot: Robot, path: Path) -> Answer | None:
    """Return what is known of a component (`transforms`) or of one of its ports (`go_to.cmd_vel`), None if none is."""
    name, *rest = [str(key) for key in (path[1:] if path[0] in ("components", "muxes") else path)] or [""]
    part = robot.parts.get(name)
    if part is None or len(rest) > 1:
        return None
    if not rest:
        about = (part.cls.__doc__ or "").strip().partition("\n")[0]
        is_written = at(robot.manifest.root, part.path) is not None
        place = str(robot.part_span(name)) if is_written else "every robot runs it"
        return Answer(name, f"type {part.type_name}", about, hints=(("where", place),))
    end = part.end(rest[0])
    return _port(robot, part, end) if end else None


def _port(robot: Robot, part: Part, end: End) -> Answer:
    path = f"{end.instance}.{end.name}"
    if isinstance(end.port, Looks):
        return Answer(path, f"looks up '{end.port.source}' in '{end.port.target}'")
    qos = qos_of(end.port)
    value = f"{does(end.port)} {end.type_name} at {end.topic}" + (f", as {qos}" if qos else "")
    bus = robot.manifest.bus
    keys = keys_of(end.port, end.topic, BusPlan(bus.domain, bus.namespace or "", bus.port, bus.wire, bus.router))
    hints = [("because", _reason(robot, part, end)), _others(robot, end)]
    return Answer(path, value, hints=(*hints, *((label if len(keys) > 1 else "key", key) for label, key in keys)))


def _reason(robot: Robot, part: Part, end: End) -> str:
    namespace = robot.manifest.bus.namespace or ""
    for mux, entry in robot.manifest.muxes.items():
        for name, source in entry.inputs.items():
            is_taken = (source.source or "").partition(".")[0] == part.name and isinstance(end.port, Out)
            if is_taken and end.topic == resolve(f"{mux}/{name}", namespace):
                place = robot.value("muxes", mux, "inputs", name, "from")
                return f"mux '{mux}' takes it as its input '{name}' ({place})"
    connected = (*part.path, "connect", end.name)
    if at(robot.manifest.root, connected) is not None:
        return f"'connect' says so ({robot.value(*connected)})"
    if part.path[:1] == ("muxes",):
        return f"a mux and its inputs are named so ({robot.part_span(part.name)})"
    if namespace and not end.port.topic.startswith("/"):
        return f"that is its own name in the namespace '{namespace}' ({robot.value('bus', 'namespace')})"
    return f"that is its own name; 'connect: {{{end.name}: ...}}' gives it another one"


def _others(robot: Robot, end: End) -> tuple[str, str]:
    other, words = next(pair for kind, pair in _OTHER.items() if isinstance(end.port, kind))
    names = [
        f"{one.instance}.{one.name}" for one in robot.ends if one.topic == end.topic and isinstance(one.port, other)
    ]
    outside = "anything outside" if isinstance(end.port, In) and end.port.is_open else "nothing here"
    return words, ", ".join(names) or outside
