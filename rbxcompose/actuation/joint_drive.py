"""A joint that a servo turns: what is measured, what is asked, and what is to be written, one cycle after the other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from rbxcompose.actuation.bus import ServoReading
from rbxcompose.actuation.servo_models import HARDWARE_ERRORS, ONE_ERRORS, ServoModel
from rbxcompose.control.curves import JointSample
from rbxcompose.control.joint_state_machine import step_joint
from rbxcompose.control.joint_states import (
    WITH_TORQUE,
    BringToRest,
    JointCondition,
    JointInputs,
    JointMode,
    JointPolicy,
    JointRequest,
    MoveTo,
    Pursue,
    Refuse,
    TorqueOff,
    TorqueOn,
    WriteGoal,
)
from rbxcompose.control.limits import Limiter, MotionLimits

Raw = Mapping[str, int]
"""Raw values by item."""


@dataclass(frozen=True, slots=True)
class ServoJoint:
    """A joint of the body, and the servo that turns it: `neutral` is the tick at position 0."""

    name: str
    id: int
    model: ServoModel
    limits: MotionLimits
    neutral: int
    is_inverted: bool = False
    is_continuous: bool = False

    @property
    def per_tick(self) -> float:
        """Return the angle of one tick [rad], negative if the servo turns the other way round."""
        return -self.model.per_tick if self.is_inverted else self.model.per_tick

    def position(self, raw: int) -> float:
        """Return the position of a tick [rad]."""
        return (raw - self.neutral) * self.per_tick

    def raw(self, position: float) -> int:
        """Return the tick nearest to a position [rad], within those of the servo."""
        last = self.model.family.ticks - 1
        ticks = self.neutral + round(position / self.per_tick)
        return ticks if self.is_continuous and self.model.protocol == 2 else max(0, min(last, ticks))


class JointDrive:
    """Carries out what is asked of one joint, within its limits and as its state permits."""

    def __init__(self, joint: ServoJoint, policy: JointPolicy) -> None:
        self.joint, self.policy = joint, policy
        self.condition = JointCondition()
        self.limiter: Limiter | None = None  # from the first measured position on
        self.measured = JointSample(float("nan"))
        self.temperature: float | None = None
        self.voltage: float | None = None
        self.refused = ""
        """Why the last command was refused; empty after one that was not."""
        self._measured_at = float("-inf")
        self._error = ""
        self._requests: list[JointRequest] = []
        self._passing = 0.0  # [rad/s], the velocity of a path at its wanted position

    @property
    def commanded(self) -> JointSample:
        """Return the last command, or what is measured if there is none."""
        limiter = self.limiter
        return self.measured if limiter is None else JointSample(limiter.position, limiter.velocity)

    @property
    def mode(self) -> JointMode:
        """Return its state as people see it."""
        return self.condition.mode

    @property
    def is_at_rest(self) -> bool:
        """Return whether its command does not move."""
        return self.limiter is None or self.limiter.is_at_rest

    def take(self, reading: ServoReading) -> None:
        """Take over what the servo told."""
        joint, values = self.joint, reading.values
        if (raw := values.get("present_position")) is not None:
            speed = values.get("present_speed", 0)
            turned = joint.model.to_si("present_speed", speed) * (-1.0 if joint.is_inverted else 1.0)
            self.measured = JointSample(joint.position(raw), turned)
            self._measured_at = reading.stamp
        if (raw := values.get("present_temperature")) is not None:
            self.temperature = joint.model.to_si("present_temperature", raw)
        if (raw := values.get("present_voltage")) is not None:
            self.voltage = joint.model.to_si("present_voltage", raw)
        if joint.model.protocol == 1 or "hardware_error" in values:  # in 2.0, not each reading tells of errors
            self._error = ", ".join(self._errors(reading))

    def _errors(self, reading: ServoReading) -> Iterator[str]:
        bits = reading.alert & ONE_ERRORS if self.joint.model.protocol == 1 else reading.values.get("hardware_error", 0)
        yield from (words for bit, words in HARDWARE_ERRORS.items() if bits & bit)

    def ask(self, request: JointRequest) -> None:
        """Take a request for the next cycle."""
        self._requests.append(request)

    def follow(self, sample: JointSample) -> None:
        """Be at a position at the end of the next cycle, and pass there with its velocity."""
        self._passing = sample.velocity
        self.ask(MoveTo(sample.position))

    def step(self, now: float, dt: float) -> list[Raw]:
        """Return what is to be written in the cycle that ends `dt` [s] from `now`, one after the other."""
        at = self.measured.position
        inputs = JointInputs(at, self._measured_at, self.temperature, self._error, tuple(self._requests))
        self._requests.clear()
        self.condition, actions = step_joint(self.condition, inputs, now, self.policy)
        writes: list[Raw] = []
        for action in actions:
            match action:
                case WriteGoal(position=position):
                    self.limiter = Limiter(self.joint.limits, position)
                    writes.append({"goal_position": self.joint.raw(position)})
                case TorqueOn():
                    writes.append({"torque_enable": 1})
                case TorqueOff():
                    writes.append({"torque_enable": 0})
                case Pursue(position=position) if self.limiter is not None:
                    self.refused = self.limiter.want(position, self._passing) or ""
                case BringToRest() if self.limiter is not None:
                    self.limiter.brake()
                case Refuse(request=MoveTo(), reason=reason):
                    self.refused = reason
        self._passing = 0.0
        return [*writes, *self._moved(dt)]

    def _moved(self, dt: float) -> Iterator[Raw]:
        """Yield the next goal, if the joint has torque and its command changes."""
        if self.limiter is None or self.condition.is_blocked or self.condition.base not in WITH_TORQUE:
            return
        before = self.joint.raw(self.limiter.position)
        goal = self.joint.raw(self.limiter.step(dt).position)
        if goal != before:
            yield {"goal_position": goal}
