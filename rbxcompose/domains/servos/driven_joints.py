"""Joints that servos drive, with what is written of them and what their driver makes of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Span
from rbxcompose.base.units import ANGLE, ANGULAR_SPEED, LENGTH, SPEED, format_quantity
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.domains.body.model import BodyJoint
from rbxcompose.domains.body.sections.body import body
from rbxcompose.domains.servos.bus import DYNAMIXEL
from rbxcompose.domains.servos.joint_drive import ServoJoint
from rbxcompose.domains.servos.models import ServoModel
from rbxcompose.domains.servos.sections.joints import JointModel, joints
from rbxcompose.manifest.tree import KeyPath

BUSES = ("buses",)
ROUNDED = 0.002
"""Of a limit, by which two that mean the same may differ: 145 deg and 2.53 rad."""


@dataclass(frozen=True, slots=True)
class DrivenJoint:
    """A joint of a bus: as it is written, in the body (None without one), and as it is driven."""

    robot: Robot
    bus: str
    written: JointModel
    body: BodyJoint | None
    joint: ServoJoint
    mimics: str
    """The joint that it follows, empty if it takes commands."""

    @property
    def name(self) -> str:
        """Return its name."""
        return self.joint.name

    def key(self, *path: str | int) -> Span:
        """Return the place of a key of its entry, or of the nearest one above it."""
        return self.robot.key("joints", self.name, *path)

    def value(self, *path: str | int) -> Span:
        """Return the place of a value of its entry, or of the nearest one above it."""
        return self.robot.value("joints", self.name, *path)

    @property
    def slides(self) -> bool:
        """Return whether its positions are lengths."""
        return self.body is not None and self.body.slides

    def position(self, value: float) -> str:
        """Write a position for people."""
        return format_quantity(value, LENGTH, "cm") if self.slides else format_quantity(value, ANGLE)

    def speed(self, value: float) -> str:
        """Write a speed for people."""
        return format_quantity(value, SPEED) if self.slides else format_quantity(value, ANGULAR_SPEED)


@dataclass(frozen=True, slots=True)
class DrivenBus:
    """A bus of servos: their models and modes by id, its rates [bit/s, Hz] and the pause before a reply [s], if set."""

    name: str
    path: KeyPath
    baud: int
    rate: float
    delay: float | None
    servos: Mapping[int, tuple[ServoModel, str]]


def driven_buses(robot: Robot) -> Iterator[DrivenBus]:
    """Yield each bus of Dynamixel servos whose joints are driven."""
    for component in robot.components.values():
        bus: Any = component.config
        if component.path[:1] == BUSES and bus.kind == DYNAMIXEL:
            servos = {
                servo.id: (bus.model(servo.model), joint.mode)
                for joint in bus.joints.values()
                for servo in joint.servos
            }
            yield DrivenBus(bus.name, component.path, bus.baud, bus.rate, bus.return_delay, servos)


def driven_joints(robot: Robot) -> Iterator[DrivenJoint]:
    """Yield all joints that servos drive."""
    written = robot.manifest.contents.of(joints)
    description = robot.manifest.contents.of(body)
    known = description.body.joints if description else {}
    for component in robot.components.values():
        if component.path[:1] == BUSES:
            from rbxcompose.domains.servos.bus_config import drives_of  # slow to import, and most robots need none

            bus: Any = component.config
            for name, drive in drives_of(bus).items():
                if name in written:
                    yield DrivenJoint(
                        robot, bus.name, written[name], known.get(name), drive.joint, bus.joints[name].mimic
                    )
