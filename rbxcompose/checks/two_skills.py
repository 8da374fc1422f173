"""Two actions or topics that would be the same skill."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related
from rbxcompose.model.robot import Robot
from rbxcompose.model.wires import PortEnd
from rbxcompose.rules import WIRING
from rbxcompose.sdk.ports import ServesAction, ServesTopic


@check("RBX3024", closed=(WIRING,))
def two_skills(robot: Robot) -> Iterator[Finding]:
    """Two actions are the same skill."""
    first: dict[str, PortEnd] = {}
    for end in robot.ends:
        if not isinstance(end.port, ServesAction | ServesTopic) or not (skill := end.skill):
            continue
        other = first.setdefault(skill, end)
        if other.topic != end.topic:
            yield two_skills.at(
                robot.end_span(end),
                f"'{end.topic}' and '{other.topic}' are both the skill '{skill}'",
                help=f"give one of them another last word: 'connect: {{{end.name}: {skill}_{end.instance}}}'",
                related=[Related(robot.end_span(other), f"that of '{other.instance}'")],
            )
