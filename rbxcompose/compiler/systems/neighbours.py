"""What robots of a system know of each other: where their pages are and, in one simulated world, their outlines."""

import math
from collections.abc import Collection, Iterator, Mapping, MutableMapping
from dataclasses import replace
from itertools import combinations
from typing import Any, TypeVar

from rbxcompose.base.findings import Finding, Related, kind
from rbxcompose.base.units import LENGTH, format_quantity
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.compiler.systems.model import PlacedRobot, System, next_port
from rbxcompose.sdk.capabilities import Capability, Outline, ServesPage, SharesWorld
from rbxcompose.sdk.registry import declared

K = TypeVar("K", bound=Capability)


def ports_of(plan: Plan) -> set[int]:
    """Return the ports of the pages of a robot."""
    return {page.port.value for _, page in _declared_in(plan, ServesPage)}


def with_free_ports(plan: Plan, taken: Collection[int]) -> Plan:
    """Return a plan whose pages have their own ports, or the next ones that no robot before it has."""
    moved = {
        instance.name: {page.port.field: next_port(page.port.value, taken)}
        for instance, page in _declared_in(plan, ServesPage)
    }
    return with_changes(plan, moved)


def with_fleet(system: System, robot: PlacedRobot, host: str, plan: Plan) -> Plan:
    """Return what a host runs of a robot, whose pages know those of all robots of the system.

    They are written `ADDRESS:PORT`, without an address if they are on the same host.
    """
    fleet: dict[str, str] = {}
    for other in system.robots.values():
        for instance, page in _declared_in(other.plan, ServesPage):
            there = other.hosts[instance.name]
            address = "" if there == host else system.hosts[there].address
            if address is not None:
                fleet[other.name] = f"{address}:{page.port.value}"
    if len(system.robots) == 1:
        return plan
    return with_changes(plan, {one.name: {page.fleet.field: fleet} for one, page in _declared_in(plan, ServesPage)})


def _declared_in(plan: Plan, kind: type[K]) -> Iterator[tuple[Instance, K]]:
    """Yield the capabilities of a kind of all components, each with the component."""
    for instance in plan.instances:
        yield from ((instance, capability) for capability in declared(instance.type, instance.config, kind))


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


ROBOTS_IN_WORLD, PLACE_IN_WORLD = "world/robots", "world/place"
"""What the first robot of a world shares with the others: where all are; and each other one: where it is."""
OVERLAPPING_STARTS = kind("RBX6154")


def with_others(robots: MutableMapping[str, PlacedRobot]) -> None:
    """Give each robot the outlines of the others in its world."""
    outlines = outlines_of(robots)
    for name in outlines:
        others = {other: outline for other, outline in outlines.items() if other != name}
        changes = {
            instance.name: {shares.others.field: others}
            for instance, shares in _declared_in(robots[name].plan, SharesWorld)
        }
        robots[name] = replace(robots[name], plan=with_changes(robots[name].plan, changes))


def outlines_of(robots: Mapping[str, PlacedRobot]) -> dict[str, Outline]:
    """Return where the robots in the system's world begin, and their sizes."""
    return {
        name: shares.outline.value
        for name, robot in robots.items()
        for _, shares in _declared_in(robot.plan, SharesWorld)
    }


def overlapping_starts(system: System) -> Iterator[Finding]:
    """Yield a finding for each robot that begins where another one does."""
    found = set[str]()
    for (first, one), (second, other) in combinations(outlines_of(system.robots).items(), 2):
        room = math.hypot(one[0] - other[0], one[1] - other[1]) - one[3] - other[3]
        if room >= 0 or second in found:
            continue
        found.add(second)
        spans = [system.robots[name].span(system.root, "spawn") for name in (second, first)]
        yield OVERLAPPING_STARTS.at(
            spans[0],
            f"'{first}' and '{second}' begin {format_quantity(round(-room, 2), LENGTH)} deep in each other",
            help="choose another 'spawn', or add one to the world",
            related=[Related(spans[1], "the other one")],
        )
