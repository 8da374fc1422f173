"""The pages of a system's robots: each has a port of its own, and shows where those of the others are."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from typing import Any

from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.compiler.systems.model import PlacedRobot, System, next_port
from rbxcompose.sdk.capabilities import ServesPage
from rbxcompose.sdk.registry import declared


def ports_of(plan: Plan) -> set[int]:
    """Return the ports of the pages of a robot."""
    return {page.port.value for _, page in _pages(plan)}


def with_free_ports(plan: Plan, taken: Collection[int]) -> Plan:
    """Return a plan whose pages have their own ports, or the next ones that no robot before it has."""
    moved = {instance.name: {page.port.field: next_port(page.port.value, taken)} for instance, page in _pages(plan)}
    return with_changes(plan, moved)


def with_fleet(system: System, robot: PlacedRobot, host: str, plan: Plan) -> Plan:
    """Return what a host runs of a robot, whose pages know those of all robots of the system.

    They are written `ADDRESS:PORT`, without an address if they are on the same host.
    """
    fleet: dict[str, str] = {}
    for other in system.robots.values():
        for instance, page in _pages(other.plan):
            there = other.hosts[instance.name]
            address = "" if there == host else system.hosts[there].address
            if address is not None:
                fleet[other.name] = f"{address}:{page.port.value}"
    if len(system.robots) == 1:
        return plan
    return with_changes(plan, {instance.name: {page.fleet.field: fleet} for instance, page in _pages(plan)})


def _pages(plan: Plan) -> Iterator[tuple[Instance, ServesPage]]:
    for instance in plan.instances:
        for page in declared(instance.type, instance.config, ServesPage):
            yield instance, page


def with_changes(plan: Plan, changes: Mapping[str, Mapping[str, Any]]) -> Plan:
    """Return a plan in which some instances have other values in their configuration."""
    if not changes:
        return plan
    instances = (
        replace(instance, config=instance.config.model_copy(update=changes[instance.name]))
        if instance.name in changes
        else instance
        for instance in plan.instances
    )
    return replace(plan, instances=tuple(instances))
