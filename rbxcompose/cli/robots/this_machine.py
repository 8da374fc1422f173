"""What `up` looks at on this machine before anything starts; `check` does not, since it may run elsewhere."""

from __future__ import annotations

from rbxcompose.actuation.serial_ports import serial_ports
from rbxcompose.cli.output.console import tell_report
from rbxcompose.compiler import Compilation
from rbxcompose.doctor.serial_ports import look_at, port_findings
from rbxcompose.findings import Report


def is_fit(compilation: Compilation) -> bool:
    """Tell what is wrong with this machine for a robot, and return whether it may start."""
    report = Report()
    if compilation.robot is not None:
        report.extend(port_findings(compilation.robot, serial_ports(), look_at))
    tell_report(report, compilation.sources)
    return not report.has_errors
