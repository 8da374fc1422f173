"""Rules of udev that give devices their names; whether those of a robot, and its ports, are there and may be opened."""

from __future__ import annotations

import grp
import os
import pwd
import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Severity, Span, kind
from rbxcompose.base.printable import plain
from rbxcompose.compiler.model.flow import setting_span
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.domains.devices.serial_ports import (
    FORBIDDEN,
    NO_PORT,
    UNFIT,
    PortError,
    SerialPort,
    UsbDevice,
    connected,
    latency_of,
    port_of,
    slow_adapter,
)
from rbxcompose.sdk.capabilities import OpensPort

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
NO_LINK = kind("RBX9413", Severity.WARNING)
OTHER_RULES = kind("RBX9414", Severity.WARNING)
SAME_SERIAL = kind("RBX9415", Severity.WARNING)
NOT_IN_GROUP = kind("RBX9416", Severity.WARNING)
OTHER_LINK = kind("RBX9417")
Named = Mapping[str, tuple[UsbDevice, Span | None]]
"""Devices of a manifest by their names, with their places."""


def names_of(port: SerialPort, named: Iterable[UsbDevice]) -> list[str]:
    """Return the names that mean a port: by its device, or by a link if the kernel reports no device."""
    if port.device is None:
        return [device.name for device in named if port.is_linked(device.name)]
    return [device.name for device in named if port.device.matches(device)]


def proposed(port: SerialPort, ports: Sequence[SerialPort]) -> Mapping[str, str]:
    """Return the keys of an entry that means a port and none of the others; none if it has no USB device."""
    own = port.device
    if own is None:
        return {}
    others = [serial_port.device for serial_port in ports if serial_port.device is not None and serial_port != port]
    keys = {"vendor": own.vendor, "product": own.product}
    if own.serial and own.serial.isprintable():
        keys["serial"] = own.serial
    if "serial" not in keys or any(device.usb_port != own.usb_port for device in _alike(keys, others)):
        keys["usb_port"] = own.usb_port  # without a serial number, the next one of its kind would be meant, too
    if _alike(keys, others) and own.interface is not None:
        keys["interface"] = str(own.interface)
    return keys


def _alike(keys: Mapping[str, str], others: Iterable[UsbDevice]) -> list[UsbDevice]:
    wanted = UsbDevice(keys["vendor"], keys["product"], keys.get("serial", ""), keys.get("usb_port", ""))
    return [other for other in others if other.matches(wanted)]


def same_serials(ports: Iterable[SerialPort]) -> list[list[SerialPort]]:
    """Return groups of ports of different devices that report the same serial number, as cheap copies do."""
    groups: dict[UsbDevice, dict[str, SerialPort]] = defaultdict(dict)
    for port in ports:
        if port.device is not None and port.device.serial:
            kind = UsbDevice(port.device.vendor, port.device.product, port.device.serial)
            groups[kind].setdefault(port.device.usb_port, port)
    return [list(group.values()) for group in groups.values() if len(group) > 1]


def rules_file(robot: str) -> Path:
    """Return the path of a robot's rules below the root; those of a later number overrule earlier ones."""
    return RULES / f"99-rbxcompose-{robot}.rules"


def rules_text(robot: str, devices: Iterable[UsbDevice], group: str = GROUP) -> str:
    """Return the rules of a robot's devices, by their names."""
    lines = [
        f"# Made by `rbxcompose udev`: the devices of the robot '{robot}'. Changes are lost with the next `install`."
    ]
    for device in sorted(devices, key=lambda usb_device: usb_device.name):
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
    attributes = {"idVendor": device.vendor, "idProduct": device.product, "serial": device.serial}
    yield from (f'ATTRS{{{key}}}=="{_escaped(text)}"' for key, text in attributes.items() if text)


def _escaped(text: str) -> str:
    """Return a text as a pattern that fits it alone, with `?` for any one sign that is not sure."""
    return "".join("?" if _UNSURE.match(sign) else f"[{sign}]" if sign in _SPECIAL else sign for sign in text)


@dataclass(frozen=True, slots=True)
class Account:
    """A user: the groups of this process, and those that the system has for the user now."""

    name: str
    groups: frozenset[str]
    registered: frozenset[str] = frozenset()
    is_root: bool = False


def this_account() -> Account:
    """Return the user of this process."""
    number = os.getuid()
    name = next((one.pw_name for one in pwd.getpwall() if one.pw_uid == number), str(number))
    own = {os.getgid(), *os.getgroups()}
    every = grp.getgrall()
    return Account(
        name,
        frozenset(item.gr_name for item in every if item.gr_gid in own),
        frozenset(item.gr_name for item in every if name in item.gr_mem),
        number == 0,
    )


def device_answers(
    named: Named, ports: Sequence[SerialPort], look: LookAt, *, rules_are_right: bool
) -> Iterator[str | Finding]:
    """Yield for each device where it is, or what is wrong with it."""
    for name, (wanted, span) in named.items():
        try:
            port = port_of(wanted, ports)
        except PortError as error:
            yield error.finding(span)
            continue
        yield f"'{name}' is {port.path}{f' ({port.device.shown})' if port.device else ''}"
        yield from _link_findings(name, port, ports, span, rules_are_right)
        file = look(port.path)
        if file.exists and not file.may_open:
            yield _forbidden(f"'{name}' is {plain(port.path)}, which", file, span)
    for group in same_serials(ports):
        places = ", ".join(serial_port.path for serial_port in group)
        serial = group[0].device.serial if group[0].device else ""
        words = f"{len(group)} adapters report the same serial number '{plain(serial)}': {places}"
        yield SAME_SERIAL.at(None, words, help="name them by 'usb_port' instead of 'serial'")
    if not named:
        yield "the robot has no devices"


def _link_findings(
    name: str, port: SerialPort, ports: Sequence[SerialPort], span: Span | None, rules_are_right: bool
) -> Iterator[Finding]:
    others = [serial_port.path for serial_port in ports if serial_port != port and serial_port.is_linked(name)]
    if others:
        words = f"/dev/{name} leads to {plain(others[0])}, but '{name}' is {plain(port.path)}"
        yield OTHER_LINK.at(span, words, help=f"grep -r {name} /etc/udev/rules.d; then {RELOAD}")
    elif rules_are_right and not port.is_linked(name):
        yield NO_LINK.at(span, f"'{name}' is {plain(port.path)}, but there is no link /dev/{name}", help=RELOAD)


def group_answer(account: Account, group: str) -> str | Finding:
    """Return whether a user may open what rules give to a group."""
    if account.is_root or group in account.groups:
        return f"{account.name} may open what belongs to the group '{group}'"
    if group in account.registered:
        words = f"{plain(account.name)} has joined the group '{group}', but not logged in since"
        return NOT_IN_GROUP.at(None, words, help="log out and in again")
    words = f"{plain(account.name)} is not in the group '{group}'"
    return NOT_IN_GROUP.at(None, words, help=f"sudo usermod -aG {group} $USER, then log in again")


def rules_answer(wanted: str, found: str | None, file: str) -> str | Finding:
    """Return whether the rules of a robot are installed, given the text of their file, None if there is none."""
    if found == wanted:
        return f"{file} has the rules of the robot"
    words = f"{plain(file)} does not exist" if found is None else f"{plain(file)} has other rules"
    return OTHER_RULES.at(None, words, help="sudo rbxcompose udev install")


@dataclass(frozen=True, slots=True)
class PortFile:
    """What is at the path of a port: `group` owns it, `latency` [s] is how long its adapter holds replies back."""

    exists: bool = True
    is_device: bool = True
    may_open: bool = True
    group: str = ""
    latency: float | None = None


LookAt = Callable[[str], PortFile]


def port_findings(robot: Robot, ports: Sequence[SerialPort], look: LookAt) -> Iterator[Finding]:
    """Yield what is wrong with the ports that components open, given those that are connected."""
    for component, opens in robot.declared(OpensPort):
        yield from _of_port(opens.port.value, ports, look, setting_span(robot, (component, opens.port.field)))


def _of_port(name: str, ports: Sequence[SerialPort], look: LookAt, span: Span) -> Iterator[Finding]:
    path = name
    if wanted := UsbDevice.of(name):
        try:
            path = port_of(wanted, ports).path
        except PortError as error:
            yield error.finding(span)
            return
    file, shown = look(path), plain(path)
    if not file.exists:
        yield NO_PORT.at(span, f"{shown} does not exist", help=connected(ports, "serial port"))
    elif not file.is_device:
        yield UNFIT.at(span, f"{shown} is not a serial port", help=connected(ports, "serial port"))
    elif not file.may_open:
        yield _forbidden(shown, file, span)
    elif warning := slow_adapter(path, file.latency, span):
        yield warning


def _forbidden(what: str, file: PortFile, span: Span | None) -> Finding:
    todo = f"sudo usermod -aG {file.group or 'dialout'} $USER, then log in again"
    return FORBIDDEN.at(span, f"{what} may not be opened by this user", help=todo)


def look_at(path: str) -> PortFile:
    """Return what is at a path of this machine."""
    file = Path(path)
    try:
        group = _group_name(file.stat().st_gid)
    except OSError:
        return PortFile(exists=False)
    return PortFile(True, file.is_char_device(), os.access(file, os.R_OK | os.W_OK), group, latency_of(path))


def _group_name(number: int) -> str:
    try:
        return grp.getgrgid(number).gr_name
    except KeyError:
        return str(number)
