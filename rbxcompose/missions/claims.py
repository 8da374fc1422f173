"""Which parts of the robot the branches of a parallel need for themselves at the same time."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import TYPE_CHECKING

from rbxcompose.findings import Finding, Related, Span
from rbxcompose.missions import deed_codes
from rbxcompose.missions.calling import UseOptions

if TYPE_CHECKING:
    from rbxcompose.missions.program import Node, Program, RobotNames
    from rbxcompose.missions.views import View


def check_claims(view: View) -> Iterator[Finding]:
    """Yield the branches of a parallel that claim what another one claims."""
    claimed = [dict(_claims(view.program.below(child), view.robot)) for child in view.node.children]
    for first, second in combinations(claimed, 2):
        for resource in first.keys() & second.keys():
            yield deed_codes.SAME_CLAIM.at(
                second[resource],
                f"two branches that run at the same time need the {resource}",
                help="do one after the other",
                related=[Related(first[resource], "the other one")],
            )


def claims_of(program: Program, robot: RobotNames, within: tuple[str, ...] = ()) -> frozenset[str]:
    """Return what a mission claims with all that it uses."""
    return frozenset(name for name, _ in _claims(program.nodes, robot, within))


def _claims(nodes: tuple[Node, ...], robot: RobotNames, within: tuple[str, ...] = ()) -> Iterator[tuple[str, Span]]:
    for node in nodes:
        skill = robot.skills.get(node.skill)
        if skill and skill.claims:
            yield skill.claims, node.span
        if isinstance(node.options, UseOptions) and node.options.mission not in within:
            name = node.options.mission
            if name in robot.missions:
                for claim in claims_of(robot.missions[name], robot, (*within, name)):
                    yield claim, node.span
