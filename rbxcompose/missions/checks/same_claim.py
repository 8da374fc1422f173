"""Branches that need the same part of the robot."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from rbxcompose.findings import Finding, Related, Severity, Span
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.claims import claims_below
from rbxcompose.missions.analysis.examined import Examined


@mission_check("RBX4152", Severity.WARNING, closed=())
def same_claim(mission: Examined) -> Iterator[Finding]:
    """Two branches of a parallel need the same part of the robot."""
    program, robot = mission.program, mission.robot
    for node in program.nodes:
        if node.step.branches is None:
            continue
        claimed: dict[str, list[Span]] = {}  # by what is claimed, a span for each branch
        for child in node.children:
            for resource, span in dict(claims_below(program.below(child), robot)).items():
                claimed.setdefault(resource, []).append(span)
        for resource, spans in claimed.items():
            for first, second in combinations(spans, 2):
                yield same_claim.at(
                    second,
                    f"two branches that run at the same time need the {resource}",
                    help="do one after the other",
                    related=[Related(first, "the other one")],
                )
