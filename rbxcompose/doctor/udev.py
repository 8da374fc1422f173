"""Whether the devices of a robot are plugged in, have their names, and may be opened by this user."""

from __future__ import annotations

import grp
import os
import pwd
from collections.abc import Iterator, Mapping, Sequence

from rbxcompose.dataclass import dataclass
from rbxcompose.devices.match import same_serials
from rbxcompose.devices.port_errors import FORBIDDEN, PortError
from rbxcompose.devices.rules import RELOAD
from rbxcompose.devices.serial_ports import SerialPort, port_of
from rbxcompose.devices.usb import UsbDevice
from rbxcompose.doctor.serial_ports import LookAt
from rbxcompose.findings import Finding, Severity, Span, kind
from rbxcompose.printable import plain

NO_LINK = kind("RBX9413", Severity.WARNING)
OTHER_RULES = kind("RBX9414", Severity.WARNING)
SAME_SERIAL = kind("RBX9415", Severity.WARNING)
NOT_IN_GROUP = kind("RBX9416", Severity.WARNING)
OTHER_LINK = kind("RBX9417")


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
        frozenset(one.gr_name for one in every if one.gr_gid in own),
        frozenset(one.gr_name for one in every if name in one.gr_mem),
        number == 0,
    )


Named = Mapping[str, tuple[UsbDevice, Span | None]]
"""Devices of a manifest by their names, with their places."""


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
            todo = f"sudo usermod -aG {file.group or 'dialout'} $USER, then log in again"
            words = f"'{name}' is {plain(port.path)}, which may not be opened by this user"
            yield FORBIDDEN.at(span, words, help=todo)
    for group in same_serials(ports):
        places = ", ".join(one.path for one in group)
        serial = group[0].device.serial if group[0].device else ""
        words = f"{len(group)} adapters tell the same serial number '{plain(serial)}': {places}"
        yield SAME_SERIAL.at(None, words, help="name them by 'usb_port' instead of 'serial'")
    if not named:
        yield "the robot has no devices"


def _link_findings(
    name: str, port: SerialPort, ports: Sequence[SerialPort], span: Span | None, rules_are_right: bool
) -> Iterator[Finding]:
    others = [one.path for one in ports if one != port and one.is_linked(name)]
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
