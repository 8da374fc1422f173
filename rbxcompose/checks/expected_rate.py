"""A monitor that expects another rate than its source declares."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.check_runner import check
from rbxcompose.findings import Finding, Related, Severity
from rbxcompose.model.flow import setting_span
from rbxcompose.model.robot import Robot
from rbxcompose.sdk.capabilities import ExpectsRate
from rbxcompose.sdk.ports import Out
from rbxcompose.units import FREQUENCY, format_quantity


@check("RBX5016", Severity.WARNING)
def expected_rate(robot: Robot) -> Iterator[Finding]:
    """A monitor expects another rate than its source declares."""
    for monitor, expects in robot.declared(ExpectsRate):
        end = monitor.end(expects.port)
        for writer in robot.writers.get(end.topic, ()) if end else ():
            sent = writer.port.rate if isinstance(writer.port, Out) else None
            wrong = expects.missed_by(sent) if sent is not None else None
            if wrong is None or sent is None:
                continue
            yield expected_rate.at(
                setting_span(robot, (monitor, wrong.field)),
                f"'{monitor.name}' expects {format_quantity(wrong.value, FREQUENCY)}, "
                f"but '{writer.instance}' publishes '{writer.topic}' at {format_quantity(sent, FREQUENCY)}",
                help=f"write '{format_quantity(sent, FREQUENCY)}', or change the source",
                related=[Related(robot.component_span(writer.instance), "the source")],
            )
