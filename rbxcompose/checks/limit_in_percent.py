"""A limit that is a fraction, of a number in percent."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.robot import Robot, RobotComponent
from rbxcompose.rules import WIRING
from rbxcompose.sdk.capabilities import Setting, Warns
from rbxcompose.sdk.ports import In, Out

_PERCENT = "%"


@check("RBX3511", Severity.WARNING, closed=(WIRING,))
def limit_in_percent(robot: Robot) -> Iterator[Finding]:
    """A limit is a fraction, but the number is in percent."""
    for component, warns in robot.declared(Warns):
        limits = [one for one in (warns.warn, warns.error) if one is not None and 0 < one.value < 1]
        for limit in limits if limits and component.is_sound else ():
            if writers := _in_percent(robot, component):
                yield _told(robot, component, limit, writers)


def _in_percent(robot: Robot, component: RobotComponent) -> list[str]:
    """Return who writes what a component compares, if all of that is in percent."""
    topics = {end.topic for end in component.ends if isinstance(end.port, In)}
    ends = [end for topic in topics for end in robot.writers.get(topic, ())]
    units = {end.port.unit for end in ends if isinstance(end.port, Out)}
    return [end.instance for end in ends] if units == {_PERCENT} else []


def _told(robot: Robot, component: RobotComponent, limit: Setting[float], writers: list[str]) -> Finding:
    return limit_in_percent.at(
        robot.value(*component.place(limit.field)),
        f"'{limit.field}' of '{component.name}' is {limit.value:g}, but '{writers[0]}' tells percent, from 0 to 100",
        help=f"write '{limit.field}: {100 * limit.value:g}'",
        related=[Related(robot.component_span(one), "tells percent") for one in writers],
    )
