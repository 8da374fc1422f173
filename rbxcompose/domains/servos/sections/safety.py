"""The section `safety`: what happens to the torque of joints, and the emergency stop."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from rbxcompose.base.config import AngularSpeed, Config, JointName, Temperature, Time
from rbxcompose.base.findings import kind
from rbxcompose.domains.servos.sections.faults import buses_of_joints
from rbxcompose.domains.servos.sections.joints import JointPosition
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading, WantedComponent, Wiring

THERMAL_ORDER = kind("RBX2218")
NOTHING_TO_PARK = kind("RBX2219")


class ThermalModel(Config):
    """Temperatures of joints."""

    warn: Temperature = 50.0
    """Above this, diagnostics warn."""
    limit: Temperature = 60.0
    """Above this, a joint loses its torque and rests."""
    resume: Temperature = 45.0
    """It rests until it is at this or below."""
    rest: Time = Field(60.0, ge=0)
    """It rests for this long at least."""
    scope: Literal["joint", "bus"] = "joint"
    """Whether a joint that is too hot rests alone, or all joints of its bus with it."""


class EstopModel(Config):
    """An emergency stop: a topic that reports whether it is pressed."""

    topic: str = "estop"
    """Where messages of `std_msgs/Bool` come; the first that is true stops the robot until `release`."""
    deadline: Time = Field(0.5, gt=0)
    """Silence after which the robot is stopped, too, counted from the start."""
    what: Literal["hold", "relax"] = "hold"
    """Whether joints then hold or lose their torque."""


class SafetyModel(Config):
    """What joints do without commands."""

    on_start: Literal["relax", "hold"] = "relax"
    """Whether joints have torque from the start."""
    on_shutdown: Literal["relax", "hold", "park"] = "relax"
    """What happens to torque when the robot goes down or its driver fails; `park` moves there, then relaxes."""
    park: dict[JointName, JointPosition] = {}
    """Where joints are parked."""
    park_time: Time = Field(10.0, gt=0)
    """How long they may take to get there."""
    start_speed: AngularSpeed | None = Field(None, gt=0)
    """Largest speed of single commands, until `set_speed` gives a joint another one."""
    thermal: ThermalModel = ThermalModel()
    """When joints are too hot, and what happens then."""
    estop: EstopModel | None = None
    """The emergency stop, if there is one."""


def _components(contents: Contents, wiring: Wiring) -> Iterator[WantedComponent]:
    """Yield the component that stops the robot."""
    if (estop := contents.of(safety).estop) is not None:
        relaxed = sorted(set(buses_of_joints(contents).values())) if estop.what == "relax" else []
        config = {"topic": estop.topic, "deadline": estop.deadline, "relaxes": relaxed}
        yield WantedComponent("estop", "estop", config, ("safety", "estop"))


@section("safety", SafetyModel, order=35, wires=True, shared=((), ("park",)), components=_components)
def safety(reading: Reading[SafetyModel]) -> SafetyModel:
    """What happens to the torque of joints at the start, at the end, and when they are too hot; the emergency stop.

    Example:
        safety:
          on_shutdown: hold
          thermal: {limit: 65 degC, resume: 50 degC}
    """
    read = reading.whole() or SafetyModel()
    heat = read.thermal
    if not (heat.resume < heat.limit and heat.warn <= heat.limit):
        message = f"resume {heat.resume:g} degC, warn {heat.warn:g} degC, limit {heat.limit:g} degC"
        key, order = ("warn", "not above") if heat.resume < heat.limit else ("resume", "below")
        help_text = f"'{key}' must be {order} 'limit', {heat.limit:g} degC: write it, or raise 'limit'"
        reading.report.add(THERMAL_ORDER.at(reading.key("safety", "thermal"), message, help=help_text))
    if read.on_shutdown == "park" and not read.park:
        span = reading.key("safety", "on_shutdown")
        message = "joints are to be parked, but 'park' names none"
        help_text = "add 'park: {JOINT: 0 deg}' beside it, with the position of each joint"
        reading.report.add(NOTHING_TO_PARK.at(span, message, help=help_text))
    return read
