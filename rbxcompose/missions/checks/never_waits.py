"""Endless loops that take no time."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding, Severity
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.rules import OWN


@mission_check("RBX4107", Severity.WARNING, closed=(OWN,))
def never_waits(mission: Examined) -> Iterator[Finding]:
    """An endless loop never waits."""
    for view in mission.views:
        node = view.node
        if view.waits:
            continue
        ends = mission.ending.of(node.number)
        for advice in (node.step.endless(ends), *(one.endless for one in node.modifiers.values())):
            if advice:
                yield never_waits.at(node.span, advice.message, help=advice.help)
