"""A plan for people: what would run, in which process and order, and where it would be on the bus."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rbxcompose.inspection.wire_keys import does, keys_of, qos_of
from rbxcompose.levels import Level, log_word
from rbxcompose.plan.model import Instance, Plan, Wire, extent
from rbxcompose.restarts import Restart
from rbxcompose.sdk.ports import Looks, Port
from rbxcompose.sdk.registry import component_type

_NUMBER = 4  # width of a position in the start order


def plan_text(plan: Plan, *, with_keys: bool = False) -> str:
    """Return what `up` would do: processes with their components in start order, and the keys on the wire if wanted."""
    return "\n".join(_lines(plan, with_keys))


def _lines(plan: Plan, with_keys: bool) -> Iterator[str]:
    how = "simulated" if plan.is_simulated else "real devices"
    yield f"{plan.robot}: {extent(len(plan.instances), len(plan.groups))}, {how}"
    yield from (f"  {label:<8}{text}" for label, text in _facts(plan))
    order = {instance.name: number for number, instance in enumerate(plan.instances, 1)}
    for group in plan.groups:
        yield ""
        yield f"process {group}"
        for instance in plan.of_group(group):
            yield f"{order[instance.name]:>{_NUMBER}} {instance.name} ({', '.join(_options(instance))})"
            yield from (f"{'':<{_NUMBER}}   {line}" for line in _wires(plan, instance, with_keys))


def _facts(plan: Plan) -> Iterator[tuple[str, str]]:
    bus = plan.bus
    own = "by sockets of this user only" if bus.access == "user" else f"at port {bus.port}, or the next free one"
    router = bus.router or f"its own {own}"
    through = ", through which all messages go" if bus.links == "router" else ""
    namespace = f"namespace {bus.namespace}" if bus.namespace else "no namespace"
    yield "bus", f"domain {bus.domain}, {namespace}, wire format {bus.wire}"
    yield "router", f"{router}{through}"
    if plan.follows_clock:
        yield "time", "follows /clock, which is published from outside"
    yield "mission", f"{plan.start}, as soon as everything is active" if plan.start else "none starts by itself"


def _options(instance: Instance) -> Iterator[str]:
    yield instance.type
    if instance.starts_after:
        yield f"after {', '.join(instance.starts_after)}"
    if instance.log is not Level.OK:
        yield f"logs {log_word(instance.log)} and above"
    if instance.restart != Restart():
        yield f"restarts: {instance.restart.when}, at most {instance.restart.max} within {instance.restart.within:g} s"


def _wires(plan: Plan, instance: Instance, with_keys: bool) -> Iterator[str]:
    ports: dict[str, Port[Any]] = component_type(instance.type).ports(instance.config)
    for wire in instance.wires:
        port = ports.get(wire.port)
        if port is not None:
            yield _wire(wire, port)
            keys = keys_of(port, wire.topic, plan.bus) if with_keys else []
            yield from (f"    {f'{what}: ' if len(keys) > 1 else ''}{key}" for what, key in keys)


def _wire(wire: Wire, port: Port[Any]) -> str:
    if isinstance(port, Looks):
        return f"{does(port)} '{port.source}' in '{port.target}'"
    qos = f" as {qos_of(port)}" if qos_of(port) else ""
    return f"{does(port)} {wire.topic} ({wire.type}){qos}"
