"""Numbers of missions that are fractions, for what counts in percent."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.missions.analysis.effects import called, published
from rbxcompose.missions.analysis.facts import Constants, number_of
from rbxcompose.missions.program.messages import MessageTemplate, TemplateShape, WrittenValue
from rbxcompose.model.charge import constants
from rbxcompose.model.robot import Robot
from rbxcompose.model.wires import PortEnd, resolve
from rbxcompose.rules import WIRING
from rbxcompose.sdk.ports import In, Serves

_PERCENT = "%"


@check("RBX4188", Severity.WARNING, closed=(WIRING,))
def fraction_of_percent(robot: Robot) -> Iterator[Finding]:
    """A mission sends a fraction to what counts in percent."""
    takers = {(type(one.port) is Serves, one.topic): one for one in robot.ends if _unit(one) == _PERCENT}
    for mission in robot.missions.values() if takers else ():
        known = constants(mission)
        for node in mission.program.nodes:
            sent = [*((True, one) for one in called(node)), *((False, one) for one in published(node))]
            for is_call, message in sent:
                if taker := takers.get((is_call, resolve(message.target.text, robot.manifest.bus.namespace or ""))):
                    yield from _told(robot, taker, message, known)


def _unit(end: PortEnd) -> str:
    return end.port.unit if isinstance(end.port, In | Serves) else ""


def _told(robot: Robot, taker: PortEnd, message: MessageTemplate, known: Constants) -> Iterator[Finding]:
    for value in _values(message.body):
        number = number_of(value.expression, known)
        if number is not None and 0.0 < number <= 1.0:
            yield fraction_of_percent.at(
                value.scalar.span,
                f"'{taker.instance}' takes percent, from 0 to 100: {number:g} is almost nothing",
                help=f"write {100 * number:g}",
                related=[Related(robot.component_span(taker.instance), "takes percent")],
            )


def _values(shape: TemplateShape | None) -> Iterator[WrittenValue]:
    match shape:
        case WrittenValue():
            yield shape
        case Mapping():
            for inner in shape.values():
                yield from _values(inner)
