"""A limit of less than one percent."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.config import Dimensioned
from rbxcompose.findings import Finding, Severity
from rbxcompose.model.flow import is_written
from rbxcompose.model.robot import Robot, RobotComponent
from rbxcompose.sdk.capabilities import Drains, Warns
from rbxcompose.units import RATIO

_LEAST = 0.01


@check("RBX3515", Severity.WARNING, closed=())
def tiny_share(robot: Robot) -> Iterator[Finding]:
    """A limit is less than one percent."""
    for component in robot.components.values():
        levels: list[Warns | Drains] = [*component.declared(Warns), *component.declared(Drains)]
        for limit in (each for one in levels for each in (one.warn, one.error) if component.is_sound):
            is_tiny = limit is not None and 0.0 < limit.value < _LEAST and _is_share(component, limit.field)
            if limit and is_tiny and is_written(robot, component, limit.field):
                yield tiny_share.at(
                    robot.value(*component.place(limit.field)),
                    f"'{limit.field}' of '{component.name}' is {100.0 * limit.value:.3g} %, almost nothing",
                    help=f"write '{1e4 * limit.value:.3g} %', if that is meant",
                )


def _is_share(component: RobotComponent, field: str) -> bool:
    known = type(component.config).model_fields.get(field)
    return known is not None and any(isinstance(one, Dimensioned) and one.dimension == RATIO for one in known.metadata)
