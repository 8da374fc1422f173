"""Names on the bus whose ends never meet."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.doctor.facts import HostFacts
from rbxcompose.doctor.registry import examination
from rbxcompose.findings import Finding, kind
from rbxcompose.printable import plain

CLASH = kind("RBX9408")


@examination
def clashes(facts: HostFacts) -> Iterator[str | Finding]:
    """Compare types and hashes of all ends of each name."""
    for one in (one for one in facts.running if one.bus is not None):
        graph = one.bus.graph if one.bus else None
        names = [*graph.topics, *graph.services, *graph.actions] if graph else []
        for name in (name for name in names if name.clash):
            words = f"{plain(name.name)} of '{one.name}' has {plain(name.clash, 400)}"
            yield CLASH.at(None, words, help=f"'rbxcompose topic show {plain(name.name)}' shows which end has which")
        if not any(name.clash for name in names):
            yield f"{one.name}: all ends of {len(names)} names agree in their types"
