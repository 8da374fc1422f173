"""A component that a section of the manifest runs by itself."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.robot import Robot


@check("RBX3016", Severity.WARNING, closed=())
def own_component(robot: Robot) -> Iterator[Finding]:
    """A component is listed that a section runs by itself."""
    for component in robot.components.values():
        if component.path[:1] == ("components",) and component.cls.made_by:
            yield own_component.at(
                robot.value(*component.path, "type"),
                f"'{component.name}' of the type '{component.type_name}' does not belong under 'components'",
                help="remove it. " + component.cls.made_by.replace("`", "'"),
            )
