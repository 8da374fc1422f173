"""The robot that several files of ArbotiX make: who is on which bus, and what they disagree about."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from typing import Protocol, TypeVar

from rbxcompose.dataclass import dataclass
from rbxcompose.findings import Related, Report, Severity, Span, kind
from rbxcompose.importing.arbotix.controllers import DiffController, FollowController
from rbxcompose.importing.arbotix.driver import ArbotixDriver, ArbotixFile
from rbxcompose.importing.arbotix.grippers import ArbotixGripper
from rbxcompose.importing.arbotix.servo_joints import ArbotixJoint
from rbxcompose.importing.foreign_files import Given
from rbxcompose.importing.importer import DISAGREES, NOT_CARRIED_OVER
from rbxcompose.printable import plain
from rbxcompose.sections.actuators import ONE_ID
from rbxcompose.sections.controllers import NOT_DRIVEN

NO_URDF = kind("RBX2239", Severity.WARNING)

USUAL_PORT = "/dev/ttyUSB0"


class Placed(Protocol):
    """Something that a file has: a joint or a controller."""

    @property
    def name(self) -> str:
        """The name."""

    @property
    def span(self) -> Span:
        """The place."""


P = TypeVar("P", bound=Placed)


@dataclass(slots=True)
class ServoLine:
    """A serial line: all that files say of it, and the joints on it."""

    port: Given[str] | None = None
    baud: Given[int] | None = None
    rate: Given[float] | None = None
    idle: dict[str, Span] = field(default_factory=dict)
    joints: dict[str, ArbotixJoint] = field(default_factory=dict)


@dataclass(slots=True)
class ArbotixRobot:
    """All joints and controllers by their names, and the lines by their ports."""

    lines: dict[str, ServoLine] = field(default_factory=dict)
    joints: dict[str, ArbotixJoint] = field(default_factory=dict)
    left_out: set[str] = field(default_factory=set)
    controllers: dict[str, FollowController | DiffController | ArbotixGripper] = field(default_factory=dict)

    def missing(self, controller: FollowController | ArbotixGripper) -> list[str]:
        """Return the joints of a controller that are not there."""
        return [one.value for one in controller.joints if one.value not in self.joints]


def merged(files: Sequence[ArbotixFile], report: Report) -> ArbotixRobot:
    """Return the robot that the files make together; of two things of one name, the first."""
    robot = ArbotixRobot()
    drivers = [driver for file in files for driver in file.drivers]
    first_port = next((one.port.value for one in drivers if one.port), USUAL_PORT)
    for driver in drivers:
        line = robot.lines.setdefault(driver.port.value if driver.port else first_port, ServoLine())
        _join(line, driver, report)
        for joint in driver.joints.values():
            if _first(robot.joints, joint, "joint", report):
                _add(line, joint, report)
        robot.left_out |= driver.left_out
    controllers = (one for driver in drivers for one in driver.controllers)
    for controller in (*controllers, *(one for file in files for one in file.grippers)):
        _first(robot.controllers, controller, "controller", report)
    _drop_lost(robot, report)
    if first := next(iter(robot.joints.values()), None):
        words = "the joints need the robot's URDF, which these files do not name"
        report.add(NO_URDF.at(first.span, words, help="name it in the manifest: 'body: {urdf: FILE}'"))
    return robot


def _first(known: dict[str, P], one: P, what: str, report: Report) -> bool:
    """Add a thing under its name and return True, unless there is one; tell if that is another one."""
    other = known.setdefault(one.name, one)
    if other != one:
        words = f"the {what} '{plain(one.name, 60)}' was something else before; the first one counts"
        report.add(DISAGREES.at(one.span, words, related=[Related(other.span, "the first one")]))
    return other is one


def _join(line: ServoLine, driver: ArbotixDriver, report: Report) -> None:
    line.port = line.port or driver.port
    if line.baud and driver.baud and line.baud != driver.baud:
        words = f"one line has two rates: {line.baud.value} and {driver.baud.value} bit/s; the first one counts"
        report.add(DISAGREES.at(driver.baud.span, words, related=[Related(line.baud.span, "the first one")]))
    line.baud = line.baud or driver.baud
    rates = [one for one in (line.rate, driver.rate) if one]
    line.rate = max(rates, key=lambda one: one.value) if rates else None
    line.idle = {**driver.idle, **line.idle}


def _add(line: ServoLine, joint: ArbotixJoint, report: Report) -> None:
    other = next((one for one in line.joints.values() if one.id == joint.id), None)
    if other is not None:
        words = (
            f"the servos of '{plain(other.name, 60)}' and '{plain(joint.name, 60)}' have the same id {joint.id.value}"
        )
        report.add(ONE_ID.at(joint.id.span, words, related=[Related(other.id.span, "the other one")]))
    line.joints[joint.name] = joint


def _drop_lost(robot: ArbotixRobot, report: Report) -> None:
    """Drop controllers whose joints are not there; joints that were left out have been told."""
    for name, one in list(robot.controllers.items()):
        if isinstance(one, DiffController):
            continue
        unknown = [joint for joint in one.joints if joint.value not in robot.joints.keys() | robot.left_out]
        for joint in unknown:
            words = f"the controller '{plain(name, 60)}' leads '{plain(joint.value, 60)}', which no file has"
            report.add(NOT_DRIVEN.misspelt(joint.span, words, joint.value, robot.joints, "joints"))
        gone = robot.missing(one)
        if len(gone) == len(one.joints) or (gone and isinstance(one, ArbotixGripper)):
            del robot.controllers[name]
            if not unknown:
                words = f"controller '{plain(name, 60)}' is not carried over: its joints are left out"
                report.add(NOT_CARRIED_OVER.at(one.span, words))
