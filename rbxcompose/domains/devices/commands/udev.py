"""Give devices on USB their names: what is plugged in, entries for `devices:`, and rules of udev.

No action but `install` changes anything, and none needs root but that. Exit codes: 0 fine, 1 errors found, 2 wrong
usage.
"""

from __future__ import annotations

import argparse
import difflib
import json
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import read_regular, replace_file
from rbxcompose.base.findings import Finding, Report, Sources, kind
from rbxcompose.commands import console
from rbxcompose.commands.console import table
from rbxcompose.commands.formats.json_ import as_data
from rbxcompose.commands.formats.text import render_text
from rbxcompose.commands.importing.manifest_text import key
from rbxcompose.commands.options import Declare, Subcommand, add_actions, add_json_option, argument, run_action
from rbxcompose.commands.targets import add_layer_options, add_path_argument, compiled, robot_path
from rbxcompose.domains.devices import udev
from rbxcompose.domains.devices.sections.devices import devices
from rbxcompose.domains.devices.serial_ports import ROOT, SerialPort, UsbDevice, serial_ports
from rbxcompose.domains.devices.udev import look_at
from rbxcompose.manifest.tree import key_span

GROUP = "system"
_GROUP_NAME = re.compile(r"[a-z_][a-z0-9_-]{0,31}")
_HEAD = ("port", "vendor", "product", "serial", "USB port", "driver", "what it is", "device")
_NUMBERS = ("vendor", "product", "interface", "usb_port")  # as they are; a serial number may need quotes
_MOST = 1 << 20  # [B] of rules
NOT_INSTALLED = kind("RBX9418")
NO_DEVICES = kind("RBX9419")
_MODE = 0o644
_YES = ("y", "yes")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    words = "look at the /sys, /dev and /etc below this folder, such as a mounted image"
    root = argument("--root", type=_folder, default=ROOT, metavar="DIR", help=words)
    shared = (add_path_argument, add_layer_options, root, add_json_option)
    words = f"the group that may open the devices (default: {udev.GROUP})"
    group = argument("--group", type=_group, default=udev.GROUP, metavar="NAME", help=words)
    yes = argument("-y", "--yes", action="store_true", help="do not ask")
    check = "report whether the devices of a robot are plugged in, named and open to you"
    install = "show the rules that would be written below /etc/udev/rules.d, ask, and write them"
    rows: tuple[tuple[str, str, Do, tuple[Declare, ...]], ...] = (
        ("scan", "list the serial ports that are plugged in, and write entries for new ones", _scan, ()),
        ("generate", "print the rules of udev for the devices of a robot", partial(_with_devices, _generate), (group,)),
        ("check", check, partial(_with_devices, _check), (group,)),
        ("install", install, partial(_with_devices, _install), (group, yes)),
    )
    add_actions(
        parser,
        (Subcommand(name, item, do, (*shared, *own), f"{item[0].upper()}{item[1:]}.") for name, item, do, own in rows),
    )


run = run_action


Do = Callable[[argparse.Namespace], int]


@dataclass(frozen=True, slots=True)
class RobotDevices:
    """The devices of a robot: by name, with their places; and whether the robot has no error."""

    robot: str
    named: udev.Named
    sources: Sources
    is_right: bool

    def rules(self, group: str) -> str:
        """Return the rules for them."""
        return udev.rules_text(self.robot, (device for device, _ in self.named.values()), group)

    @property
    def file(self) -> Path:
        """Return the path of their rules below the root."""
        return udev.rules_file(self.robot)


def _folder(text: str) -> Path:
    path = Path(text)
    if not path.is_dir():
        raise argparse.ArgumentTypeError(f"'{text}' is not a folder")
    return path.resolve()


def _group(text: str) -> str:
    if not _GROUP_NAME.fullmatch(text):
        raise argparse.ArgumentTypeError(f"'{text}' is not the name of a group")
    return text


def _with_devices(do: Callable[[argparse.Namespace, RobotDevices], int], arguments: argparse.Namespace) -> int:
    """Do something with the devices of the robot that is meant, unless it has errors, which are reported."""
    found = read_devices(robot_path(arguments.path), arguments)
    return do(arguments, found) if found is not None and found.is_right else console.FINDINGS


def read_devices(path: str, arguments: argparse.Namespace) -> RobotDevices | None:
    """Return the devices of a robot, and report its findings; None if it cannot be read."""
    found = compiled(path, arguments)
    if found.report.has_errors:
        console.write_report(found.report, found.sources)
    if found.robot is None:
        return None
    contents = found.robot.manifest.contents
    named = {
        name: (device.wanted(name), key_span(contents.root, ("devices", name)))
        for name, device in contents.of(devices).items()
    }
    return RobotDevices(found.robot.manifest.name, named, found.sources, not found.report.has_errors)


def _scan(arguments: argparse.Namespace) -> int:
    path = arguments.path if arguments.path is not None else _own()
    found = RobotDevices("", {}, {}, is_right=True) if path is None else read_devices(path, arguments)
    if found is None:
        return console.FINDINGS
    ports = serial_ports(arguments.root)
    named = [device for device, _ in found.named.values()]
    if arguments.json:
        console.emit(json.dumps([_data(port, ports, named) for port in ports], ensure_ascii=False))
    else:
        console.emit("\n".join(_lines(ports, named, found.named)))
    return 0


def _own() -> str | None:
    """Return the only robot of this folder, if it has one: what is plugged in is worth knowing without any."""
    try:
        return robot_path(None, may_run=False)
    except console.NotDoneError:
        return None


def _lines(ports: Sequence[SerialPort], named: Sequence[UsbDevice], names: Iterable[str]) -> Iterator[str]:
    if not ports:
        yield "no serial port is plugged in"
    else:
        yield table([_HEAD, *(_row(port, ports, named) for port in ports)])
    there = Counter(name for port in ports for name in udev.names_of(port, named))
    for name in names:
        if there[name] != 1:
            yield f"'{name}' means {there[name]} of these" if there[name] else f"'{name}' is not plugged in"
    new = [port for port in ports if port.device is not None and not _name(port, ports, named)]
    if new:
        yield "\nfor the manifest, each under a name of yours:\ndevices:"
        yield from (f"  NAME: {entry_of(port, ports)}" for port in new)


def _name(port: SerialPort, ports: Sequence[SerialPort], named: Sequence[UsbDevice]) -> str:
    """Return the names that mean this port and no other one."""
    others = {name for serial_port in ports if serial_port != port for name in udev.names_of(serial_port, named)}
    return ", ".join(name for name in udev.names_of(port, named) if name not in others)


def _row(port: SerialPort, ports: Sequence[SerialPort], named: Sequence[UsbDevice]) -> tuple[str, ...]:
    own = port.device or UsbDevice()
    part = f" interface {own.interface}" if own.interface else ""
    several = ", ".join(f"{name}?" for name in udev.names_of(port, named))
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
    keys = udev.proposed(port, ports)
    return f"{{{', '.join(f'{name}: {text if name in _NUMBERS else key(text)}' for name, text in keys.items())}}}"


def _data(port: SerialPort, ports: Sequence[SerialPort], named: Sequence[UsbDevice]) -> dict[str, Any]:
    own = port.device or UsbDevice()
    return {
        "path": port.path,
        "links": list(port.names),
        **{key: getattr(own, key) for key in ("vendor", "product", "serial", "usb_port", "interface")},
        "driver": port.driver,
        "about": port.about,
        "devices": udev.names_of(port, named),
        "entry": dict(udev.proposed(port, ports)),
    }


def _generate(arguments: argparse.Namespace, found: RobotDevices) -> int:
    rules = found.rules(arguments.group)
    console.emit(json.dumps({"file": f"/{found.file}", "rules": rules}) if arguments.json else rules.rstrip("\n"))
    return 0


def _check(arguments: argparse.Namespace, found: RobotDevices) -> int:
    ports = serial_ports(arguments.root)
    rules = udev.rules_answer(found.rules(arguments.group), installed(arguments.root / found.file), f"/{found.file}")
    are_right = isinstance(rules, str)
    answers = list(udev.device_answers(found.named, ports, look_at, rules_are_right=are_right))
    if found.named:
        answers += [udev.group_answer(udev.this_account(), arguments.group), rules]
    report = Report([answer for answer in answers if isinstance(answer, Finding)])
    fine = [answer for answer in answers if isinstance(answer, str)]
    if arguments.json:
        console.emit(json.dumps({"fine": fine, "findings": [as_data(finding, found.sources) for finding in report]}))
    else:
        text = render_text(report, found.sources, console.has_colour(sys.stdout))
        console.emit("\n".join([*(f"ok  {answer}" for answer in fine), text]).rstrip("\n"))
    return console.FINDINGS if report.has_errors else 0


def installed(file: Path) -> str | None:
    """Return the text of a file of rules; None if there is none that can be read."""
    try:
        return read_regular(file, _MOST).decode(errors="replace")
    except OSError:
        return None


def _install(arguments: argparse.Namespace, found: RobotDevices) -> int:
    if not found.named:
        return console.refuse(
            NO_DEVICES.at(None, f"the robot '{found.robot}' has no devices, so there are no rules to write")
        )
    path, rules = arguments.root / found.file, found.rules(arguments.group)
    before = installed(path)
    if before == rules:
        return _done(arguments, path, written=False)
    if not arguments.yes:
        if arguments.json or not sys.stdin.isatty():
            return console.misused("udev install", "there is no terminal to ask: give '--yes'")
        console.emit(_change(path, before, rules))
        if not _agreed():
            console.emit("nothing was written")
            return console.FINDINGS
    elif not arguments.json:
        console.emit(_change(path, before, rules))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, rules.encode(), mode=_MODE)
    except OSError as error:
        words = f"'{path}' cannot be written: {error.strerror}"
        tee = f"rbxcompose udev generate | sudo tee {path}"
        return console.refuse(NOT_INSTALLED.at(None, words, help=f"run it with sudo, or: {tee}"))
    return _done(arguments, path, written=True)


def _change(path: Path, before: str | None, after: str) -> str:
    """Return what would be written: all of a new file, the difference from an old one."""
    if before is None:
        return f"{path}:\n{after}"
    lines = difflib.unified_diff(before.splitlines(), after.splitlines(), str(path), "new", lineterm="")
    return "\n".join(lines)


def _agreed() -> bool:
    from rbxcompose.commands.new_files import Asker, CancelledError  # with templates, only to ask

    try:
        return Asker(is_asking=True).ask("write it?", lambda text: text.casefold() in _YES, "no")
    except CancelledError:
        return False


def _done(arguments: argparse.Namespace, path: Path, *, written: bool) -> int:
    if arguments.json:
        console.emit(json.dumps({"file": str(path), "written": written, "reload": udev.RELOAD}))
    elif written:
        console.emit(console.good(f"wrote {path}; it takes effect with: {udev.RELOAD}"))
    else:
        console.emit(f"{path} has these rules already")
    return 0
