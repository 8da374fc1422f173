"""A new robot made of the servos on a port: a bus, a joint for each servo, and a controller."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from rbxcompose.base.dataclass import dataclass
from rbxcompose.commands.new_files import render, yaml_text
from rbxcompose.domains.servos.models import ServoModel, stall_torque
from rbxcompose.domains.servos.transfers import cycle_load

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
