"""What can be wrong with a serial port: one class of error for each cause, and the finding that tells a person."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from rbxcompose.findings import Finding, FindingKind, Severity, Span, kind
from rbxcompose.printable import plain

_RULE = 'ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1"'
SLOW = 0.001  # [s] of an adapter's latency timer above which it delays every reply

NO_PORT = kind("RBX2201")
FORBIDDEN = kind("RBX2202")
BUSY = kind("RBX2203")
UNFIT = kind("RBX2204")
LOST = kind("RBX2205")
NO_USB_DEVICE = kind("RBX2251")
TWO_USB_DEVICES = kind("RBX2252")
SLOW_ADAPTER = kind("RBX2206", Severity.WARNING)


class PortError(Exception):
    """Raised when a serial port cannot be used; each cause has its own class, kind of finding and help."""

    kind: ClassVar[FindingKind]
    help: str = ""

    def __init__(self, path: str, problem: str, help: str = "") -> None:
        super().__init__(f"{path} {problem}")
        self.path, self.problem = path, problem
        self.help = help or self.help

    def finding(self, span: Span | None = None) -> Finding:
        """Return what to tell a person."""
        return self.kind.at(span, f"{plain(self.path)} {plain(self.problem)}", help=self.help)


class NoPortError(PortError):
    """Raised when nothing has the name of the port."""

    kind = NO_PORT
    help = "plug the adapter in, or look for it below /dev/serial/by-id"


class ForbiddenPortError(PortError):
    """Raised when the user may not open the port."""

    kind = FORBIDDEN
    help = "sudo usermod -aG dialout $USER, then log in again; or a udev rule with MODE and GROUP"


class BusyPortError(PortError):
    """Raised when another program has locked the port."""

    kind = BUSY
    help = "end the other program: 'rbxcompose ps' shows robots that run"


class UnfitPortError(PortError):
    """Raised when the file is no serial port, or does not have the baud rate."""

    kind = UNFIT
    help = "name a serial port, and a baud rate of its adapter"


class NoDeviceError(PortError):
    """Raised when the USB device of a port is not connected."""

    kind = NO_USB_DEVICE


class DeviceNotUniqueError(PortError):
    """Raised when more than one port belongs to a USB device as it is named."""

    kind = TWO_USB_DEVICES


class LostPortError(PortError):
    """Raised when an open port has gone."""

    kind = LOST
    help = "plug the adapter in again"


def slow_adapter(path: str, latency: float | None, span: Span | None = None) -> Finding | None:
    """Return the warning about an adapter whose latency timer [s] is too long, None if it is fine or unknown."""
    if latency is None or latency <= SLOW:
        return None
    words = f"the adapter of {plain(path)} holds replies back for up to {1000 * latency:.0f} ms"
    timer = f"/sys/bus/usb-serial/devices/{plain(Path(path).resolve().name)}/latency_timer"
    now = f"echo 1 | sudo tee {timer}"
    return SLOW_ADAPTER.at(span, words, help=f"{now}; to keep it, in /etc/udev/rules.d/99-servos.rules: {_RULE}")
