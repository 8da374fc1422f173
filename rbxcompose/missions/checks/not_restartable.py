"""Skills that an interrupt may restart."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.program.program import END
from rbxcompose.rules import OWN


@mission_check("RBX4116", Severity.WARNING, closed=(OWN,))
def not_restartable(mission: Examined) -> Iterator[Finding]:
    """An interrupt may restart a skill that cannot be restarted."""
    cutting = [one for one in mission.program.interrupts if one.afterwards != END]
    for node in mission.program.below(mission.program.main) if cutting else ():
        skill = mission.robot.skills.get(node.skill)
        if skill and not skill.restartable and not skill.pausable:
            related = [Related(cutting[0].span, "this may cut it short")]
            afterwards = cutting[0].afterwards
            message = f"the skill '{skill.name}' cannot be restarted, but 'afterwards: {afterwards}' would do so"
            yield not_restartable.at(node.span, message, related=related)
