"""Rules of udev that give devices their names: links `/dev/NAME`, and the group that may open them.

The words are those of udev(7): `==` compares, `=` sets, `+=` adds; all of `KERNELS`, `SUBSYSTEMS` and `ATTRS` of a line
are about one parent of the tty, the USB device.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from rbxcompose.devices.usb import UsbDevice

RULES = Path("etc/udev/rules.d")
"""The folder of rules, below the root."""
GROUP, MODE = "dialout", "0660"
RELOAD = (
    "sudo udevadm control --reload && "
    "sudo udevadm trigger --action=add --subsystem-match=tty --subsystem-match=usb-serial"
)
"""The commands by which rules take effect for what is plugged in already."""
_FTDI = "0403"
_SPECIAL = "*?["  # in patterns
_UNSURE = re.compile(r'[_"\\|]|[^\x20-\x7e]')  # udev writes `_` for others; no rule can have the rest


def rules_file(robot: str) -> Path:
    """Return the path of a robot's rules below the root; those of a later number overrule earlier ones."""
    return RULES / f"99-rbxcompose-{robot}.rules"


def rules_text(robot: str, devices: Iterable[UsbDevice], group: str = GROUP) -> str:
    """Return the rules of a robot's devices, by their names."""
    lines = [
        f"# Made by `rbxcompose udev`: the devices of the robot '{robot}'. Changes are lost with the next `install`."
    ]
    for device in sorted(devices, key=lambda one: one.name):
        lines += _lines(device, group)
    return "\n".join(lines) + "\n"


def _lines(device: UsbDevice, group: str) -> Iterator[str]:
    parent = ", ".join(_parent(device))
    part = [] if device.interface is None else [f'ENV{{ID_USB_INTERFACE_NUM}}=="{device.interface:02x}"']
    done = [f'GROUP="{group}"', f'MODE="{MODE}"', f'SYMLINK+="{device.name}"']
    yield ", ".join(['SUBSYSTEM=="tty"', parent, *part, *done])
    if device.vendor == _FTDI:  # as sold, they hold replies back for 16 ms
        yield ", ".join(
            ['ACTION=="add"', 'SUBSYSTEM=="usb-serial"', 'DRIVER=="ftdi_sio"', parent, 'ATTR{latency_timer}="1"']
        )


def _parent(device: UsbDevice) -> Iterator[str]:
    yield 'SUBSYSTEMS=="usb"'
    if device.usb_port:
        yield f'KERNELS=="{device.usb_port}"'
    told = {"idVendor": device.vendor, "idProduct": device.product, "serial": device.serial}
    yield from (f'ATTRS{{{key}}}=="{_escaped(text)}"' for key, text in told.items() if text)


def _escaped(text: str) -> str:
    """Return a text as a pattern that fits it alone, with `?` for any one sign that is not sure."""
    return "".join("?" if _UNSURE.match(sign) else f"[{sign}]" if sign in _SPECIAL else sign for sign in text)
