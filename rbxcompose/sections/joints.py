"""The section `joints`: which servo turns which joint of the body."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from rbxcompose.config import Angle, AngularAcceleration, AngularSpeed, Config, JointName, Name
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import Reading
from rbxcompose.references import ACTUATOR, Refers


class DrivenLimitsModel(Config):
    """Limits of a joint; those of the body hold, too."""

    position: tuple[Angle, Angle] | None = None
    """Least and greatest position."""
    velocity: AngularSpeed | None = Field(None, gt=0)
    """Largest speed."""
    acceleration: AngularAcceleration | None = Field(None, gt=0)
    """Largest acceleration."""


class JointModel(Config):
    """A joint that is driven."""

    actuator: Annotated[Name, Refers(ACTUATOR)]
    """The servo that turns it."""
    limits: DrivenLimitsModel = DrivenLimitsModel()
    """Limits, tighter than those of the body."""


@section("joints", dict[JointName, JointModel], order=33, shared=((),))
def joints(reading: Reading[dict[str, JointModel]]) -> dict[str, JointModel]:
    """Which joints of the body are driven, by their names in the URDF: the servo of each, and its limits.

    Example:
        body:
          urdf: robot.urdf
        buses:
          servos:
            type: dynamixel
        actuators:
          pan_servo: {bus: servos, model: AX-12, id: 1}
        joints:
          pan_joint:
            actuator: pan_servo
            limits:
              position: [-90 deg, 90 deg]
              velocity: 90 deg/s
    """
    return reading.whole() or {}
