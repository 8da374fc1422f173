"""The serial ports of this machine with their USB devices, what can be wrong with one, and ports that are open."""

from __future__ import annotations

import errno
import os
import re
import select
import termios
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Self

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import read_regular
from rbxcompose.base.findings import Finding, FindingKind, Severity, Span, kind
from rbxcompose.base.printable import plain

if TYPE_CHECKING:
    import serial

USB_PORT = r"[0-9]+-[0-9]+(?:\.[0-9]+)*"
_NAMED = re.compile(
    rf"(?:dev:(?P<name>[a-z][a-z0-9_]*)=)?usb(?:@(?P<usb_port>{USB_PORT}))?(?:#(?P<interface>[0-9]{{1,3}}))?"
    r"(?::(?P<vendor>[0-9a-fA-F]{4}):(?P<product>[0-9a-fA-F]{4})(?::(?P<serial>.+))?)?",
    re.DOTALL,
)
_SPACES = re.compile(r"\s+")
_REPLACED = re.compile(r"(?![0-9A-Za-z#+.:=@_-])[\x00-\x7f]")
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
ROOT = Path("/")
_TTYS = ("*:*/tty/tty*", "*:*/*/tty/tty*")  # below a device: of a modem (ttyACM), of a converter (ttyUSB)
_LONGEST = 300  # characters of a port as it is shown
_ONBOARD = ("ttyAMA", "ttyTHS", "ttymxc")
_LINKS = ("dev/serial/by-id", "dev/serial/by-path", "dev")
_MOST = 4096  # entries of a folder that are looked at
_ATTRIBUTE = 4096  # [B], the longest that the kernel shows
_HELP = {
    NO_PORT: "plug the adapter in, or look for it below /dev/serial/by-id",
    FORBIDDEN: "sudo usermod -aG dialout $USER, then log in again; or a udev rule with MODE and GROUP",
    BUSY: "end the other program: 'rbxcompose ps' shows robots that run",
    UNFIT: "name a serial port, and a baud rate of its adapter",
    LOST: "plug the adapter in again",
}
_CHUNK = 4096  # [B] of one read
_STUCK = 0.2  # [s] after which a port that takes no bytes is given up
_ERRORS: dict[int | None, tuple[FindingKind, str]] = {
    errno.ENOENT: (NO_PORT, "does not exist"),
    errno.ENXIO: (NO_PORT, "has no device"),
    errno.ENODEV: (NO_PORT, "has no device"),
    errno.EACCES: (FORBIDDEN, "may not be opened by this user"),
    errno.EPERM: (FORBIDDEN, "may not be opened by this user"),
    errno.EBUSY: (BUSY, "is used by another program"),
    errno.EAGAIN: (BUSY, "is used by another program"),
}


@dataclass(frozen=True, slots=True)
class UsbDevice:
    """A USB device: vendor and product in four hexadecimal digits each, and its serial number, if it has one.

    `usb_port` is where it is plugged in, as the kernel names it: bus 1, port 1 of the root, port 4 of the hub there
    are `1-1.4`. `interface` is which part of a device with several serial ports. What is empty is left open in a
    device that is wanted. `name` is that in the manifest.

    Where a path could stand, it is `usb:VENDOR:PRODUCT` or `usb:VENDOR:PRODUCT:SERIAL`. For one of a manifest the text
    has more: `dev:NAME=usb@1-1.4#2:0403:6011`, with its name, its USB port and the interface, as far as they are given.
    """

    vendor: str = ""
    product: str = ""
    serial: str = ""
    usb_port: str = ""
    interface: int | None = None
    name: str = ""

    @classmethod
    def of(cls, port: str) -> Self | None:
        """Return the device that the name of a port gives; None if it is a path."""
        found = _NAMED.fullmatch(port)
        if not found or not (found["vendor"] or found["usb_port"]):
            return None
        parts = {key: text for key, text in found.groupdict().items() if text and key != "interface"}
        return cls(**parts, interface=int(found["interface"]) if found["interface"] else None)

    @property
    def port(self) -> str:
        """Return the name of its port."""
        name = f"dev:{self.name}=" if self.name else ""
        place = f"@{self.usb_port}" if self.usb_port else ""
        part = "" if self.interface is None else f"#{self.interface}"
        kind = "".join(f":{text}" for text in (self.vendor, self.product, self.serial) if text)
        return f"{name}usb{place}{part}{kind}"

    @property
    def shown(self) -> str:
        """Return it for people, as `lsusb` writes it; without a serial number, with its USB port."""
        kind = f"{self.vendor}:{self.product}" if self.vendor else ""
        place = f"at USB port {self.usb_port}" if self.usb_port and not self.serial else ""
        part = f"interface {self.interface}" if self.interface else ""
        return plain(" ".join(text for text in (kind, self.serial, place, part) if text))

    @property
    def called(self) -> str:
        """Return what an error calls it."""
        return f"the device '{self.name}' ({self.shown})" if self.name else f"the USB device {self.shown}"

    def matches(self, wanted: UsbDevice) -> bool:
        """Tell whether it is the wanted device, of which something may be left open."""
        return (
            wanted.vendor.casefold() in ("", self.vendor.casefold())
            and wanted.product.casefold() in ("", self.product.casefold())
            and wanted.serial in ("", self.serial, as_udev_writes(self.serial))
            and wanted.usb_port in ("", self.usb_port)
            and wanted.interface in (None, self.interface)
        )


def as_udev_writes(serial: str) -> str:
    """Return a serial number as `udevadm info` shows it: `_` for spaces and for most signs."""
    return _REPLACED.sub("_", _SPACES.sub("_", serial.strip()))


class PortError(Exception):
    """Raised when a serial port cannot be used; `kind` is the cause."""

    def __init__(self, kind: FindingKind, path: str, problem: str, help: str = "") -> None:
        super().__init__(f"{path} {problem}")
        self.kind, self.path, self.problem = kind, path, problem
        self.help = help or _HELP[kind]

    def finding(self, span: Span | None = None) -> Finding:
        """Return the message for people."""
        return self.kind.at(span, f"{plain(self.path)} {plain(self.problem)}", help=self.help)


class LostPortError(PortError):
    """Raised when an open port has gone."""

    def __init__(self, path: str, problem: str) -> None:
        super().__init__(LOST, path, problem)


def slow_adapter(path: str, latency: float | None, span: Span | None = None) -> Finding | None:
    """Return the warning about an adapter whose latency timer [s] is too long, None if it is fine or unknown."""
    if latency is None or latency <= SLOW:
        return None
    words = f"the adapter of {plain(path)} holds replies back for up to {1000 * latency:.0f} ms"
    timer = f"/sys/bus/usb-serial/devices/{plain(Path(path).resolve().name)}/latency_timer"
    now = f"echo 1 | sudo tee {timer}"
    return SLOW_ADAPTER.at(span, words, help=f"{now}; to keep it, in /etc/udev/rules.d/99-servos.rules: {_RULE}")


@dataclass(frozen=True, slots=True)
class SerialPort:
    """A serial port: its file, such as `/dev/ttyUSB0`, its names that stay, its USB device, if it is one.

    `driver` is the kernel's, `about` what the device says of itself.
    """

    path: str
    names: Sequence[str] = ()
    device: UsbDevice | None = None
    driver: str = ""
    about: str = ""

    @property
    def shown(self) -> str:
        """Return it for people: the name to write, and what it is."""
        name, *_ = [*self.names, self.path]
        about = [self.path] if self.names else []
        about += [self.device.shown] if self.device else []
        return plain(f"{name} ({', '.join(about)})" if about else name, _LONGEST)

    def is_linked(self, name: str) -> bool:
        """Tell whether a link of this name leads to it, such as the one that a udev rule makes for a device."""
        return any(PurePath(item).parent.name == "dev" and PurePath(item).name == name for item in self.names)


def serial_ports(root: Path = ROOT) -> list[SerialPort]:
    """Return the serial ports that are connected, by their paths."""
    found = {port.path: port for port in _usb_ports(root)}
    names = _names(root)
    onboard = {str(tty) for prefix in _ONBOARD for tty in (root / "dev").glob(f"{prefix}*") if not tty.is_symlink()}
    there = {path for path in names if os.path.exists(path)}
    return [
        SerialPort(path, names.get(path, ()), port.device, port.driver, port.about)
        for path in sorted(found.keys() | onboard | there)
        for port in [found.get(path, SerialPort(path))]
    ]


def _names(root: Path) -> Mapping[str, Sequence[str]]:
    """Return the links to serial ports by the paths where they lead; those that name the device come first."""
    found: dict[str, list[str]] = {}
    for folder in _LINKS:
        for link in _entries(root / folder):
            if target := _target(link, root):
                found.setdefault(target, []).append(str(link))
    return found


def _entries(folder: Path) -> list[Path]:
    try:
        with os.scandir(folder) as entries:
            return sorted(Path(entry.path) for entry in islice(entries, _MOST) if entry.is_symlink())
    except OSError:
        return []  # there is none


def _target(link: Path, root: Path) -> str:
    """Return the path of the serial port where a link leads; empty if it leads elsewhere."""
    try:
        target = PurePath(os.readlink(link))
    except OSError:
        return ""  # it was unplugged meanwhile
    if target.parent.name == "pts":
        return str(target)
    return str(root / "dev" / target.name) if target.name.startswith("tty") else ""


def _usb_ports(root: Path) -> Iterator[SerialPort]:
    for folder in sorted(islice((root / "sys/bus/usb/devices").glob("*"), _MOST)):
        vendor, product = _text(folder / "idVendor"), _text(folder / "idProduct")
        if not vendor or not product:
            continue
        about = " ".join(text for key in ("manufacturer", "product") if (text := _text(folder / key)))
        for tty in sorted(tty for pattern in _TTYS for tty in folder.glob(pattern)):
            part = folder / tty.relative_to(folder).parts[0]
            device = UsbDevice(vendor, product, _text(folder / "serial"), folder.name, _number_of(part))
            yield SerialPort(str(root / "dev" / tty.name), (), device, _driver(part), about)


def _number_of(interface: Path) -> int | None:
    try:
        return int(_text(interface / "bInterfaceNumber"), 16)
    except ValueError:
        return None


def _driver(interface: Path) -> str:
    try:
        return PurePath(os.readlink(interface / "driver")).name
    except OSError:
        return ""


def _text(file: Path) -> str:
    try:
        return read_regular(file, _ATTRIBUTE).decode(errors="replace").strip()
    except OSError:
        return ""  # it has none, or was unplugged meanwhile


def port_path(name: str, root: Path = ROOT) -> str:
    """Return the path of a port by its name, as it is now.

    Raises:
        PortError: if it names a device that is not connected, or more than one such device is.
    """
    wanted = UsbDevice.of(name)
    return name if wanted is None else port_of(wanted, serial_ports(root)).path


def port_of(wanted: UsbDevice, ports: Iterable[SerialPort]) -> SerialPort:
    """Return the port of a device among those that are connected; raise as `port_path` does.

    What the kernel reports decides. A link with the name of the device (that of a udev rule) decides among
    several that are meant, and where the kernel reports nothing, as in containers.
    """
    ports = list(ports)
    usb = [port for port in ports if port.device]
    matching = [port for port in usb if port.device and port.device.matches(wanted)]
    linked = [port for port in ports if wanted.name and port.is_linked(wanted.name)]
    if len(matching) != 1:
        matching = [port for port in linked if port in matching or not (matching or port.device)] or matching
    if not matching:
        raise PortError(NO_USB_DEVICE, wanted.called, "is not connected", connected(usb, "USB serial port"))
    if len(matching) > 1:
        raise PortError(
            TWO_USB_DEVICES, wanted.called, f"has {len(matching)} ports", connected(matching, "USB serial port")
        )
    return matching[0]


def connected(ports: Sequence[SerialPort], what: str) -> str:
    """Return which ports are connected, for the help of a finding."""
    if not ports:
        return f"no {what} is connected: plug the adapter in"
    return f"connected: {', '.join(port.shown for port in ports)}"


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


def opened(path: str, baud: int) -> serial.Serial:
    """Open a serial port at any rate [bit/s] that its adapter has, for this program alone.

    Raises:
        PortError: if that cannot be done, with the reason.
    """
    import serial

    try:
        return serial.Serial(path, baud, timeout=0, exclusive=True)
    except (OSError, termios.error, ValueError, OverflowError) as error:
        number = getattr(error, "errno", None)
        kind, words = _ERRORS.get(number, (UNFIT, f"cannot be a serial port at {baud} bit/s"))
        raise PortError(kind, path, words) from error


class SerialLine:
    """A serial port by its name, which may be that of a device, at `baud` [bit/s]. It begins closed."""

    def __init__(self, name: str, baud: int) -> None:
        self.name, self.baud = name, baud
        self._port: serial.Serial | None = None

    @property
    def is_open(self) -> bool:
        """Return whether it is open."""
        return self._port is not None

    def open(self) -> None:
        """Open it, and forget what came before.

        Raises:
            PortError: if that cannot be done, with the reason.
        """
        self._port = opened(port_path(self.name), self.baud)
        try:
            termios.tcflush(self._port.fileno(), termios.TCIFLUSH)
        except termios.error as error:
            raise self._lost() from error

    def read(self, patience: float) -> bytes:
        """Return what has come, waiting for at most `patience` [s] for the first byte.

        Raises:
            LostPortError: if the port has gone.
        """
        try:
            descriptor = self._descriptor()
            if not select.select([descriptor], [], [], patience)[0]:
                return b""
            data = os.read(descriptor, _CHUNK)
        except (OSError, ValueError) as error:
            raise self._lost() from error
        if not data:
            raise self._lost()
        return data

    def write(self, data: bytes) -> bool:
        """Send bytes; return whether all were taken.

        Raises:
            LostPortError: if the port has gone.
        """
        sent = 0
        try:
            descriptor = self._descriptor()
            while sent < len(data):
                if not select.select([], [descriptor], [], _STUCK)[1]:
                    return False
                sent += os.write(descriptor, data[sent:])
        except BlockingIOError:
            return False
        except (OSError, ValueError) as error:
            raise self._lost() from error
        return True

    def close(self) -> None:
        """Close it."""
        if self._port is not None:
            port, self._port = self._port, None
            port.close()

    def _descriptor(self) -> int:
        if self._port is None:
            raise OSError("it is closed")
        return int(self._port.fileno())

    def _lost(self) -> LostPortError:
        self.close()
        return LostPortError(self.name, "has gone")
