"""From a checked robot to its plan."""

from rbxcompose.compiler.model.flow import start_order
from rbxcompose.compiler.model.robot import Robot, RobotComponent
from rbxcompose.compiler.plan.model import BusPlan, Instance, Plan, Wire
from rbxcompose.sdk.capabilities import RunsMissions


def build_plan(robot: Robot) -> Plan:
    """Return the plan for `up`; the robot must have no errors."""
    manifest = robot.manifest
    missions = (component.name for component, _ in robot.declared(RunsMissions))
    last = [name for name in missions if name not in robot.written]  # starts when everything else is active
    order = start_order(
        {name: component.starts_after for name, component in robot.components.items() if name not in last}
    )
    bus = manifest.bus
    return Plan(
        robot=manifest.name,
        file=str(manifest.path),
        instances=tuple(_instance(robot.components[name]) for name in (*order, *last)),
        bus=BusPlan(bus.domain, bus.namespace or "", bus.port, bus.wire, bus.router, bus.clock, bus.access, bus.links),
        start=manifest.start,
        is_simulated=manifest.is_simulated,
        messages=dict(manifest.messages),
    )


def _instance(component: RobotComponent) -> Instance:
    wires = tuple(Wire(end.name, end.port.kind, end.topic, end.type_name) for end in component.ends)
    after, restart = component.starts_after, component.restart
    return Instance(
        component.name,
        component.type_name,
        component.config,
        component.process,
        after,
        wires,
        restart,
        component.log,
        component.bounds,
    )
