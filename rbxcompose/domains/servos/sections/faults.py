"""The section `faults`: what goes wrong with simulated servos, and when."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

from pydantic import Field

from rbxcompose.base.config import FAULT, SERVO_BUS, Config, JointName, Name, Refers, Time
from rbxcompose.base.findings import Finding, Severity, kind
from rbxcompose.domains.servos.sections.actuators import actuators
from rbxcompose.domains.servos.sections.joints import joints, may_be_driven, unread_joints
from rbxcompose.domains.servos.twins.servo_faults import UNPLUG, FaultName
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Contents, Reading

NO_SERVO = kind("RBX2270")
OF_WHAT = kind("RBX2271")
REAL = kind("RBX2272", Severity.WARNING)


class FaultModel(Config):
    """Something that goes wrong with simulated servos."""

    at: Time = Field(ge=0)
    """When it begins, counted from the start of the robot."""
    fault: FaultName
    """What goes wrong: `overheat`, `jam`, `mute`, ..."""
    joint: JointName | None = None
    """The joint whose servo has it."""
    bus: Annotated[Name, Refers(SERVO_BUS)] | None = None
    """The bus all of whose servos have it, instead of a joint; `unplug` is of a bus."""
    for_: Time | None = Field(None, gt=0, alias="for")
    """How long it lasts; without it for good."""


def buses_of_joints(contents: Contents) -> Mapping[str, str]:
    """Return the bus that drives each joint."""
    servos = contents.of(actuators)
    return {
        name: servos[joint.servos[0]].bus
        for name, joint in contents.of(joints).items()
        if all(each in servos for each in joint.servos)
    }


def faults_of(contents: Contents, bus: str) -> dict[str, Mapping[str, object]]:
    """Return the faults of a bus and its joints as its driver takes them; real servos have none."""
    driven = buses_of_joints(contents)
    return {
        name: {"at": model.at, "fault": model.fault, "joint": model.joint or "", "lasts": model.for_}
        for name, model in (contents.of(faults) if contents.is_simulated else {}).items()
        if bus in (model.bus, driven.get(model.joint or ""))
    }


@section("faults", FaultModel, order=35, names=FAULT, entry="fault")
def faults(reading: Reading[FaultModel]) -> dict[str, FaultModel]:
    """What goes wrong with simulated servos, and when; for tests of what the robot does then.

    Example:
        body:
          urdf: robot.urdf
        buses:
          servos:
            type: dynamixel
        actuators:
          pan_servo: {bus: servos, model: AX-12, id: 1}
        joints:
          pan_joint: {actuator: pan_servo}
        faults:
          hot: {at: 3 s, joint: pan_joint, fault: overheat, for: 10 s}
          pulled: {at: 20 s, bus: servos, fault: unplug, for: 2 s}
    """
    found = reading.entries()
    wrong = {name: finding for name, entry in found.items() if (finding := _mistake(reading, name, entry))}
    reading.report.extend(wrong.values())
    if found and not reading.contents.is_simulated:
        reading.report.add(REAL.at(reading.key("faults"), "the servos are real, so nothing of this happens"))
    return {name: entry for name, entry in found.items() if name not in wrong}


def _mistake(reading: Reading[FaultModel], name: str, model: FaultModel) -> Finding | None:
    root, driven = reading.contents.root, buses_of_joints(reading.contents)
    if (model.joint is None) == (model.bus is None):
        words = "neither a joint nor a bus" if model.joint is None else "a joint and a bus"
        return OF_WHAT.at(reading.key("faults", name), f"the fault '{name}' is of {words}")
    if model.joint is not None and model.fault == UNPLUG:
        span = reading.value("faults", name, "joint")
        return OF_WHAT.at(span, f"'{model.joint}' cannot be unplugged", help="give 'bus' instead of 'joint'")
    in_doubt = may_be_driven(reading.contents, model.joint) if model.joint else bool(unread_joints(reading.contents))
    if in_doubt or (not driven and "joints" in root):
        return None  # they have mistakes, which are reported
    if model.joint is not None and model.joint not in driven:
        message, span = f"no servo drives '{model.joint}'", reading.value("faults", name, "joint")
        return NO_SERVO.misspelt(span, message, model.joint, driven, "joints with a servo")
    if model.bus is not None and model.bus not in driven.values():
        span = reading.value("faults", name, "bus")
        return NO_SERVO.at(span, f"no joint is driven by the bus '{model.bus}'", about=[model.bus])
    return None
