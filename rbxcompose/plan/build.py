"""From a checked robot to its plan."""

from __future__ import annotations

from rbxcompose.model.order import start_order
from rbxcompose.model.robot import Part, Robot
from rbxcompose.plan.model import BusPlan, Instance, Plan, Wire
from rbxcompose.sdk.capabilities import RunsMissions


def build_plan(robot: Robot) -> Plan:
    """Return what `up` has to do; the robot must be without errors."""
    manifest = robot.manifest
    missions = (part.name for part, _ in robot.declared(RunsMissions))
    last = [name for name in missions if name not in robot.written]  # starts when everything else is active
    order = start_order({name: part.starts_after for name, part in robot.parts.items() if name not in last})
    bus = manifest.bus
    return Plan(
        robot=manifest.name,
        file=str(manifest.path),
        instances=tuple(_instance(robot.parts[name]) for name in (*order, *last)),
        bus=BusPlan(bus.domain, bus.namespace or "", bus.port, bus.wire, bus.router, bus.clock),
        start=manifest.start,
        is_simulated=manifest.is_simulated,
    )


def _instance(part: Part) -> Instance:
    wires = tuple(Wire(end.name, end.port.kind, end.topic, end.type_name) for end in part.ends)
    after, restart = part.starts_after, part.restart
    return Instance(part.name, part.type_name, part.config, part.process, after, wires, restart, part.log)
