"""A pause between restarts that is never taken."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.manifest.tree import at
from rbxcompose.model.robot import Robot
from rbxcompose.units import TIME, format_quantity


@check("RBX5006", Severity.WARNING)
def shortened_pause(robot: Robot) -> Iterator[Finding]:
    """The pause before a restart is longer than it can be."""
    for component in robot.components.values():
        limits = component.restart
        longest = limits.within / limits.max
        path = (*component.path, "restart", "backoff")
        if limits.when == "on_failure" and limits.backoff > longest and at(robot.manifest.root, path) is not None:
            enough = sum(limits.backoff * 2.0**number for number in range(limits.max - 1))
            wanted, shortened = format_quantity(limits.backoff, TIME), format_quantity(longest, TIME)
            yield shortened_pause.at(
                robot.value(*path),
                f"'{component.name}' never pauses for {wanted}: {shortened} is the longest with which {limits.max} "
                f"failures fit into {format_quantity(limits.within, TIME)}",
                help=f"pauses that double from {wanted} need 'within: {format_quantity(enough, TIME)}' or more, "
                "or a lower 'max'",
            )
