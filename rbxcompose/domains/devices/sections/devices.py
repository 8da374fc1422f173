"""The section `devices`: hardware that is known by what it is, or by where it is plugged in."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Annotated

from pydantic import AfterValidator, Field, ValidationInfo

from rbxcompose.base.config import DEVICE, DEVICE_PORT, PREFIXED, Config, Refers
from rbxcompose.base.findings import Finding, Related, Severity, Span, kind
from rbxcompose.domains.devices.serial_ports import USB_PORT, UsbDevice
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading

NOT_DESCRIBED = kind("RBX2260")
SAME_DEVICE = kind("RBX2261")
INCLUDED_DEVICE = kind("RBX2262", Severity.WARNING)
KERNEL_NAME = kind("RBX2263")

_DIGITS = re.compile(r"[0-9a-f]{4}")
_USB_PORT = re.compile(USB_PORT)
_LONGEST = 126  # characters of a text that a USB device reports
# Of Linux's list of devices (admin-guide/devices.txt), and what udev and systemd add.
_OF_THE_KERNEL = re.compile(
    r"tty([a-z]*\d+)?|console|null|zero|full|random|urandom|mem|port|kmsg|core|fd|std(in|out|err)|log|initctl|fuse|ptmx|pts|shm|"
    r"disk|mapper|net|input|snd|dri|usb|bus|char|block|serial|cpu|hugepages|mqueue|watchdog\d*|"
    r"(hd|sd|vd|xvd)[a-z]+\d*|(sr|sg|fb|lp|loop|ram|md|rtc|video|media|hidraw|mouse|i2c_?|mmcblk|nvme|vcs[au]?)\d+.*"
)


def _hexadecimal(text: str) -> str:
    """Read four hexadecimal digits; a number keeps the digits that were written."""
    lower = text.casefold()
    digits = lower.removeprefix("0x").zfill(4) if lower.startswith("0x") else lower
    if not _DIGITS.fullmatch(digits):
        raise ValueError("must be four hexadecimal digits, as 'lsusb' shows them: 0403")
    return digits


def _usb_port(text: str) -> str:
    if not _USB_PORT.fullmatch(text):
        raise ValueError("must be a USB port as 'rbxcompose udev scan' shows it: 1-1.4")
    return text


def _serial(text: str) -> str:
    """Refuse what no device reports; an empty one would fit all of its kind."""
    if not text.strip() or len(text) > _LONGEST or not text.isprintable():
        raise ValueError("must be a serial number; leave the key out if the device has none")
    return text


Hexadecimal = Annotated[str, AfterValidator(_hexadecimal)]


class DeviceModel(Config):
    """A USB device with a serial port: by `vendor` and `product`, by `usb_port`, or by all of them."""

    vendor: Hexadecimal = ""
    """Who made it: the first half of `ID 0403:6014` in `lsusb`."""
    product: Hexadecimal = ""
    """What it is: the second half."""
    serial: Annotated[str, AfterValidator(_serial)] = ""
    """Its serial number, as it is written; only needed if two of its kind are connected."""
    usb_port: Annotated[str, AfterValidator(_usb_port)] = ""
    """Where it is plugged in, for devices without a serial number: `1-1.4` is bus 1, port 1, port 4 of the hub there.
    """
    interface: int | None = Field(None, ge=0, le=255)
    """Which of the serial ports of a device that has several, as `udev scan` shows it."""

    def wanted(self, name: str) -> UsbDevice:
        """Return what it is known by."""
        return UsbDevice(self.vendor, self.product, self.serial, self.usb_port, self.interface, name)


def _details(read: Mapping[str, DeviceModel]) -> dict[str, str]:
    return {name: model.wanted(name).shown for name, model in read.items()}


@section("devices", DeviceModel, order=30, names=DEVICE, entry="device", details=_details)
def devices(reading: Reading[DeviceModel]) -> dict[str, DeviceModel]:
    """Devices on USB, by name. `port: dev:NAME` is the port of one, under whatever number it was plugged in.

    It is looked up when the robot starts, and again after the device was unplugged. `rbxcompose udev scan` lists what
    is plugged in, and writes entries.

    Example:
        devices:
          usb2dynamixel:
            vendor: 0403
            product: 6001
            serial: A700eUxA
        buses:
          servos:
            type: dynamixel
            port: dev:usb2dynamixel
    """
    found = reading.entries()
    spans = {name: reading.key("devices", name) for name in found}
    reading.report.extend(_mistakes(found, spans))
    return found


def _mistakes(found: Mapping[str, DeviceModel], spans: Mapping[str, Span]) -> Iterator[Finding]:
    wanted = {name: model.wanted("") for name, model in found.items()}
    for number, (name, device) in enumerate(wanted.items()):
        if _OF_THE_KERNEL.fullmatch(name):
            yield KERNEL_NAME.at(spans[name], f"'/dev/{name}' is a device of the kernel", help="choose another name")
        if not (device.usb_port or (device.vendor and device.product)):
            words = f"the device '{name}' needs 'vendor' and 'product', or 'usb_port'"
            yield NOT_DESCRIBED.at(spans[name], words, help="'rbxcompose udev scan' shows them")
            continue
        for other in list(wanted)[:number]:
            yield from _shared(name, other, wanted, spans)


def _shared(name: str, other: str, wanted: Mapping[str, UsbDevice], spans: Mapping[str, Span]) -> Iterator[Finding]:
    """Yield the finding about two entries of which one may be the other."""
    device, first = wanted[name], wanted[other]
    if not (first.usb_port or first.vendor):
        return
    related = [Related(spans[other], "the other one")]
    help_text = "distinguish them by 'serial', 'usb_port' or 'interface'"
    if device == first:
        words = f"the devices '{other}' and '{name}' are described alike"
        yield SAME_DEVICE.at(spans[name], words, help=help_text, related=related)
    elif device.matches(first) or first.matches(device):
        narrow, wide = (name, other) if device.matches(first) else (other, name)
        words = f"the device '{narrow}' is also one that '{wide}' describes"
        yield INCLUDED_DEVICE.at(spans[name], words, help=help_text, related=related)


def port_name(contents: Contents, port: str) -> str:
    """Return the name by which a port is opened: that of the device for `dev:NAME`, else the path."""
    known: dict[str, DeviceModel] = contents.of(devices)
    return _port_name(known, port)


def _port_name(known: Mapping[str, object], port: str) -> str:
    prefix, _ = PREFIXED[DEVICE_PORT]
    device = known.get(name := port.removeprefix(prefix)) if port.startswith(prefix) else None
    return device.wanted(name).port if isinstance(device, DeviceModel) else port


def with_folder(text: str) -> str:
    """Refuse a name of Linux without its folder."""
    if text.startswith("tty") and text.isalnum():
        raise ValueError(f"must be a path: write '/dev/{text}', or 'dev:NAME' for one of 'devices'")
    return text


def _device(text: str, info: ValidationInfo) -> str:
    """Return the name by which a port is opened, as `port_name` does."""
    return _port_name({} if info.context is None else info.context.get(DEVICE, {}), text)


SerialPortName = Annotated[str, Refers(DEVICE_PORT), AfterValidator(with_folder), AfterValidator(_device)]
"""The serial port of a component: a path, or `dev:NAME`, which becomes what is known of the device."""
