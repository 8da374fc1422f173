"""Robots of a system in one simulated world: each knows the outlines of the others, and where they begin."""

import math
from collections.abc import Iterator, Mapping, MutableMapping
from dataclasses import replace
from itertools import combinations

from rbxcompose.base.findings import Finding, Related, kind
from rbxcompose.base.units import LENGTH, format_quantity
from rbxcompose.compiler.plan.model import Instance, Plan
from rbxcompose.compiler.systems.consoles import with_changes
from rbxcompose.compiler.systems.model import PlacedRobot, System
from rbxcompose.sdk.capabilities import Outline, SharesWorld
from rbxcompose.sdk.registry import declared

ROBOTS_IN_WORLD, PLACE_IN_WORLD = "world/robots", "world/place"
"""What the first robot of a world shares with the others: where all are; and each other one: where it is."""
OVERLAPPING_STARTS = kind("RBX6154")


def with_others(robots: MutableMapping[str, PlacedRobot]) -> None:
    """Give each robot the outlines of the others in its world."""
    outlines = outlines_of(robots)
    for name in outlines:
        others = {other: outline for other, outline in outlines.items() if other != name}
        changes = {instance.name: {shares.others.field: others} for instance, shares in _worlds(robots[name].plan)}
        robots[name] = replace(robots[name], plan=with_changes(robots[name].plan, changes))


def outlines_of(robots: Mapping[str, PlacedRobot]) -> dict[str, Outline]:
    """Return where the robots in the system's world begin, and their sizes."""
    return {name: shares.outline.value for name, robot in robots.items() for _, shares in _worlds(robot.plan)}


def _worlds(plan: Plan) -> Iterator[tuple[Instance, SharesWorld]]:
    for instance in plan.instances:
        for shares in declared(instance.type, instance.config, SharesWorld):
            yield instance, shares


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
