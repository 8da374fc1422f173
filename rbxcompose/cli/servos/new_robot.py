"""`servo new-robot`: a robot made of the servos that answer."""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Sequence

from rbxcompose.actuation.bus import FoundServo
from rbxcompose.cli.output.console import FINDINGS, refuse, tell, tell_report
from rbxcompose.cli.servos.reach import bus_at, nobody, protocols
from rbxcompose.cli.servos.survey import Survey, choose, survey
from rbxcompose.devices.serial_ports import port_path, serial_ports
from rbxcompose.findings import Report
from rbxcompose.manifest.files import shown_name
from rbxcompose.printable import plain
from rbxcompose.scaffold.answers import AnswerError, read_name
from rbxcompose.scaffold.new_files import taken, write_new
from rbxcompose.scaffold.servo_robot import NewServo, ServoRobotAnswers, servo_robot_files, servo_robot_paths


def new_robot(arguments: argparse.Namespace) -> int:
    """Look for servos, and write a robot of those at the rate that most have."""
    try:
        name = read_name(arguments.name, "the robot")
    except AnswerError as error:
        return refuse(error.finding)
    if finding := taken(arguments.into, servo_robot_paths(name)):
        return refuse(finding)
    choice = choose({baud: _surveyed(arguments, baud) for baud in dict.fromkeys(arguments.baud)}, arguments.port)
    report = Report()
    report.extend(choice.findings)
    tell_report(report, {})
    if not choice.servos:
        return FINDINGS if report.has_errors else nobody(arguments)
    servos = [NewServo(one.id, one.model) for one in choice.servos if one.model]
    files = servo_robot_files(ServoRobotAnswers(name, _lasting(arguments.port), choice.baud, servos))
    if finding := write_new(arguments.into, files):
        return refuse(finding)
    written = [shown_name(arguments.into / file) for file in files]
    _tell(arguments, written, choice.servos, choice.baud)
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


def _tell(arguments: argparse.Namespace, written: Sequence[str], servos: Sequence[FoundServo], baud: int) -> None:
    if arguments.json:
        found = [{"id": one.id, "protocol": one.protocol, "model": one.name} for one in servos]
        tell(json.dumps({"files": written, "baud": baud, "servos": found}))
        return
    robot = os.path.dirname(written[0])
    lines = [f"wrote {file}" for file in written]
    lines += [f"with {one.name} at id {one.id}, as servo_{one.id} and joint_{one.id}" for one in servos]
    lines += ["then:", f"  rbxcompose up {robot}", f"  rbxcompose up --real {robot}"]
    tell("\n".join(plain(line, 4096) for line in lines))
