"""A number that is compared with no limit."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.robot import Robot
from rbxcompose.sdk.capabilities import Warns


@check("RBX3510", Severity.WARNING, closed=())
def no_limit(robot: Robot) -> Iterator[Finding]:
    """A component compares a number with no limit."""
    for component in robot.components.values():
        limits = component.declared(Warns)
        if limits and component.is_sound and all(one.warn is None and one.error is None for one in limits):
            keys = [name for name in type(component.config).model_fields if name.startswith(("warn", "error"))]
            yield no_limit.at(
                robot.component_span(component.name),
                f"'{component.name}' compares its number with no limit",
                help=f"give it one: {', '.join(keys)}",
            )
