"""What each action of `servo` does."""

from __future__ import annotations

import argparse
import json
import math
import os
import re
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager

from rbxcompose.base import units
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Report
from rbxcompose.base.printable import plain
from rbxcompose.commands.console import FINDINGS, NotDoneError, emit, refuse, table, write_report
from rbxcompose.commands.new_files import read_name, render, taken, write_new, yaml_text
from rbxcompose.domains.devices.serial_ports import port_path, serial_ports, slow_adapter
from rbxcompose.domains.servos.bus import ID_TAKEN, NO_ITEM, OTHER_RATE, REFUSED, SILENT, UNKNOWN_MODEL, FoundServo
from rbxcompose.domains.servos.dynamixel_bus import DynamixelBus, change_id
from rbxcompose.domains.servos.models import ServoModel, hardware_errors, stall_torque
from rbxcompose.domains.servos.transfers import cycle_load
from rbxcompose.manifest.files import shown_name

_PLAIN_PATH = re.compile(r"/[\w./:-]*\w")
_STEP = 1e-4  # [rad], to which limits are rounded
_APART = 0.1  # [m] between the joints of the drawing
_USUAL = 100  # [Hz] of a bus


@dataclass(frozen=True, slots=True)
class NewServo:
    """A servo of a new robot."""

    id: int
    model: ServoModel

    @property
    def lower(self) -> float:
        """Return the least position of its joint [rad]."""
        centre = self.model.family.centre or self.model.family.ticks // 2
        return -_within(centre * self.model.per_tick)

    @property
    def upper(self) -> float:
        """Return the greatest position of its joint [rad]."""
        centre = self.model.family.centre or self.model.family.ticks // 2
        return _within((self.model.family.ticks - 1 - centre) * self.model.per_tick)

    @property
    def effort(self) -> float:
        """Return the greatest torque of its joint [Nm]: all that its servo has, 0 if that is not known."""
        return stall_torque(self.model) or 0.0


@dataclass(frozen=True, slots=True)
class ServoRobotAnswers:
    """What must be known about a new robot made of servos: `baud` in bits per second."""

    name: str
    port: str
    baud: int
    servos: Sequence[NewServo]

    @property
    def rate(self) -> int:
        """Return how often all of them can be read and written [Hz], 100 at most."""
        load = cycle_load({servo.id: (servo.model, "position") for servo in self.servos})
        return max(1, min(_USUAL, math.floor(1.0 / load.time(self.baud))))


def servo_robot_paths(name: str) -> tuple[str, str]:
    """Return the paths of the robot's file and of its body."""
    return f"robots/{name}/robot.yaml", f"robots/{name}/{name}.urdf"


def servo_robot_files(answers: ServoRobotAnswers) -> dict[str, str]:
    """Return the texts of the robot's file and of its body, by path."""
    robot, body = servo_robot_paths(answers.name)
    port = answers.port if _PLAIN_PATH.fullmatch(answers.port) else yaml_text(answers.port)
    placed = [(servo, f"{index * _APART:.2f}") for index, servo in enumerate(answers.servos)]
    width = f"{len(placed) * _APART:.2f}"
    middle = f"{(len(placed) - 1) * _APART / 2:.2f}"
    values = {"name": answers.name, "port": port, "baud": answers.baud, "rate": answers.rate, "servos": answers.servos}
    return {
        robot: render("servo_robot.yaml.j2", **values),
        body: render("servo_robot.urdf.j2", name=answers.name, placed=placed, width=width, middle=middle),
    }


def _within(angle: float) -> float:
    """Return an angle with few digits that is not beyond."""
    return round(math.floor(angle / _STEP) * _STEP, 4)


@contextmanager
def bus_at(arguments: argparse.Namespace, baud: int) -> Iterator[DynamixelBus]:
    """Open the bus; warn of an adapter that holds replies back."""
    with DynamixelBus(arguments.port, baud=baud, timeout=arguments.timeout) as bus:
        report = Report()
        if warning := slow_adapter(bus.opened_at, bus.latency):
            report.add(warning)
            write_report(report, {})
        yield bus


def protocols(arguments: argparse.Namespace) -> tuple[int, ...]:
    """Return the protocols to speak."""
    return (arguments.protocol,) if arguments.protocol else (1, 2)


def written(
    bus: DynamixelBus, values: Mapping[int, Mapping[str, int]], arguments: argparse.Namespace, **more: object
) -> int:
    """Write raw values by id; report which servos have not taken them, in JSON with `more`; return the exit code."""
    failed = bus.write(values, is_confirmed=True)
    for one in sorted(failed):
        words = f"the servo at id {one} has not taken {', '.join(f'{name}={raw}' for name, raw in values[one].items())}"
        refuse(REFUSED.at(None, words, help="'rbxcompose servo info' shows its limits, and whether torque is on"))
    if arguments.json:
        emit(json.dumps({"written": sorted(set(values) - failed), "failed": sorted(failed), **more}))
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
    """Report that no servo answers, and return the exit code."""
    rates = " and ".join(map(str, arguments.baud))
    words = f"no servo answers on {plain(arguments.port)} at {rates} bit/s"
    return refuse(SILENT.at(None, words, help="check power and cable; try other rates with --baud"))


DIMENSIONS: Mapping[str, units.Dimension] = {
    "rad": units.ANGLE,
    "rad/s": units.ANGULAR_SPEED,
    "rad/s^2": units.ANGULAR_ACCELERATION,
    "V": units.VOLTAGE,
    "A": units.CURRENT,
    "s": units.TIME,
    "degC": units.TEMPERATURE,
    "1": units.RATIO,
}


def unknown_item(model: ServoModel, name: str) -> Finding:
    """Return the finding about an item that a model does not have."""
    return NO_ITEM.misspelt(None, f"{model.name} has no item '{plain(name)}'", name, model.items, "items")


def shown(model: ServoModel, item: str, raw: int) -> tuple[float, str]:
    """Return a raw value in its SI unit; the unit is empty for a code."""
    where = model.items.get(item)
    return (where.to_si(raw), where.unit) if where else (raw, "")


def _raw_value(model: ServoModel, text: str) -> tuple[str, int]:
    name, equals, value = text.partition("=")
    if name not in model.items:
        raise NotDoneError(unknown_item(model, name))
    item = model.items[name]
    try:
        raw = int(value) if value.lstrip("-").isdecimal() else item.to_raw(_quantity(item.unit, value))
        item.encode(raw)
    except (units.UnitError, ValueError) as error:
        words = f"'{plain(text)}': {error}" if equals else f"'{plain(text)}' lacks '=' and a value"
        raise NotDoneError(NO_ITEM.at(None, words, help="write a raw number or a quantity with its unit")) from error
    return name, raw


def _quantity(unit: str, text: str) -> float:
    if unit not in DIMENSIONS:
        raise ValueError("must be a whole number")
    return units.to_si(text, DIMENSIONS[unit])


_TORQUE, _LIMIT, _MOST = "torque_enable", "torque_limit", "max_torque"


def _relaxed(bus: DynamixelBus, ids: Sequence[int], arguments: argparse.Namespace) -> int:
    """Switch torque off."""
    return written(bus, {item: {_TORQUE: 0} for item in ids}, arguments)


def _disabled(bus: DynamixelBus, ids: Sequence[int], arguments: argparse.Namespace) -> int:
    limited = [one for one in ids if bus.servos[one].family.enables_at_goal]
    values = {one: {_TORQUE: 0, _LIMIT: 0} if one in limited else {_TORQUE: 0} for one in ids}
    code = written(bus, values, arguments, limited=limited)
    if not code and not arguments.json:
        for number in ids:
            words = (
                "ignores goals until 'servo enable', or until it is switched off and on"
                if number in limited
                else "is relaxed: no goal switches its torque on, so there is nothing more to disable"
            )
            emit(f"the {bus.servos[number].name} at id {number} {words}")
    return code


def _enabled(bus: DynamixelBus, ids: Sequence[int], arguments: argparse.Namespace) -> int:
    _hold(bus, ids)
    values = {number: {_TORQUE: 1, **_undone(bus, number)} for number in ids}
    return written(bus, values, arguments)


def _hold(bus: DynamixelBus, ids: Sequence[int]) -> None:
    """Let the goals be the present positions, so that torque moves nothing."""
    now = bus.read(ids, ["present_position"])
    bus.write({number: {"goal_position": reading.values["present_position"]} for number, reading in now.items()})


def _undone(bus: DynamixelBus, id: int) -> dict[str, int]:
    """Return the torque limit that replaces 0, which `disable` or an overload has left."""
    if _MOST not in bus.servos[id].items:
        return {}
    reading = bus.read([id], [_LIMIT, _MOST]).get(id)
    return {_LIMIT: reading.values[_MOST]} if reading and reading.values[_LIMIT] == 0 else {}


_IDS = range(1, 253)
_CHECKED = ("present_position", "present_temperature")


@dataclass(frozen=True, slots=True)
class Survey:
    """What answers at one rate: servos that are alone at their ids, and ids with more than one, in protocols."""

    found: Sequence[FoundServo]
    crowded: Sequence[int] = ()


@dataclass(frozen=True, slots=True)
class Choice:
    """The servos of a robot, all at one rate [bit/s], and what is to be said about the others."""

    baud: int
    servos: Sequence[FoundServo]
    findings: Sequence[Finding]


def survey(bus: DynamixelBus, ids: Iterable[int], protocols: Sequence[int]) -> Survey:
    """Look for servos; one that answers a ping but no read shares its id."""
    found: list[FoundServo] = []
    crowded: list[int] = []
    for number in ids:
        counted = {protocol: bus.count(number, protocol) for protocol in protocols}
        pings = (bus.ping(number, protocol) for protocol in protocols if counted[protocol] == 1)
        answers = [answer for answer in pings if answer]
        if sum(counted.values()) > 1 or not all(_is_readable(bus, answer) for answer in answers):
            crowded.append(number)
        else:
            found += answers
    return Survey(found, crowded)


def _is_readable(bus: DynamixelBus, found: FoundServo) -> bool:
    if found.model is None:
        return True
    bus.servos[found.id] = found.model
    is_readable = bool(bus.read([found.id], _CHECKED))
    del bus.servos[found.id]
    return is_readable


def choose(surveys: Mapping[int, Survey], port: str) -> Choice:
    """Return the servos at the rate that most of them have, the higher one if two have as many.

    Raises:
        ValueError: if there is no survey.
    """
    baud = max(surveys, key=lambda rate: (len(_usable(surveys[rate])), rate))
    chosen = _usable(surveys[baud])
    return Choice(baud, chosen, tuple(_left_out(surveys, baud, chosen, port)))


def _usable(one: Survey) -> list[FoundServo]:
    return [found for found in one.found if found.model]


def _left_out(surveys: Mapping[int, Survey], baud: int, chosen: Sequence[FoundServo], port: str) -> Iterator[Finding]:
    taken = {servo.id for servo in chosen}
    for rate, there in surveys.items():
        for id_ in there.crowded:
            message = f"more than one servo answers at id {id_} with {rate} bit/s; it is left out"
            yield ID_TAKEN.at(None, message, help=f"connect one alone: rbxcompose servo set-id {id_} NEW --port {port}")
        for found in there.found:
            if found.model is None:
                message = f"the servo at id {found.id} is {found.name}, which is not known; it is left out"
                yield UNKNOWN_MODEL.at(None, message)
            elif rate != baud:
                message = f"the {found.name} at id {found.id} has {rate} bit/s, the bus {baud}; it is left out"
                yield OTHER_RATE.at(None, message, help=_moved(found, baud, taken, port))
                taken.add(found.id)


def _moved(found: FoundServo, baud: int, taken: set[int], port: str) -> str:
    """Return how a servo comes to another rate, and to another id if its own is taken there."""
    code = found.model.code_of(baud) if found.model else None
    if code is None:
        return f"its model does not have {baud} bit/s: give the others a rate that it has"
    where = f"--port {port} --baud {found.baud}"
    steps, id_ = [], found.id
    if id_ in taken:
        id_ = next((index for index in _IDS if index not in taken), id_)
        steps.append(f"rbxcompose servo set-id {found.id} {id_} {where}")
    steps += [f"rbxcompose servo relax {id_} {where}", f"rbxcompose servo write {id_} baud={code} {where}"]
    return "; ".join(steps)


def new_robot(arguments: argparse.Namespace) -> int:
    """Look for servos, and write a robot of those at the rate that most have."""
    name = read_name(arguments.name, "the robot")
    if finding := taken(arguments.into, servo_robot_paths(name)):
        return refuse(finding)
    choice = choose({baud: _surveyed(arguments, baud) for baud in dict.fromkeys(arguments.baud)}, arguments.port)
    report = Report()
    report.extend(choice.findings)
    write_report(report, {})
    if not choice.servos:
        return FINDINGS if report.has_errors else nobody(arguments)
    servos = [NewServo(servo.id, servo.model) for servo in choice.servos if servo.model]
    files = servo_robot_files(ServoRobotAnswers(name, _lasting(arguments.port), choice.baud, servos))
    if finding := write_new(arguments.into, files):
        return refuse(finding)
    written = [shown_name(arguments.into / file) for file in files]
    _report_files(arguments, written, choice.servos, choice.baud)
    return FINDINGS if report.has_errors else 0


def _lasting(name: str) -> str:
    """Return the name of a port that stays the same, if it has one, else its path."""
    path = port_path(name)
    ports = {port.path: port for port in serial_ports()}
    port = ports.get(os.path.realpath(path))
    return port.names[0] if port and port.names else os.path.abspath(path)


def _surveyed(arguments: argparse.Namespace, baud: int) -> Survey:
    with bus_at(arguments, baud) as bus:
        return survey(bus, range(arguments.last + 1), protocols(arguments))


def _report_files(
    arguments: argparse.Namespace, written: Sequence[str], servos: Sequence[FoundServo], baud: int
) -> None:
    if arguments.json:
        found = [{"id": servo.id, "protocol": servo.protocol, "model": servo.name} for servo in servos]
        emit(json.dumps({"files": written, "baud": baud, "servos": found}))
        return
    robot = os.path.dirname(written[0])
    lines = [f"wrote {file}" for file in written]
    lines += [f"with {servo.name} at id {servo.id}, as servo_{servo.id} and joint_{servo.id}" for servo in servos]
    lines += ["then:", f"  rbxcompose up {robot}", f"  rbxcompose up --real {robot}"]
    emit("\n".join(plain(line, 4096) for line in lines))


_BLINKS, _HALF = 3, 0.3  # times; [s] on and [s] off


def _scan(arguments: argparse.Namespace) -> int:
    found: list[FoundServo] = []
    for baud in dict.fromkeys(arguments.baud):
        with bus_at(arguments, baud) as bus:
            found += bus.scan(range(arguments.last + 1), protocols(arguments))
    return _listed(found, arguments)


def _ping(bus: DynamixelBus, arguments: argparse.Namespace) -> int:
    answers = {one: bus.ping(one, arguments.protocol) for one in arguments.ids}
    for one in (name for name, found in answers.items() if found is None):
        refuse(SILENT.at(None, f"no servo answers at id {one}", help=elsewhere(arguments)))
    found = [servo for servo in answers.values() if servo]
    if found:
        _listed(found, arguments)
    return 0 if len(found) == len(answers) else FINDINGS


def _listed(found: list[FoundServo], arguments: argparse.Namespace) -> int:
    """List servos; it is an error if there are none."""
    if not found:
        return nobody(arguments)
    if arguments.json:
        emit(json.dumps([{"id": s.id, "protocol": s.protocol, "model": s.name, "baud": s.baud} for s in found]))
    else:
        rows = [(str(s.id), f"{s.protocol}.0", s.name, str(s.baud)) for s in found]
        emit(table([("id", "protocol", "model", "baud"), *rows]))
    return 0


def _info(bus: DynamixelBus, arguments: argparse.Namespace) -> int:
    found = known(bus, arguments.id, arguments)
    return _show_values(bus, found, list(bus.servos[arguments.id].items), arguments)


def _read(bus: DynamixelBus, arguments: argparse.Namespace) -> int:
    found = known(bus, arguments.id, arguments)
    model = bus.servos[found.id]
    wrong = [name for name in arguments.items if name not in model.items and name != "hardware_error"]
    if wrong:
        return refuse(unknown_item(model, wrong[0]))
    return _show_values(bus, found, arguments.items, arguments)


def _show_values(bus: DynamixelBus, found: FoundServo, items: list[str], arguments: argparse.Namespace) -> int:
    reading = bus.read([found.id], items).get(found.id)
    if reading is None:
        words = f"the servo at id {found.id} answers a ping, but no read: perhaps two servos have this id"
        return refuse(SILENT.at(None, words, help="connect one alone"))
    values = {name: shown(bus.servos[found.id], name, reading.values[name]) for name in items}
    if arguments.json:
        raws = reading.values
        shown_values = {name: {"raw": raws[name], "value": value, "unit": u} for name, (value, u) in values.items()}
        emit(json.dumps({"id": found.id, "model": found.name, "values": shown_values}))
        return 0
    rows = [
        (name, str(reading.values[name]), f"{item:.6g} {unit}" if unit else "") for name, (item, unit) in values.items()
    ]
    emit(f"{found.name}, id {found.id}, protocol {found.protocol}.0")
    emit(table([("item", "raw", "value"), *rows]))
    if faults := hardware_errors(reading.values.get("hardware_error", 0)):
        emit(f"it reports: {', '.join(faults)}")
    return 0


def _write(bus: DynamixelBus, arguments: argparse.Namespace) -> int:
    known(bus, arguments.id, arguments)
    values = dict(_raw_value(bus.servos[arguments.id], text) for text in arguments.values)
    return written(bus, {arguments.id: values}, arguments)


def _set_id(bus: DynamixelBus, arguments: argparse.Namespace) -> int:
    if finding := change_id(bus, arguments.old, arguments.new):
        return refuse(finding)
    emit(json.dumps({"id": arguments.new}) if arguments.json else f"the servo has the id {arguments.new}")
    return 0


def _reboot(bus: DynamixelBus, arguments: argparse.Namespace) -> int:
    for one in arguments.ids:
        found = known(bus, one, arguments)
        if not bus.reboot(one):
            words = f"the servo at id {one} has not started again"
            old = "protocol 1.0 has no reboot: switch it off and on" if found.protocol == 1 else ""
            return refuse(REFUSED.at(None, words, help=old))
    return 0


def _identify(bus: DynamixelBus, arguments: argparse.Namespace) -> int:
    for one in arguments.ids:
        known(bus, one, arguments)
    for blink in range(2 * _BLINKS):
        bus.write({one: {"led": 1 - blink % 2} for one in arguments.ids}, is_confirmed=True)
        time.sleep(_HALF)
    return 0


def _on_bus(do: Callable[[DynamixelBus, argparse.Namespace], int]) -> Callable[[argparse.Namespace], int]:
    """Return an action that opens the bus."""

    def run(arguments: argparse.Namespace) -> int:
        with bus_at(arguments, arguments.baud[0]) as bus:
            return do(bus, arguments)

    return run


def _on_servos(
    do: Callable[[DynamixelBus, Sequence[int], argparse.Namespace], int],
) -> Callable[[argparse.Namespace], int]:
    """Return an action with known servos: those that are named, or all that answer."""

    def run(bus: DynamixelBus, arguments: argparse.Namespace) -> int:
        ids = arguments.ids
        if arguments.all:
            ids = [servo.id for servo in bus.scan(range(arguments.last + 1), protocols(arguments)) if servo.model]
        if not ids:
            return refuse(SILENT.at(None, "no servo is named and none answers", help="name ids, or use --all"))
        for number in ids:
            known(bus, number, arguments)
        return do(bus, ids, arguments)

    return _on_bus(run)


ACTIONS: Mapping[str, Callable[[argparse.Namespace], int]] = {
    "scan": _scan,
    "ping": _on_bus(_ping),
    "info": _on_bus(_info),
    "read": _on_bus(_read),
    "write": _on_bus(_write),
    "set-id": _on_bus(_set_id),
    "reboot": _on_bus(_reboot),
    "relax": _on_servos(_relaxed),
    "disable": _on_servos(_disabled),
    "enable": _on_servos(_enabled),
    "identify": _on_bus(_identify),
    "new-robot": new_robot,
}
"""By name."""
