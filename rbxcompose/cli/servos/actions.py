"""What each action of `servo` does."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Mapping

from rbxcompose.actuation.bus import FoundServo
from rbxcompose.actuation.dynamixel_bus import DynamixelBus
from rbxcompose.actuation.dynamixel_ids import change_id
from rbxcompose.actuation.servo_findings import REFUSED, SILENT
from rbxcompose.actuation.servo_models import hardware_errors
from rbxcompose.cli.bus.entities import table
from rbxcompose.cli.output.console import FINDINGS, refuse, tell
from rbxcompose.cli.robots.lookup import NotDoneError
from rbxcompose.cli.servos import torque
from rbxcompose.cli.servos.new_robot import new_robot
from rbxcompose.cli.servos.reach import bus_at, elsewhere, known, nobody, protocols, written
from rbxcompose.cli.servos.values import raw_values, shown, unknown_item

_BLINKS, _HALF = 3, 0.3  # times; [s] on and [s] off


def _scan(arguments: argparse.Namespace) -> int:
    found: list[FoundServo] = []
    for baud in dict.fromkeys(arguments.baud):
        with bus_at(arguments, baud) as bus:
            found += bus.scan(range(arguments.last + 1), protocols(arguments))
    return _told(found, arguments)


def _ping(arguments: argparse.Namespace) -> int:
    with bus_at(arguments, arguments.baud[0]) as bus:
        answers = {one: bus.ping(one, arguments.protocol) for one in arguments.ids}
    for one in (one for one, found in answers.items() if found is None):
        refuse(SILENT.at(None, f"no servo answers at id {one}", help=elsewhere(arguments)))
    found = [one for one in answers.values() if one]
    if found:
        _told(found, arguments)
    return 0 if len(found) == len(answers) else FINDINGS


def _told(found: list[FoundServo], arguments: argparse.Namespace) -> int:
    """List servos; it is an error if there are none."""
    if not found:
        return nobody(arguments)
    if arguments.json:
        tell(json.dumps([{"id": s.id, "protocol": s.protocol, "model": s.name, "baud": s.baud} for s in found]))
    else:
        rows = [(str(s.id), f"{s.protocol}.0", s.name, str(s.baud)) for s in found]
        tell(table([("id", "protocol", "model", "baud"), *rows]))
    return 0


def _info(arguments: argparse.Namespace) -> int:
    with bus_at(arguments, arguments.baud[0]) as bus:
        found = known(bus, arguments.id, arguments)
        return _tell_values(bus, found, list(bus.servos[arguments.id].items), arguments)


def _read(arguments: argparse.Namespace) -> int:
    with bus_at(arguments, arguments.baud[0]) as bus:
        found = known(bus, arguments.id, arguments)
        model = bus.servos[found.id]
        wrong = [name for name in arguments.items if name not in model.items and name != "hardware_error"]
        if wrong:
            return refuse(unknown_item(model, wrong[0]))
        return _tell_values(bus, found, arguments.items, arguments)


def _tell_values(bus: DynamixelBus, found: FoundServo, items: list[str], arguments: argparse.Namespace) -> int:
    reading = bus.read([found.id], items).get(found.id)
    if reading is None:
        words = f"the servo at id {found.id} answers a ping, but no read: perhaps two servos have this id"
        return refuse(SILENT.at(None, words, help="connect one alone"))
    values = {name: shown(bus.servos[found.id], name, reading.values[name]) for name in items}
    if arguments.json:
        told = {name: {"raw": reading.values[name], "value": value, "unit": u} for name, (value, u) in values.items()}
        tell(json.dumps({"id": found.id, "model": found.name, "values": told}))
        return 0
    rows = [
        (name, str(reading.values[name]), f"{value:.6g} {unit}" if unit else "")
        for name, (value, unit) in values.items()
    ]
    tell(f"{found.name}, id {found.id}, protocol {found.protocol}.0")
    tell(table([("item", "raw", "value"), *rows]))
    if faults := hardware_errors(reading.values.get("hardware_error", 0)):
        tell(f"it reports: {', '.join(faults)}")
    return 0


def _write(arguments: argparse.Namespace) -> int:
    with bus_at(arguments, arguments.baud[0]) as bus:
        known(bus, arguments.id, arguments)
        values = raw_values(bus.servos[arguments.id], arguments.values)
        return written(bus, {arguments.id: values}, arguments)


def _set_id(arguments: argparse.Namespace) -> int:
    with bus_at(arguments, arguments.baud[0]) as bus:
        if finding := change_id(bus, arguments.old, arguments.new):
            return refuse(finding)
    tell(json.dumps({"id": arguments.new}) if arguments.json else f"the servo has the id {arguments.new}")
    return 0


def _reboot(arguments: argparse.Namespace) -> int:
    with bus_at(arguments, arguments.baud[0]) as bus:
        for one in arguments.ids:
            found = known(bus, one, arguments)
            if not bus.reboot(one):
                words = f"the servo at id {one} has not started again"
                old = "protocol 1.0 has no reboot: switch it off and on" if found.protocol == 1 else ""
                return refuse(REFUSED.at(None, words, help=old))
    return 0


def _identify(arguments: argparse.Namespace) -> int:
    with bus_at(arguments, arguments.baud[0]) as bus:
        for one in arguments.ids:
            known(bus, one, arguments)
        for blink in range(2 * _BLINKS):
            bus.write({one: {"led": 1 - blink % 2} for one in arguments.ids}, is_confirmed=True)
            time.sleep(_HALF)
    return 0


def _done(do: Callable[[argparse.Namespace], int]) -> Callable[[argparse.Namespace], int]:
    """Let an action end with the finding of what cannot be done."""

    def run(arguments: argparse.Namespace) -> int:
        try:
            return do(arguments)
        except NotDoneError as error:
            return refuse(error.finding)

    return run


ACTIONS: Mapping[str, Callable[[argparse.Namespace], int]] = {
    "scan": _scan,
    "ping": _ping,
    "info": _done(_info),
    "read": _done(_read),
    "write": _done(_write),
    "set-id": _set_id,
    "reboot": _done(_reboot),
    "relax": _done(torque.relax),
    "disable": _done(torque.disable),
    "enable": _done(torque.enable),
    "identify": _done(_identify),
    "new-robot": new_robot,
}
"""By name."""
