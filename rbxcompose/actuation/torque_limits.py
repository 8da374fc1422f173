"""The torque limits of servos: written before they drive joints, and again when a servo has forgotten its limit.

They are in memory that does not outlive the supply. A reboot forgets them, too, and a servo of protocol 1.0 that shuts
down sets its limit to 0.
"""

from __future__ import annotations

from collections.abc import Mapping

from rbxcompose.actuation.bus import ServoBus
from rbxcompose.actuation.servo_joint import JointServo

LIMIT, MOST = "torque_limit", "max_torque"


class TorqueLimits:
    """Keeps the limits of the servos of a bus."""

    def __init__(self) -> None:
        self._wanted: dict[int, int] = {}  # raw limits, by id
        self._told: set[int] = set()

    def write(self, bus: ServoBus, servo: JointServo) -> None:
        """Write the limit of a servo, if it answers.

        Raises:
            PortError: if the bus has gone.
        """
        if (reading := bus.read([servo.id], [LIMIT, MOST]).get(servo.id)) is not None:
            wanted = self._wanted[servo.id] = raw_limit(servo, reading.values[MOST])
            if reading.values[LIMIT] != wanted:
                bus.write({servo.id: {LIMIT: wanted}}, is_confirmed=True)

    def keep(self, bus: ServoBus, servo: JointServo, values: Mapping[str, int]) -> str:
        """Write the limit again if values of a servo tell that it has another one; return what to tell, or nothing.

        Raises:
            PortError: if the bus has gone.
        """
        wanted = self._wanted.get(servo.id)
        if wanted is None:
            self.write(bus, servo)
        elif values.get(LIMIT, wanted) == wanted:
            self._told.discard(servo.id)
        else:
            bus.write({servo.id: {LIMIT: wanted}}, is_confirmed=True)
            if servo.id not in self._told:
                self._told.add(servo.id)
                return f"servo {servo.id} had lost its torque limit: it is written again"
        return ""


def raw_limit(servo: JointServo, most: int) -> int:
    """Return the limit that leaves a servo its share of the torque; `most` is what its owner allows it."""
    return most if servo.torque >= 1.0 else min(most, servo.model.to_raw(LIMIT, servo.torque))
