"""How fast servos turn as wheels: those of protocol 2.0 refuse a velocity above their limit, and tell nobody."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.actuation.bus import ServoBus
from rbxcompose.actuation.joint_drive import JointDrive

LIMIT = "velocity_limit"


def keep_speeds(bus: ServoBus, drive: JointDrive) -> Iterator[str]:
    """Limit a joint that is given velocities to those that its servos take; yield sentences on what is slower now.

    Raises:
        PortError: if the bus has gone.
    """
    joint = drive.joint
    for servo in joint.servos if joint.mode == "velocity" else ():
        reading = bus.read([servo.id], [LIMIT]).get(servo.id) if LIMIT in servo.model.items else None
        if reading is None:
            continue
        most = servo.model.to_si(LIMIT, reading.values[LIMIT])
        if drive.slow_down(most * abs(joint.transmission.slope(0.0))):
            yield f"servo {servo.id} of joint '{joint.name}' turns at most {most:.3g} rad/s"
