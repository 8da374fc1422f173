"""Whether the serial ports that a robot will open can be opened on this machine, checked before anything starts."""

from __future__ import annotations

import grp
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Span
from rbxcompose.base.printable import plain
from rbxcompose.compiler.model.flow import setting_span
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.domains.devices import serial_ports
from rbxcompose.domains.devices.usb import UsbDevice
from rbxcompose.sdk.capabilities import OpensPort


@dataclass(frozen=True, slots=True)
class PortFile:
    """What is at the path of a port: `group` owns it, `latency` [s] is how long its adapter holds replies back."""

    exists: bool = True
    is_device: bool = True
    may_open: bool = True
    group: str = ""
    latency: float | None = None


LookAt = Callable[[str], PortFile]


def port_findings(robot: Robot, ports: Sequence[serial_ports.SerialPort], look: LookAt) -> Iterator[Finding]:
    """Yield what is wrong with the ports that components open, given those that are connected."""
    for component, opens in robot.declared(OpensPort):
        yield from _of_port(opens.port.value, ports, look, setting_span(robot, (component, opens.port.field)))


def _of_port(name: str, ports: Sequence[serial_ports.SerialPort], look: LookAt, span: Span) -> Iterator[Finding]:
    path = name
    if wanted := UsbDevice.of(name):
        try:
            path = serial_ports.port_of(wanted, ports).path
        except serial_ports.PortError as error:
            yield error.finding(span)
            return
    file, shown = look(path), plain(path)
    if not file.exists:
        yield serial_ports.NO_PORT.at(
            span, f"{shown} does not exist", help=serial_ports.connected(ports, "serial port")
        )
    elif not file.is_device:
        yield serial_ports.UNFIT.at(
            span, f"{shown} is not a serial port", help=serial_ports.connected(ports, "serial port")
        )
    elif not file.may_open:
        todo = f"sudo usermod -aG {file.group or 'dialout'} $USER, then log in again"
        yield serial_ports.FORBIDDEN.at(span, f"{shown} may not be opened by this user", help=todo)
    elif warning := serial_ports.slow_adapter(path, file.latency, span):
        yield warning


def look_at(path: str) -> PortFile:
    """Return what is at a path of this machine."""
    file = Path(path)
    try:
        group = _group_name(file.stat().st_gid)
    except OSError:
        return PortFile(exists=False)
    return PortFile(
        True, file.is_char_device(), os.access(file, os.R_OK | os.W_OK), group, serial_ports.latency_of(path)
    )


def _group_name(number: int) -> str:
    try:
        return grp.getgrgid(number).gr_name
    except KeyError:
        return str(number)
