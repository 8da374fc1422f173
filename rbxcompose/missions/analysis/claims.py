"""Which parts of the robot the branches of a parallel need exclusively at the same time."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Span
from rbxcompose.missions.program.program import MissionNode, Program, RobotNames


def claims_of(program: Program, robot: RobotNames, within: tuple[str, ...] = ()) -> frozenset[str]:
    """Return everything that a mission claims, including what the missions it uses claim."""
    return frozenset(name for name, _ in claims_below(program.nodes, robot, within))


def claims_below(
    nodes: tuple[MissionNode, ...], robot: RobotNames, within: tuple[str, ...] = ()
) -> Iterator[tuple[str, Span]]:
    """Yield the claims of nodes, each with its span; `within` are missions that are already being examined."""
    for node in nodes:
        skill = robot.skills.get(node.skill)
        if skill and skill.claims:
            yield skill.claims, node.span
        name = node.step.uses.text if node.step.uses else ""
        if name in robot.missions and name not in within:
            if name not in robot.claims:
                robot.claims[name] = claims_of(robot.missions[name], robot, (*within, name))
            for claim in robot.claims[name]:
                yield claim, node.span
