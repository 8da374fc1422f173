"""The devices that components name, and the USB adapters that are plugged in."""

import grp
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rbxcompose.base.findings import Finding, Severity, Span, kind
from rbxcompose.base.printable import plain
from rbxcompose.compiler.model.flow import setting_span
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.domains.devices.sections.devices import devices as device_section
from rbxcompose.domains.devices.serial_ports import PortError, port_path, slow_adapter
from rbxcompose.domains.devices.udev import names_of
from rbxcompose.tools.doctor import HostFacts, examination

_PREFIXES = "/dev/", "usb:", "usb@", "dev:"

NO_DEVICE = kind("RBX9411")
UNKNOWN = kind("RBX9412", Severity.WARNING)


@examination
def devices(facts: HostFacts) -> Iterator[str | Finding]:
    """Check that each device exists and may be opened."""
    named = {device: (component, place) for robot in facts.robots for component, device, place in _named(robot)}
    for device, (component, place) in sorted(named.items()):
        try:
            path, shown = Path(port_path(device)), plain(device)
        except PortError as error:
            yield NO_DEVICE.at(place, f"'{component}': {plain(str(error))}", help=error.help)
            continue
        if not path.exists():
            yield NO_DEVICE.at(
                place, f"'{component}' names {shown}, which does not exist", help="plug it in, or look below /dev"
            )
        elif not path.is_char_device():
            yield NO_DEVICE.at(place, f"'{component}' names {shown}, which is not a device", help="look below /dev")
        elif not os.access(path, os.R_OK | os.W_OK):
            todo = f"sudo usermod -aG {_group(path)} $USER, then log in again"
            yield NO_DEVICE.at(place, f"'{component}' names {shown}, which this user may not open", help=todo)
        else:
            yield f"{shown} of '{component}' can be opened"
    if not named:
        yield "no component names a device"


def _named(robot: Robot) -> Iterator[tuple[str, str, Span]]:
    """Yield the component, the name of the device and its place."""
    for component in robot.components.values():
        for name in type(component.config).model_fields:
            for text in _texts(getattr(component.config, name)):
                if text.startswith(_PREFIXES):
                    yield component.name, text, setting_span(robot, (component, name))


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for one in value.values():
            yield from _texts(one)
    elif isinstance(value, list | tuple):
        for item in value:
            yield from _texts(item)


def _group(path: Path) -> str:
    number = path.stat().st_gid
    try:
        return grp.getgrgid(number).gr_name
    except KeyError:
        return str(number)


@examination
def adapters(facts: HostFacts) -> Iterator[str | Finding]:
    """Tell which device each adapter is; one that is none is only wrong for a robot that names its devices."""
    contents = [robot.manifest.contents for robot in facts.robots]
    named = [device.wanted(name) for one in contents for name, device in one.of(device_section).items()]
    for port in facts.ports:
        if port.device is None:
            continue
        shown = f"{port.path} ({port.device.shown}{f', {plain(port.about)}' if port.about else ''})"
        if names := names_of(port, named):
            yield f"{shown} is {' and '.join(repr(name) for name in names)}"
        elif named:
            words = f"{shown} is none of the devices: {', '.join(sorted({item.name for item in named}))}"
            yield UNKNOWN.at(None, words, help="'rbxcompose udev scan' writes an entry for it")
        else:
            yield f"{shown} is plugged in; 'rbxcompose udev scan' gives it a name"
    if not any(port.device for port in facts.ports):
        yield "no USB adapter with a serial port is plugged in"


@examination
def latency(facts: HostFacts) -> Iterator[str | Finding]:
    """Check the latency timer of each adapter that has one."""
    for path, seconds in sorted(facts.latencies.items()):
        yield slow_adapter(path, seconds) or f"the adapter of {path} passes replies on after {1000 * seconds:.0f} ms"
    if not facts.latencies:
        yield "no USB adapter has a latency timer"
