"""The serial ports of this machine, and the USB devices behind them, as the kernel lists them below a root folder.

A port is named by its path, or by its device as `usb:VENDOR:PRODUCT` or `usb:VENDOR:PRODUCT:SERIAL`, which stays the
same when the device comes back under another number.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Self

from rbxcompose.actuation.port_errors import DeviceNotUniqueError, NoDeviceError
from rbxcompose.dataclass import dataclass
from rbxcompose.printable import plain

ROOT = Path("/")
_USB = "usb:"
_TTYS = ("*:*/tty/tty*", "*:*/*/tty/tty*")  # below a device: of a modem (ttyACM), of a converter (ttyUSB)
_LONGEST = 300  # characters of a port as it is shown
_ONBOARD = ("ttyAMA", "ttyTHS", "ttymxc")


@dataclass(frozen=True, slots=True)
class UsbDevice:
    """A USB device: vendor and product in four hexadecimal digits each, and its serial number, if it has one."""

    vendor: str
    product: str
    serial: str = ""

    @classmethod
    def of(cls, name: str) -> Self | None:
        """Return the device that the name of a port gives; None if it is a path."""
        return cls(*name.removeprefix(_USB).split(":", 2)) if name.startswith(_USB) and name.count(":") > 1 else None

    @property
    def port(self) -> str:
        """Return the name of its port."""
        return _USB + ":".join(one for one in (self.vendor, self.product, self.serial) if one)

    @property
    def shown(self) -> str:
        """Return it for people, as `lsusb` writes it."""
        return plain(f"{self.vendor}:{self.product}{f' {self.serial}' if self.serial else ''}")

    def is_meant_by(self, wanted: UsbDevice) -> bool:
        """Tell whether it is the wanted device, whose serial number may be left open."""
        own, other = (f"{one.vendor}:{one.product}".casefold() for one in (self, wanted))
        return own == other and wanted.serial in ("", self.serial)


@dataclass(frozen=True, slots=True)
class SerialPort:
    """A serial port: its file, such as `/dev/ttyUSB0`, its names that stay, its USB device, if it is one."""

    path: str
    names: Sequence[str] = ()
    device: UsbDevice | None = None

    @property
    def shown(self) -> str:
        """Return it for people: the name to write, and what it is."""
        name, *_ = [*self.names, self.path]
        about = [self.path] if self.names else []
        about += [self.device.shown] if self.device else []
        return plain(f"{name} ({', '.join(about)})" if about else name, _LONGEST)


def serial_ports(root: Path = ROOT) -> list[SerialPort]:
    """Return the serial ports that are connected, by their paths."""
    devices = dict(_usb_ttys(root))
    names = {tty.name for prefix in _ONBOARD for tty in (root / "dev").glob(f"{prefix}*")} | devices.keys()
    stay: dict[str, list[str]] = {}
    for link in sorted((root / "dev/serial/by-id").glob("*")):
        stay.setdefault(link.resolve().name, []).append(str(link))
    names |= {name for name in stay if (root / "dev" / name).exists()}
    return [SerialPort(str(root / "dev" / one), stay.get(one, ()), devices.get(one)) for one in sorted(names)]


def _usb_ttys(root: Path) -> Iterator[tuple[str, UsbDevice]]:
    for folder in sorted((root / "sys/bus/usb/devices").glob("*")):
        vendor, product = _text(folder / "idVendor"), _text(folder / "idProduct")
        if vendor and product:
            device = UsbDevice(vendor, product, _text(folder / "serial"))
            yield from ((tty.name, device) for pattern in _TTYS for tty in folder.glob(pattern))


def _text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""  # it has none, or was unplugged meanwhile


def port_path(name: str, root: Path = ROOT) -> str:
    """Return the path of a port by its name, as it is now.

    Raises:
        NoDeviceError: if it names a device that is not connected.
        DeviceNotUniqueError: if more than one such device is connected.
    """
    wanted = UsbDevice.of(name)
    return name if wanted is None else port_of(wanted, serial_ports(root)).path


def port_of(wanted: UsbDevice, ports: Iterable[SerialPort]) -> SerialPort:
    """Return the port of a device among those that are connected; raise as `port_path` does."""
    usb = [one for one in ports if one.device]
    meant = [one for one in usb if one.device and one.device.is_meant_by(wanted)]
    if not meant:
        raise NoDeviceError(f"the USB device {wanted.shown}", "is not connected", connected(usb, "USB serial port"))
    if len(meant) > 1:
        raise DeviceNotUniqueError(
            f"the USB device {wanted.shown}", f"has {len(meant)} ports", connected(meant, "USB serial port")
        )
    return meant[0]


def connected(ports: Sequence[SerialPort], what: str) -> str:
    """Return which ports are connected, for the help of a finding."""
    if not ports:
        return f"no {what} is connected: plug the adapter in"
    return f"connected: {', '.join(one.shown for one in ports)}"


def latency_timers(root: Path = ROOT) -> dict[str, float]:
    """Return the latency timers of FTDI adapters [s], by the paths of their ports."""
    ports = (str(root / "dev" / folder.name) for folder in (root / "sys/bus/usb-serial/devices").glob("*"))
    return {port: seconds for port in sorted(ports) if (seconds := latency_of(port, root)) is not None}


def latency_of(path: str, root: Path = ROOT) -> float | None:
    """Return the latency timer of a port's FTDI adapter [s], None if it has none."""
    name = Path(path).resolve().name
    for file in (
        root / "sys/bus/usb-serial/devices" / name / "latency_timer",
        root / "sys/class/tty" / name / "device/latency_timer",
    ):
        try:
            return int(file.read_text(encoding="ascii")) / 1000
        except (OSError, ValueError):
            continue
    return None
