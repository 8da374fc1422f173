"""Which components depend on which others, by the wires of a plan, and which are on the path of commands."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from rbxcompose.plan.model import Instance, Plan, Wire
from rbxcompose.qos import Qos
from rbxcompose.sdk.ports import Calls, CallsAction, In, Out, Serves, ServesAction
from rbxcompose.sdk.registry import component_type

_FED_BY = {In.kind: Out.kind, Calls.kind: Serves.kind, CallsAction.kind: ServesAction.kind}


def blocked_by(plan: Plan, failed: Collection[str]) -> dict[str, str]:
    """Return the components that cannot work because all that serve or feed a port have failed: name -> one of those.

    An input that is open to the outside waits for none. A component that starts after a failed one waits for it, too.
    """
    found: dict[str, str] = {}
    for one in plan.instances if failed else ():
        if one.name not in failed and (cause := _cause(plan, one, failed)):
            found[one.name] = cause
    return found


def _cause(plan: Plan, one: Instance, failed: Collection[str]) -> str:
    late = [name for name in one.starts_after if name in failed]
    if late:
        return late[0]
    for wire in _needed(one):
        feeding = [other.name for other in plan.everywhere if _feeds(other, wire)]
        if feeding and all(name in failed for name in feeding):
            return feeding[0]
    return ""


def _needed(one: Instance) -> list[Wire]:
    ports = component_type(one.type).ports(one.config)
    wires = (wire for wire in one.wires if wire.kind in _FED_BY)
    return [wire for wire in wires if not getattr(ports[wire.port], "is_open", False)]


def _feeds(other: Instance, wanted: Wire) -> bool:
    kind = _FED_BY[wanted.kind]
    return any(wire.kind == kind and wire.topic == wanted.topic and wire.type == wanted.type for wire in other.wires)


def is_commanding(one: Instance) -> bool:
    """Return whether an instance sends, passes on or receives commands: a driver, a mux, a base."""
    ports = component_type(one.type).ports(one.config).values()
    return any(isinstance(port, In | Out) and port.qos is Qos.COMMAND for port in ports)


def blocked_text(causes: Mapping[str, str], name: str) -> str:
    """Return in words what a component waits for."""
    return f"waits for {causes[name]}, which failed"
