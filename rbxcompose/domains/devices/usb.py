"""What a USB device is known by, and the text that names one where a path could stand.

The text is `usb:VENDOR:PRODUCT` or `usb:VENDOR:PRODUCT:SERIAL`. For one of a manifest it has more:
`dev:NAME=usb@1-1.4#2:0403:6011`, with its name, its USB port and the interface, as far as they are given.
"""

from __future__ import annotations

import re
from typing import Self

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.printable import plain

USB_PORT = r"[0-9]+-[0-9]+(?:\.[0-9]+)*"
_NAMED = re.compile(
    rf"(?:dev:(?P<name>[a-z][a-z0-9_]*)=)?usb(?:@(?P<usb_port>{USB_PORT}))?(?:#(?P<interface>[0-9]{{1,3}}))?"
    r"(?::(?P<vendor>[0-9a-fA-F]{4}):(?P<product>[0-9a-fA-F]{4})(?::(?P<serial>.+))?)?",
    re.DOTALL,
)
_SPACES = re.compile(r"\s+")
_REPLACED = re.compile(r"[^0-9A-Za-z#+.:=@_\x80-\U0010ffff-]")


@dataclass(frozen=True, slots=True)
class UsbDevice:
    """A USB device: vendor and product in four hexadecimal digits each, and its serial number, if it has one.

    `usb_port` is where it is plugged in, as the kernel names it: bus 1, port 1 of the root, port 4 of the hub there
    are `1-1.4`. `interface` is which part of a device with several serial ports. What is empty is left open in a
    device that is wanted. `name` is that in the manifest.
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
