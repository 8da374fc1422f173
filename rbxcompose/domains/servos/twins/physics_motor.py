"""Simulated servos whose shafts a physics engine moves: set points for it, and what it measures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.servos.joint_drive import JointServo, ServoJoint
from rbxcompose.domains.servos.twins.servo_fake import FakeServo, MotorTraits, ServoMotor
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header

WINDUP = 0.5  # [rad] that the profile of one that turns gets ahead of a shaft that is held, at most


class PhysicsMotor(ServoMotor):
    """A motor whose profile leads to its goal, and whose shaft is where an engine moves it."""

    share = 0.0
    """How much of its torque it may use; 0 while it is relaxed."""

    def __init__(self, position: float, per_tick: float, traits: MotorTraits | None = None) -> None:
        super().__init__(position, per_tick, traits)
        self._ahead = WINDUP / per_tick

    @property
    def aim(self) -> float:
        """Return where its profile is [ticks]."""
        return self._aim

    @property
    def speed(self) -> float:
        """Return how fast its profile moves [ticks/s]."""
        return self._speed

    def feel(self, position: float, velocity: float, effort: float) -> None:
        """Take over what was measured [ticks, ticks/s, part of the most]."""
        self.position, self.velocity, self.effort = position, velocity, max(-1.0, min(1.0, effort))

    def put(self, position: float) -> None:
        """Aim there, at rest: only the engine moves the shaft."""
        self._aim, self._speed = position, 0.0

    def relax(self) -> None:
        """Let go."""
        self.put(self.position)
        self.share = 0.0

    def push(self, effort: float) -> None:
        """Aim where it does, at rest, with what torque it has."""
        self._speed = 0.0

    def turn(self, speed: float, acceleration: float, dt: float, circle: int = 0, share: float = 1.0) -> None:
        """Let the profile turn at a speed [ticks/s], without end."""
        measured = self.position, self.velocity, self.effort
        ahead = max(-self._ahead, min(self._ahead, self._aim - self.position))
        self.position, self.share = self.position + ahead, share
        super().turn(speed, acceleration, dt, 0, share)
        self.feel(*measured)

    def approach(self, goal: float, fastest: float, acceleration: float, dt: float, share: float = 1.0) -> None:
        """Lead the profile towards a goal."""
        self.share = share
        super().approach(goal, fastest, acceleration, dt, share)

    def _follow(self, kept: float, step: float) -> None:
        """Leave the shaft to the engine."""


@dataclass(frozen=True, slots=True)
class _Shaft:
    """A servo of a joint, and its motor."""

    servo: JointServo
    motor: PhysicsMotor

    @property
    def angle(self) -> float:
        """Return the angle at which it aims [rad]."""
        return (self.motor.aim - self.servo.neutral) * self.servo.per_tick

    @property
    def speed(self) -> float:
        """Return at which it turns there [rad/s]."""
        return self.motor.speed * self.servo.per_tick


class PhysicsJoints:
    """The link of joints and their simulated servos to an engine; `is_felt` tells whether it has reported all."""

    def __init__(self, joints: Sequence[ServoJoint], servos: Mapping[str, Sequence[FakeServo]]) -> None:
        self._joints = {joint.name: joint for joint in joints}
        self._unfelt = set(self._joints)
        self._shafts = {
            name: [
                _Shaft(servo, fake.motor)
                for servo, fake in zip(joint.servos, servos[name], strict=True)
                if isinstance(fake.motor, PhysicsMotor)
            ]
            for name, joint in self._joints.items()
        }

    @property
    def is_felt(self) -> bool:
        """Return whether the engine has reported where all joints are."""
        return not self._unfelt

    def set_points(self, stamp: int) -> JointState:
        """Return where each joint is to be [rad or m] at a time [ns]; `effort` is the part of its most."""
        found = [self._set_point(joint) for joint in self._joints.values()]
        positions, velocities, shares = np.array(found).reshape(-1, 3).T
        return JointState(Header(stamp=to_time(stamp)), tuple(self._joints), positions, velocities, shares)

    def _set_point(self, joint: ServoJoint) -> tuple[float, float, float]:
        shafts, gear = self._shafts[joint.name], joint.transmission
        pulling = [shaft for shaft in shafts if shaft.motor.share] or shafts
        position = sum(gear.position(shaft.angle) for shaft in pulling) / len(pulling)
        velocity = sum(gear.slope(shaft.angle) * shaft.speed for shaft in pulling) / len(pulling)
        return position, velocity, sum(shaft.motor.share for shaft in shafts) / len(shafts)

    def feel(self, message: JointState) -> None:
        """Take over where the joints are, how they move, and which part of the most effort they feel."""
        rows = zip(message.name, message.position, message.velocity, message.effort, strict=True)
        for name, position, velocity, effort in rows:
            if (joint := self._joints.get(name)) is None:
                continue
            angle = joint.transmission.angle(float(position))
            slope = joint.transmission.slope(angle)
            for servo, motor in ((shaft.servo, shaft.motor) for shaft in self._shafts[name]):
                per_tick = servo.per_tick
                load = effort if slope * per_tick > 0 else -effort
                motor.feel(servo.neutral + angle / per_tick, velocity / (slope * per_tick), load)
            self._unfelt.discard(name)
