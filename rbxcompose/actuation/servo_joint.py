"""A joint of the body and the servos that drive it: ticks and positions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal

from rbxcompose.actuation.servo_models import ServoModel
from rbxcompose.control.limits import MotionLimits
from rbxcompose.control.transmission import Gear, Transmission
from rbxcompose.dataclass import dataclass

ONE_TO_ONE = Gear()


@dataclass(frozen=True, slots=True)
class JointServo:
    """A servo of a joint: `neutral` is the tick at angle 0; angles are counted as the joint turns [rad]."""

    id: int
    model: ServoModel
    neutral: int
    is_inverted: bool = False
    torque: float = 1.0
    """Share of the most torque that it may use."""

    @property
    def per_tick(self) -> float:
        """Return the angle of one tick [rad], negative if the servo turns the other way round."""
        return -self.model.per_tick if self.is_inverted else self.model.per_tick

    @property
    def ends(self) -> tuple[int, int]:
        """Return the first and the last tick of its range."""
        family = self.model.family
        first = family.centre - family.ticks // 2
        return first, first + family.ticks - 1

    def angle(self, raw: int) -> float:
        """Return the angle of a tick [rad]."""
        return (raw - self.neutral) * self.per_tick

    def raw(self, angle: float, *, is_endless: bool = False) -> int:
        """Return the tick nearest to an angle [rad], within those of the servo unless it turns without end."""
        first, last = self.ends
        ticks = self.neutral + round(angle / self.per_tick)
        return ticks if is_endless and self.model.family.is_endless else max(first, min(last, ticks))


@dataclass(frozen=True, slots=True)
class ServoJoint:
    """A joint and its servos, which all turn with it. Positions are [rad], or [m] if it slides."""

    name: str
    servos: tuple[JointServo, ...]
    limits: MotionLimits
    transmission: Transmission = ONE_TO_ONE
    is_continuous: bool = False
    mode: Literal["position", "velocity"] = "position"
    """Whether its servos are given positions, or velocities."""

    @property
    def ids(self) -> tuple[int, ...]:
        """Return the ids of its servos."""
        return tuple(one.id for one in self.servos)

    def servo(self, id: int) -> JointServo:
        """Return its servo with this id."""
        return next(one for one in self.servos if one.id == id)

    @property
    def per_tick(self) -> float:
        """Return how far it moves for one tick of its first servo, in the middle of its range."""
        return abs(self.servos[0].model.per_tick * self.transmission.slope(0.0))

    @property
    def reach(self) -> tuple[float, float]:
        """Return the least and the greatest position that all of its servos reach; infinite if it turns without end."""
        least, greatest = -math.inf, math.inf
        for one in self.servos:
            if not (self.is_continuous and one.model.family.is_endless):
                ends = sorted(self.transmission.position(one.angle(tick)) for tick in one.ends)
                least, greatest = max(least, ends[0]), min(greatest, ends[1])
        return least, greatest

    @property
    def least_velocity(self) -> float:
        """Return the least velocity of its first servo, in the middle of its range [rad/s or m/s]."""
        servo = self.servos[0].model
        return abs(servo.item("goal_velocity").per_raw * self.transmission.slope(0.0))

    def positions(self, raws: Mapping[int, int]) -> dict[int, float]:
        """Return the positions that the ticks of servos stand for, by id."""
        return {one.id: self.transmission.position(one.angle(raws[one.id])) for one in self.servos if one.id in raws}

    def raws(self, position: float) -> dict[int, int]:
        """Return the ticks of its servos at a position, by id."""
        angle = self.transmission.angle(position)
        return {one.id: one.raw(angle, is_endless=self.is_continuous) for one in self.servos}

    def wheel_raws(self, velocity: float, position: float) -> dict[int, int]:
        """Return the raw velocities of its servos, by id, for that of the joint at a position [rad/s or m/s]."""
        speed = velocity / self.transmission.slope(self.transmission.angle(position))
        return {one.id: _turning(one, speed) for one in self.servos}


def _turning(servo: JointServo, speed: float) -> int:
    item = servo.model.item("goal_velocity")
    return max(item.least, min(item.most, item.to_raw(-speed if servo.is_inverted else speed)))
