"""What is inside of a servo: a motor that turns a shaft, warms up and draws on the supply.

Positions are in ticks, not rounded, and times in seconds. A profile leads from where the shaft is to the goal, within
the limits of speed and acceleration; the shaft follows it as a position loop does, a little later. Both end exactly at
the goal.
"""

from __future__ import annotations

import math

from rbxcompose.dataclass import dataclass

STEP = 0.01  # [s], the longest step of a profile
_INSTANT = 1e-9  # [s]; nothing moves in less
_CLOSE = 0.01  # [ticks] from the goal, and the shaft is there


@dataclass(frozen=True, slots=True)
class MotorTraits:
    """What a motor can do, and how it warms up."""

    fastest: float = 6.0
    """Its speed without a load [rad/s]."""
    acceleration: float = 100.0
    """Its acceleration at full load [rad/s^2]."""
    lag: float = 0.02
    """Time constant of the position loop [s]."""
    friction: float = 0.2
    """Load at its fastest speed, of the most."""
    ambient: float = 30.0
    """Temperature around it [degC]."""
    warming: float = 60.0
    """How much warmer it becomes at full load, in the end [degC]."""
    inertia: float = 60.0
    """Time constant of its temperature [s]."""
    supply: float = 12.0
    """Voltage of the supply [V]."""
    sag: float = 1.0
    """How much of it is missing at full load [V]."""


class ServoMotor:
    """A motor at `position` that turns at `velocity` [ticks/s].

    `effort` is its load, of the most; `temperature` is in [degC].
    """

    is_ideal = False

    def __init__(self, position: float, per_tick: float, traits: MotorTraits | None = None) -> None:
        self.traits = traits or MotorTraits()
        self.position = self._aim = position  # the profile is at `_aim`, and moves at `_speed`
        self.velocity = self._speed = 0.0
        self.effort = 0.0
        self.temperature = self.traits.ambient
        self._fastest, self._strongest = self.traits.fastest / per_tick, self.traits.acceleration / per_tick

    def put(self, position: float) -> None:
        """Be somewhere else, at rest."""
        self.position = self._aim = position
        self.velocity = self._speed = self.effort = 0.0

    def push(self, effort: float) -> None:
        """Stay, at a load: 0 without torque."""
        self.put(self.position)
        self.effort = effort

    def turn(self, speed: float, acceleration: float, dt: float, circle: int = 0, share: float = 1.0) -> None:
        """Turn at a speed [ticks/s], which it reaches with an acceleration [ticks/s^2], 0 for the largest.

        With a `circle` [ticks], positions begin again behind it. `share` is how much of its torque it may use.
        """
        strength, before = self._strength(acceleration, share), self._speed
        ramp = abs(speed - before) / strength  # [s]
        is_there = ramp <= dt
        after = speed if is_there else before + math.copysign(strength * dt, speed - before)
        during = min(ramp, dt)
        self.position += 0.5 * (before + after) * during + speed * (dt - during)
        if circle:
            self.position %= circle
        self._aim, self._speed, self.velocity = self.position, after, after
        self._strain(0.0 if is_there else math.copysign(strength, speed - before))

    def _strength(self, acceleration: float, share: float) -> float:
        """Return the acceleration that is wanted, as far as a share of its torque allows."""
        most = self._strongest * share
        return min(acceleration or most, most) if share < 1.0 else acceleration or most

    def approach(self, goal: float, fastest: float, acceleration: float, dt: float, share: float = 1.0) -> None:
        """Turn towards a goal, at a speed [ticks/s] and an acceleration [ticks/s^2] at most, 0 for the largest.

        `share` is how much of its torque it may use: with less it accelerates less, and is slower.
        """
        if dt < _INSTANT or (self.position == self._aim == goal and self._speed == 0.0):
            return
        count = max(1, math.ceil(dt / STEP - 1e-9))
        step = dt / count
        strength = self._strength(acceleration, share)
        fastest = min(fastest or self._fastest, self._fastest * share)
        kept = math.exp(-step / self.traits.lag)
        for _ in range(count):
            self._lead(goal, fastest, strength * step, step)
            self._follow(kept, step)
            if self._speed == 0.0 and self._aim == goal and abs(goal - self.position) < _CLOSE:
                self.put(goal)
                return

    def _lead(self, goal: float, fastest: float, change: float, step: float) -> None:
        """Move the profile; its speed may change by `change`. It can always come to rest at the goal."""
        error = abs(goal - self._aim)
        stopping = change * (math.sqrt(0.25 + 2.0 * error / (change * step)) - 0.5)
        wanted = math.copysign(min(fastest, stopping, error / step), goal - self._aim)
        self._speed = max(self._speed - change, min(self._speed + change, wanted))
        self._aim += self._speed * step
        if abs(goal - self._aim) < 1e-6:
            self._aim = goal

    def _follow(self, kept: float, step: float) -> None:
        """Move the shaft after the profile, by what is `kept` of the distance between them."""
        lag = self.traits.lag
        behind = self._aim - self._speed * step - self.position
        behind = self._speed * lag + (behind - self._speed * lag) * kept
        self.position, self.velocity = self._aim - behind, behind / lag
        self._strain((self._speed - self.velocity) / lag)

    def _strain(self, acceleration: float) -> None:
        friction = self.traits.friction * self.velocity / self._fastest
        self.effort = max(-1.0, min(1.0, friction + acceleration / self._strongest))

    def warm(self, load: float, dt: float) -> None:
        """Become warmer or cooler at a load, of the most."""
        traits = self.traits
        end = traits.ambient + traits.warming * load * load
        self.temperature += (end - self.temperature) * -math.expm1(-dt / traits.inertia)


class IdealMotor(ServoMotor):
    """A motor that is at its goal at once, has no load and does not warm up."""

    is_ideal = True

    def push(self, effort: float) -> None:
        """Stay."""
        self.put(self.position)

    def turn(self, speed: float, acceleration: float, dt: float, circle: int = 0, share: float = 1.0) -> None:
        """Turn at a speed [ticks/s] at once."""
        self.position += speed * dt
        if circle:
            self.position %= circle
        self.velocity = speed

    def approach(self, goal: float, fastest: float, acceleration: float, dt: float, share: float = 1.0) -> None:
        """Be there."""
        self.put(goal)

    def warm(self, load: float, dt: float) -> None:
        """Be as cool as what is around it."""
        self.temperature = self.traits.ambient
