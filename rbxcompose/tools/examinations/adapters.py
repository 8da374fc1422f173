"""USB adapters that are plugged in."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.base.findings import Finding, Severity, kind
from rbxcompose.base.printable import plain
from rbxcompose.domains.devices.sections.devices import devices
from rbxcompose.domains.devices.udev import names_of
from rbxcompose.tools.doctor import HostFacts, examination

UNKNOWN = kind("RBX9412", Severity.WARNING)


@examination
def adapters(facts: HostFacts) -> Iterator[str | Finding]:
    """Tell which device each adapter is; one that is none is only wrong for a robot that names its devices."""
    contents = [robot.manifest.contents for robot in facts.robots]
    named = [device.wanted(name) for one in contents for name, device in one.of(devices).items()]
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
