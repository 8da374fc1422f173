"""The section `controllers`: what leads groups of joints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from pydantic import Field

from rbxcompose.config import Config, JointName
from rbxcompose.findings import Finding, kind
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Reading
from rbxcompose.manifest.tree import value_span
from rbxcompose.references import CONTROLLER
from rbxcompose.sections.actuators import actuators
from rbxcompose.sections.joints import joints

NOT_DRIVEN = kind(
    "RBX2215",
    """A controller leads a joint that it cannot drive

Each joint of a controller has a servo, and the servos of one controller are on one bus.

Bad: a controller with the joint `tilt_joint`, which `joints:` does not have.
Good: `tilt_joint: {actuator: tilt_servo}` under `joints:`.
""",
)


class ControllerModel(Config):
    """Leads joints together."""

    type: Literal["joint_trajectory"]
    """How: `joint_trajectory` follows trajectories, by the action `NAME/follow_joint_trajectory`."""
    joints: list[JointName] = Field(min_length=1)
    """The joints that it leads."""


@section("controllers", ControllerModel, order=34, names=CONTROLLER, entry="controller")
def controllers(reading: Reading[ControllerModel]) -> dict[str, ControllerModel]:
    """What leads groups of joints, by name. A controller is a skill of missions.

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
        controllers:
          head:
            type: joint_trajectory
            joints: [pan_joint]
    """
    found = reading.entries()
    wrong = {name: finding for name, one in found.items() if (finding := _undriven(reading, name, one))}
    reading.report.extend(wrong.values())
    return {name: one for name, one in found.items() if name not in wrong}


def _undriven(reading: Reading[ControllerModel], name: str, one: ControllerModel) -> Finding | None:
    driven, servos = reading.contents.of(joints), reading.contents.of(actuators)
    if not driven and "joints" in reading.contents.root:
        return None  # they have mistakes, which are told
    buses: Mapping[str, int] = {}
    for index, joint in enumerate(one.joints):
        span = value_span(reading.contents.root, ("controllers", name, "joints", index))
        if joint not in driven:
            message = f"the controller '{name}' leads '{joint}', which no servo drives"
            return NOT_DRIVEN.misspelt(span, message, joint, driven, "joints with a servo")
        if (servo := servos.get(driven[joint].actuator)) is not None:
            buses = {servo.bus: index, **buses}
        if len(buses) > 1:
            return NOT_DRIVEN.at(span, f"the joints of the controller '{name}' are on two buses: {', '.join(buses)}")
    return None
