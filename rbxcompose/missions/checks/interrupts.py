"""Interrupts, and what they restart."""

from collections.abc import Iterator

from rbxcompose.base.findings import OWN, Finding, Related, Severity
from rbxcompose.missions.analysis.check_runner import mission_check
from rbxcompose.missions.analysis.examined import Examined
from rbxcompose.missions.program.program import END


@mission_check("RBX4116", Severity.WARNING, closed=(OWN,))
def not_restartable(mission: Examined) -> Iterator[Finding]:
    """An interrupt may restart a skill that cannot be restarted."""
    cutting = [interrupt for interrupt in mission.program.interrupts if interrupt.afterwards != END]
    for node in mission.program.below(mission.program.main) if cutting else ():
        skill = mission.robot.skills.get(node.skill)
        if skill and not skill.restartable and not skill.pausable:
            related = [Related(cutting[0].span, "this may cut it short")]
            afterwards = cutting[0].afterwards
            message = f"the skill '{skill.name}' cannot be restarted, but 'afterwards: {afterwards}' would do so"
            yield not_restartable.at(node.span, message, related=related)


@mission_check("RBX4171", Severity.WARNING, closed=())
def same_interrupt(mission: Examined) -> Iterator[Finding]:
    """Two interrupts have the same condition."""
    first: dict[str, int] = {}
    interrupts = mission.program.interrupts
    for index, interrupt in enumerate(interrupts):
        other = interrupts[first.setdefault(interrupt.when.expression.text, index)]
        if other is not interrupt:
            yield same_interrupt.at(
                interrupt.when.scalar.span,
                f"'{interrupt.name}' has the condition of '{other.name}'",
                help="change the condition, or put both reactions into one",
                related=[Related(other.when.scalar.span, "the first one")],
            )


@mission_check("RBX4145", is_fixable=True)
def unknown_target(mission: Examined) -> Iterator[Finding]:
    """An interrupt restarts something that does not exist."""
    known = {name for node in mission.program.nodes for name in (node.name, node.item) if name}
    for interrupt in mission.program.interrupts:
        named = interrupt.restarts
        if named and not interrupt.targets and not mission.program.is_open:
            message = f"nothing in the mission is named '{named.text}'"
            yield unknown_target.misspelt(named.span, message, named.text, known, "names of the mission")
