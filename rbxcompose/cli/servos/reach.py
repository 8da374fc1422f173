"""What the actions of `servo` share: the bus on the port, and a servo at an id."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from rbxcompose.actuation.bus import FoundServo
from rbxcompose.actuation.dynamixel_bus import DynamixelBus
from rbxcompose.actuation.servo_findings import REFUSED, SILENT, UNKNOWN_MODEL
from rbxcompose.cli.output.console import FINDINGS, refuse, tell, tell_report
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.devices.port_errors import slow_adapter
from rbxcompose.findings import Report
from rbxcompose.printable import plain


@contextmanager
def bus_at(arguments: argparse.Namespace, baud: int) -> Iterator[DynamixelBus]:
    """Open the bus; warn of an adapter that holds replies back."""
    with DynamixelBus(arguments.port, baud=baud, timeout=arguments.timeout) as bus:
        report = Report()
        if warning := slow_adapter(bus.opened_at, bus.latency):
            report.add(warning)
            tell_report(report, {})
        yield bus


def protocols(arguments: argparse.Namespace) -> tuple[int, ...]:
    """Return the protocols to speak."""
    return (arguments.protocol,) if arguments.protocol else (1, 2)


def written(
    bus: DynamixelBus, values: Mapping[int, Mapping[str, int]], arguments: argparse.Namespace, **more: object
) -> int:
    """Write raw values by id; tell which servos have not taken them, in JSON with `more`; return the exit code."""
    failed = bus.write(values, is_confirmed=True)
    for one in sorted(failed):
        words = f"the servo at id {one} has not taken {', '.join(f'{name}={raw}' for name, raw in values[one].items())}"
        refuse(REFUSED.at(None, words, help="'rbxcompose servo info' shows its limits, and whether torque is on"))
    if arguments.json:
        tell(json.dumps({"written": sorted(set(values) - failed), "failed": sorted(failed), **more}))
    return FINDINGS if failed else 0


def known(bus: DynamixelBus, id: int, arguments: argparse.Namespace) -> FoundServo:
    """Return the servo at an id, whose model the bus knows from then on.

    Raises:
        NotDoneError: if it is silent or of an unknown model.
    """
    found = bus.ping(id, arguments.protocol)
    if found is None:
        raise NotDoneError(SILENT.at(None, f"no servo answers at id {id}", help=elsewhere(arguments)))
    if found.model is None:
        raise NotDoneError(UNKNOWN_MODEL.at(None, f"the servo at id {id} is {found.name}, which is not known"))
    bus.servos[id] = found.model
    return found


def elsewhere(arguments: argparse.Namespace) -> str:
    """Return how to look for a silent servo."""
    return f"look for it: rbxcompose servo scan --port {plain(arguments.port)} --baud 57600 115200 1000000 2000000"


def nobody(arguments: argparse.Namespace) -> int:
    """Tell that no servo answers, and return the exit code."""
    rates = " and ".join(map(str, arguments.baud))
    words = f"no servo answers on {plain(arguments.port)} at {rates} bit/s"
    return refuse(SILENT.at(None, words, help="check power and cable; try other rates with --baud"))
