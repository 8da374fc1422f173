"""What is inside of a servo: a motor that turns a shaft. Positions are in ticks, not rounded, and times in seconds."""

from __future__ import annotations

AMBIENT = 30.0  # [degC]


class ServoMotor:
    """A motor at `position` that turns at `velocity` [ticks/s] and has `temperature` [degC]."""

    is_ideal = False

    def __init__(self, position: float) -> None:
        self.position = position
        self.velocity = 0.0
        self.temperature = AMBIENT

    def put(self, position: float) -> None:
        """Be somewhere else, at rest."""
        self.position, self.velocity = position, 0.0

    def rest(self, dt: float) -> None:
        """Have no torque."""
        self.velocity = 0.0

    def turn(self, speed: float, dt: float) -> None:
        """Turn at a speed [ticks/s], for ever."""
        self.velocity = speed
        self.position += speed * dt

    def approach(self, goal: float, fastest: float, dt: float) -> None:
        """Turn towards a goal, at a speed [ticks/s] at most."""
        before, most = self.position, fastest * dt
        self.position += max(-most, min(most, goal - self.position))
        self.velocity = (self.position - before) / dt if dt > 0 else 0.0


class IdealMotor(ServoMotor):
    """A motor that is at its goal at once, and does not warm up."""

    is_ideal = True

    def approach(self, goal: float, fastest: float, dt: float) -> None:
        """Be there."""
        self.put(goal)
