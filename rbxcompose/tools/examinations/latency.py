"""How long USB adapters of servos hold replies back."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.base.findings import Finding
from rbxcompose.domains.devices.serial_ports import slow_adapter
from rbxcompose.tools.doctor import HostFacts, examination


@examination
def latency(facts: HostFacts) -> Iterator[str | Finding]:
    """Check the latency timer of each adapter that has one."""
    for path, seconds in sorted(facts.latencies.items()):
        yield slow_adapter(path, seconds) or f"the adapter of {path} passes replies on after {1000 * seconds:.0f} ms"
    if not facts.latencies:
        yield "no USB adapter has a latency timer"
