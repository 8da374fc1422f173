"""`udev scan`."""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from rbxcompose.cli.bus.entities import table
from rbxcompose.cli.devices.actions import Actions, RobotDevices, add_action, read_devices
from rbxcompose.cli.output.console import FINDINGS, tell
from rbxcompose.cli.project.robot_choice import only_path
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.devices.match import names_of, proposed
from rbxcompose.devices.serial_ports import SerialPort, serial_ports
from rbxcompose.devices.usb import UsbDevice
from rbxcompose.importing.manifest_text import key

_HEAD = ("port", "vendor", "product", "serial", "USB port", "driver", "what it is", "device")
_NUMBERS = ("vendor", "product", "interface", "usb_port")  # as they are; a serial number may need quotes


def add(actions: Actions) -> None:
    """Declare the action."""
    add_action(actions, "scan", "list the serial ports that are plugged in, and write entries for new ones", _scan)


def _scan(arguments: argparse.Namespace) -> int:
    found = RobotDevices("", {}, {}, is_right=True)
    path = arguments.path if arguments.path is not None else _own()
    if path is not None:
        read = read_devices(path, arguments)
        if read is None:
            return FINDINGS
        found = read
    ports = serial_ports(arguments.root)
    named = [device for device, _ in found.named.values()]
    if arguments.json:
        tell(json.dumps([_data(port, ports, named) for port in ports], ensure_ascii=False))
    else:
        tell("\n".join(_lines(ports, named, found.named)))
    return 0


def _own() -> str | None:
    """Return the only robot of this folder, if it has one: what is plugged in is worth knowing without any."""
    try:
        return only_path(may_run=False)
    except NotDoneError:
        return None


def _lines(ports: Sequence[SerialPort], named: Sequence[UsbDevice], names: Iterable[str]) -> Iterator[str]:
    if not ports:
        yield "no serial port is plugged in"
    else:
        yield table([_HEAD, *(_row(port, ports, named) for port in ports)])
    there = Counter(name for port in ports for name in names_of(port, named))
    for name in names:
        if there[name] != 1:
            yield f"'{name}' means {there[name]} of these" if there[name] else f"'{name}' is not plugged in"
    new = [port for port in ports if port.device is not None and not _name(port, ports, named)]
    if new:
        yield "\nfor the manifest, each under a name of yours:\ndevices:"
        yield from (f"  NAME: {entry_of(port, ports)}" for port in new)


def _name(port: SerialPort, ports: Sequence[SerialPort], named: Sequence[UsbDevice]) -> str:
    """Return the names that mean this port and no other one."""
    others = {name for one in ports if one != port for name in names_of(one, named)}
    return ", ".join(name for name in names_of(port, named) if name not in others)


def _row(port: SerialPort, ports: Sequence[SerialPort], named: Sequence[UsbDevice]) -> tuple[str, ...]:
    own = port.device or UsbDevice()
    part = f" interface {own.interface}" if own.interface else ""
    several = ", ".join(f"{name}?" for name in names_of(port, named))
    return (
        port.path,
        own.vendor,
        own.product,
        own.serial,
        f"{own.usb_port}{part}",
        port.driver,
        port.about,
        _name(port, ports, named) or several or ("new" if port.device else ""),
    )


def entry_of(port: SerialPort, ports: Sequence[SerialPort]) -> str:
    """Return the entry of `devices:` that means a port, in one line."""
    keys = proposed(port, ports)
    return f"{{{', '.join(f'{name}: {text if name in _NUMBERS else key(text)}' for name, text in keys.items())}}}"


def _data(port: SerialPort, ports: Sequence[SerialPort], named: Sequence[UsbDevice]) -> dict[str, Any]:
    own = port.device or UsbDevice()
    return {
        "path": port.path,
        "links": list(port.names),
        "vendor": own.vendor,
        "product": own.product,
        "serial": own.serial,
        "usb_port": own.usb_port,
        "interface": own.interface,
        "driver": port.driver,
        "about": port.about,
        "devices": names_of(port, named),
        "entry": dict(proposed(port, ports)),
    }
