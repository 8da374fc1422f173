"""What can be wrong with a serial port: one class of error for each cause, and the finding that tells a person."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from rbxcompose.findings import Finding, FindingKind, Severity, Span, kind
from rbxcompose.printable import plain

_RULE = 'ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1"'
SLOW = 0.001  # [s] of an adapter's latency timer above which it delays every reply

NO_PORT = kind(
    "RBX2201",
    """The serial port does not exist

The adapter is not plugged in, or the system has given it another name. Names below `/dev/serial/by-id` stay the same.

Bad: `rbxcompose servo scan --port /dev/ttyUSB7`
Good: `rbxcompose servo scan --port /dev/serial/by-id/usb-FTDI_USB__-__Serial_Converter_FT4THV5C-if00-port0`
""",
)
FORBIDDEN = kind(
    "RBX2202",
    """This user may not open the serial port

Serial ports belong to a group, usually `dialout`. After you join it, log in again. A udev rule with `MODE="0660"` and
`GROUP="dialout"` gives the port to that group.

Bad: `sudo rbxcompose servo scan --port /dev/ttyUSB0`
Good: `sudo usermod -aG dialout $USER`
""",
)
BUSY = kind(
    "RBX2203",
    """Another program uses the serial port

Two programs on one bus of servos would destroy each other's packets.

Bad: `rbxcompose servo scan` while the robot runs.
Good: `rbxcompose down` first.
""",
)
UNFIT = kind(
    "RBX2204",
    """The serial port cannot be used in this way

It is not a serial port, or its adapter does not have this baud rate.

Bad: `rbxcompose servo scan --port /dev/null`
Good: `rbxcompose servo scan --port /dev/ttyUSB0`
""",
)
LOST = kind(
    "RBX2205",
    """The serial port has gone

The adapter was unplugged while it was in use, or has lost its power.

Bad: a plug that carries the weight of its cable.
Good: a plug that is screwed or tied down.
""",
)
NO_USB_DEVICE = kind(
    "RBX2251",
    """The USB device of a port is not connected

The port names a device by vendor, product and serial number, and none of the devices that are connected has them.
`lsusb` lists all devices, `udevadm info /dev/ttyUSB0` tells the serial number of one.

Bad: `devices: {adapter: {vendor: 0403, product: 6001}}`, for an adapter with `ID 0403:6014` in `lsusb`.
Good: `devices: {adapter: {vendor: 0403, product: 6014}}`
""",
)
TWO_USB_DEVICES = kind(
    "RBX2252",
    """More than one USB device is meant

Two adapters of one kind differ only by their serial numbers. Those that have none, or all the same, are told apart by
the USB port where they are plugged in (`usb_port`), the ports of one adapter by `interface`. `rbxcompose udev scan`
shows all of this, and writes the entries.

Bad: `devices: {adapter: {vendor: 0403, product: 6014}}`, with two such adapters connected.
Good: `devices: {adapter: {vendor: 0403, product: 6014, serial: FT4THV5C}}`
""",
)
SLOW_ADAPTER = kind(
    "RBX2206",
    """The adapter holds replies back

FTDI adapters collect what comes from the servos for the time of their latency timer, 16 ms as they are sold, so that
fewer than 60 requests fit into a second. 1 ms is best: write it now, and let a udev rule keep it. `doctor` looks at all
adapters, `up` and `servo` at those that they open.

Bad: `cat /sys/bus/usb-serial/devices/ttyUSB0/latency_timer` shows 16.
Good: `echo 1 | sudo tee /sys/bus/usb-serial/devices/ttyUSB0/latency_timer`, and
`ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1"` in
`/etc/udev/rules.d/99-servos.rules`
""",
    Severity.WARNING,
)


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
