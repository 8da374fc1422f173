"""A group that is stale between two reports."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.diagnostics.settings import each_analyzer
from rbxcompose.findings import Finding
from rbxcompose.model.robot import Robot
from rbxcompose.units import TIME, format_quantity

REPORTS = 1.0  # [s] between two reports of a component's status


@check("RBX5005")
def analyzer_timeout(robot: Robot) -> Iterator[Finding]:
    """An analyzer treats its components as stale between two reports."""
    for path, analyzer in each_analyzer(robot.manifest.diagnostics.analyzers):
        if 0 < analyzer.timeout <= REPORTS:
            yield analyzer_timeout.at(
                robot.value("diagnostics", "analyzers", *path, "timeout"),
                f"analyzer '{path[-1]}' considers its components stale before they report again",
                label=f"they report every {format_quantity(REPORTS, TIME)}",
                help="make it several seconds, or omit it for 5 s",
            )
