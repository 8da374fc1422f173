"""Which of the devices that are named are plugged in, and what could be written for the others."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence

from rbxcompose.devices.serial_ports import SerialPort
from rbxcompose.devices.usb import UsbDevice


def names_of(port: SerialPort, named: Iterable[UsbDevice]) -> list[str]:
    """Return the names that mean a port: by its device, or by a link if the kernel tells no device."""
    if port.device is None:
        return [one.name for one in named if port.is_linked(one.name)]
    return [one.name for one in named if port.device.is_meant_by(one)]


def proposed(port: SerialPort, ports: Sequence[SerialPort]) -> Mapping[str, str]:
    """Return the keys of an entry that means a port and none of the others; none if it has no USB device."""
    own = port.device
    if own is None:
        return {}
    others = [one.device for one in ports if one.device is not None and one != port]
    keys = {"vendor": own.vendor, "product": own.product}
    if own.serial and own.serial.isprintable():
        keys["serial"] = own.serial
    if "serial" not in keys or any(one.usb_port != own.usb_port for one in _alike(keys, others)):
        keys["usb_port"] = own.usb_port  # without a serial number, the next one of its kind would be meant, too
    if _alike(keys, others) and own.interface is not None:
        keys["interface"] = str(own.interface)
    return keys


def _alike(keys: Mapping[str, str], others: Iterable[UsbDevice]) -> list[UsbDevice]:
    wanted = UsbDevice(keys["vendor"], keys["product"], keys.get("serial", ""), keys.get("usb_port", ""))
    return [one for one in others if one.is_meant_by(wanted)]


def same_serials(ports: Iterable[SerialPort]) -> list[list[SerialPort]]:
    """Return groups of ports of different devices that tell the same serial number, as cheap copies do."""
    groups: dict[UsbDevice, dict[str, SerialPort]] = defaultdict(dict)
    for port in ports:
        if port.device is not None and port.device.serial:
            kind = UsbDevice(port.device.vendor, port.device.product, port.device.serial)
            groups[kind].setdefault(port.device.usb_port, port)
    return [list(group.values()) for group in groups.values() if len(group) > 1]
