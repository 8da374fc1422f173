"""Names on the bus whose ends never meet."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.base.findings import Finding, kind
from rbxcompose.base.printable import plain
from rbxcompose.tools.doctor import HostFacts, examination

CLASH = kind("RBX9408")


@examination
def clashes(facts: HostFacts) -> Iterator[str | Finding]:
    """Compare types and hashes of all ends of each name."""
    for robot in (running_robot for running_robot in facts.running if running_robot.bus is not None):
        graph = robot.bus.graph if robot.bus else None
        names = [*graph.topics, *graph.services, *graph.actions] if graph else []
        for name in (name for name in names if name.clash):
            words = f"{plain(name.name)} of '{robot.name}' has {plain(name.clash, 400)}"
            yield CLASH.at(None, words, help=f"'rbxcompose topic show {plain(name.name)}' shows which end has which")
        if not any(name.clash for name in names):
            yield f"{robot.name}: all ends of {len(names)} names agree in their types"
