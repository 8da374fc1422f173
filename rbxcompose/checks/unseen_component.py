"""A component that no analyzer shows."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.checks.shortened_list import dropped, taken_out
from rbxcompose.diagnostics.conditions import fits, matches
from rbxcompose.diagnostics.settings import each_analyzer
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.manifest.tree import SequenceNode
from rbxcompose.manifest.walk import REPLACE
from rbxcompose.model.robot import Robot


@check("RBX5002", Severity.WARNING)
def unseen_component(robot: Robot) -> Iterator[Finding]:
    """A component belongs to no group of the diagnostics."""
    settings = robot.manifest.diagnostics
    groups = [one for _, one in each_analyzer(settings.analyzers)]
    told = [one for group in groups for one in (*group.conditions, *group.expected)]
    lost = taken_out(robot)
    meant = (name for name, step in lost.items() if isinstance(step.node, SequenceNode) and step.node.tag == REPLACE)
    named = {*dropped(robot), *meant, *(one for one in told if isinstance(one, str))}
    for name in robot.written - named if groups else ():
        is_left = not any(fits(one, name) for one in settings.ignore) and not any(matches(g, name) for g in groups)
        if name in robot.components and is_left and not any(group.kind == "other" for group in groups):
            here, step = robot.component_span(name), lost.get(name)
            by = f": {step.layer} has replaced the list that did" if step else ""
            yield unseen_component.at(
                step.span if step else here,
                f"no analyzer matches '{name}'{by}",
                help=f"put it into the 'match' of one of them: {', '.join(settings.analyzers)}",
                related=[Related(here, "the component")] if step else [],
            )
