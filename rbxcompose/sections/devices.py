"""The section `devices`: hardware that is known by what it is, wherever it is plugged in."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated

from pydantic import AfterValidator

from rbxcompose.actuation.serial_ports import UsbDevice
from rbxcompose.config import Config
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading
from rbxcompose.references import DEVICE, DEVICE_PORT, PREFIXED

_DIGITS = re.compile(r"[0-9a-f]{4}")


def _hexadecimal(text: str) -> str:
    """Read four hexadecimal digits; a number keeps the digits that were written."""
    lower = text.casefold()
    digits = lower.removeprefix("0x").zfill(4) if lower.startswith("0x") else lower
    if not _DIGITS.fullmatch(digits):
        raise ValueError("must be four hexadecimal digits, as 'lsusb' shows them: 0403")
    return digits


Hexadecimal = Annotated[str, AfterValidator(_hexadecimal)]


class DeviceModel(Config):
    """A USB device with a serial port."""

    vendor: Hexadecimal
    """Who made it: the first half of `ID 0403:6014` in `lsusb`."""
    product: Hexadecimal
    """What it is: the second half."""
    serial: str = ""
    """Its serial number; only needed if two of its kind are connected."""


def _details(read: Mapping[str, DeviceModel]) -> dict[str, str]:
    return {name: f"{one.vendor}:{one.product} {one.serial}".rstrip() for name, one in read.items()}


@section("devices", DeviceModel, order=30, names=DEVICE, entry="device", details=_details)
def devices(reading: Reading[DeviceModel]) -> dict[str, DeviceModel]:
    """Devices on USB, by name. `port: dev:NAME` is the port of one, under whatever number it was plugged in.

    It is looked up when the robot starts, and again after the device was unplugged.

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
    return reading.entries()


def port_name(contents: Contents, port: str) -> str:
    """Return the name by which a port is opened: that of the device for `dev:NAME`, else the path."""
    prefix, _ = PREFIXED[DEVICE_PORT]
    one = contents.of(devices).get(port.removeprefix(prefix)) if port.startswith(prefix) else None
    return UsbDevice(one.vendor, one.product, one.serial).port if one else port
