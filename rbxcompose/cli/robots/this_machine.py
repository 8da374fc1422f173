"""What `up` looks at on this machine before anything starts; `check` does not, since it may run elsewhere."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib.util import find_spec

from rbxcompose.cli.output.console import tell_report
from rbxcompose.devices.serial_ports import serial_ports
from rbxcompose.doctor.serial_ports import look_at, port_findings
from rbxcompose.findings import Finding, Report, kind
from rbxcompose.model.robot import Robot
from rbxcompose.sdk.capabilities import NeedsExtra

NO_EXTRA = kind("RBX2253")


def is_fit(robot: Robot, sources: Mapping[str, str]) -> bool:
    """Tell what is wrong with this machine for a robot, and return whether it may start."""
    report = Report([*missing_extras(robot), *port_findings(robot, serial_ports(), look_at)])
    tell_report(report, sources)
    return not report.has_errors


def missing_extras(robot: Robot) -> Iterator[Finding]:
    """Yield a finding for each component whose extra is not installed."""
    for component, needed in robot.declared(NeedsExtra):
        if find_spec(needed.module.value) is None:
            message = f"'{component.name}' needs the package '{needed.module.value}', which is not installed"
            help_text = f"pip install 'rbxcompose[{needed.extra.value}]'"
            yield NO_EXTRA.at(robot.component_span(component.name), message, help=help_text)
