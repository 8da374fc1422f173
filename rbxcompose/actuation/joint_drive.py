"""A joint that servos drive: what is measured, what is asked, and what is to be written, one cycle after the other."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import replace

from rbxcompose.actuation.bus import ServoReading
from rbxcompose.actuation.servo_joint import JointServo, ServoJoint
from rbxcompose.actuation.servo_models import HARDWARE_ERRORS, ONE_ERRORS
from rbxcompose.control.curves import JointSample
from rbxcompose.control.joint_state_machine import step_joint
from rbxcompose.control.joint_states import (
    WITH_TORQUE,
    BringToRest,
    Enable,
    Hold,
    JointCondition,
    JointInputs,
    JointMode,
    JointPolicy,
    JointRequest,
    Pursue,
    Refuse,
    Relax,
    TorqueOff,
    TorqueOn,
    WriteGoal,
)
from rbxcompose.control.limits import Limiter
from rbxcompose.control.trajectory_plan import JointRules

Raw = Mapping[str, int]
"""Raw values by item."""
Writes = Mapping[int, Raw]
"""Raw values by id of the servo."""


class JointDrive(ABC):
    """Carries out what is asked of one joint, within its limits and as its state permits."""

    def __init__(self, joint: ServoJoint, policy: JointPolicy) -> None:
        self.joint, self.policy = joint, policy
        self.rules = JointRules(joint.limits, joint.is_continuous)
        self.condition = JointCondition()
        self.limiter: Limiter | None = None  # from the first torque on
        self.measured = JointSample(math.nan)
        self.effort = math.nan
        """Load of its first servo, as a fraction of the most or as a current [A]."""
        self.temperature: float | None = None
        """Of its warmest servo [degC]."""
        self.warmest: float | None = None
        """The temperature that it goes by: its own, or that of the warmest joint of its bus [degC]."""
        self.voltage: float | None = None
        self.refused = ""
        """Why the last command was refused; empty after one that was not."""
        self.clamped = ""
        """How the last single command was changed; empty if it was not."""
        self.hindrance = ""
        """Why it takes no commands for a while; empty if it does."""
        self._positions: dict[int, float] = {}  # of each servo, as the joint counts
        self._ticks: dict[int, int] = {}  # of wheels, without their jumps after each turn
        self._stamps: dict[int, float] = {}
        self._warmth: dict[int, float] = {}
        self._errors: dict[int, str] = {}
        self._requests: list[JointRequest] = []

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
    def blocked(self) -> str:
        """Return why it may not move; empty if it may."""
        return self.condition.note or str(self.mode) if self.condition.is_blocked else ""

    @property
    def per_tick(self) -> float:
        """Return how far it moves for one tick of its servo."""
        return self.joint.per_tick

    @property
    def has_torque(self) -> bool:
        """Return whether its servos hold or move it, and nobody has asked to relax it."""
        is_let_go = any(isinstance(one, Relax) for one in self._requests)
        return not self.condition.is_blocked and self.condition.base in WITH_TORQUE and not is_let_go

    @property
    def measured_at(self) -> float:
        """Return when all of its servos had been measured [s], -inf if they never were."""
        return min(self._stamps.values()) if len(self._stamps) == len(self.joint.servos) else -math.inf

    @property
    def is_at_rest(self) -> bool:
        """Return whether its command does not move."""
        return self.limiter is None or self.limiter.is_at_rest

    def take(self, id: int, reading: ServoReading) -> None:
        """Take over what one of its servos told."""
        servo = self.joint.servo(id)
        model, values = servo.model, reading.values
        if (raw := values.get("present_position")) is not None:
            self._measure(servo, raw, values.get("present_speed", 0), reading.stamp)
        if (raw := values.get("present_load")) is not None and servo is self.joint.servos[0]:
            self.effort = model.to_si("present_load", raw) * (-1.0 if servo.is_inverted else 1.0)
        if (raw := values.get("present_temperature")) is not None:
            self._warmth[id] = model.to_si("present_temperature", raw)
            self.temperature = self.warmest = max(self._warmth.values())
        if (raw := values.get("present_voltage")) is not None:
            self.voltage = model.to_si("present_voltage", raw)
        if model.protocol == 1 or "hardware_error" in values:  # in 2.0, not each reading tells of errors
            self._errors[id] = ", ".join(_faults(servo, reading))

    def _measure(self, servo: JointServo, raw: int, speed: int, stamp: float) -> None:
        if self.joint.mode == "velocity":
            raw = self._ticks[servo.id] = self._unrolled(servo, raw)
        self._stamps[servo.id] = stamp
        self._positions |= self.joint.positions({servo.id: raw})
        if len(self._positions) < len(self.joint.servos):
            return
        position = sum(self._positions.values()) / len(self._positions)
        turned = servo.model.to_si("present_speed", speed) * (-1.0 if servo.is_inverted else 1.0)
        slope = self.joint.transmission.slope(servo.angle(raw))
        self.measured = JointSample(position, turned * slope)

    def _unrolled(self, servo: JointServo, raw: int) -> int:
        """Return the tick of a wheel; in protocol 1.0 those of a servo start again at 0 after each turn."""
        last, count = self._ticks.get(servo.id, raw), servo.model.family.ticks
        if servo.model.protocol == 2:
            return raw
        return last + (raw - last + count // 2) % count - count // 2

    def slow_down(self, fastest: float) -> bool:
        """Move with this speed at most [rad/s or m/s]; return whether that is slower than before."""
        if fastest >= self.joint.limits.speed:
            return False
        limits = replace(self.joint.limits, velocity=fastest)
        self.joint, self.rules = replace(self.joint, limits=limits), replace(self.rules, limits=limits)
        if self.limiter is not None:
            self.limiter.limits = limits
        return True

    def was_cut(self) -> None:
        """Go on from where the joint is: a servo has stopped by itself, since the bus was silent for too long."""
        if self.limiter is not None and math.isfinite(self.measured.position):
            self.limiter.put(self.measured.position)

    @property
    def error(self) -> str:
        """Return what its servos report, such as `overload`; empty if nothing."""
        return ", ".join(words for words in self._errors.values() if words)

    def ask(self, request: JointRequest) -> None:
        """Take a request for the next cycle."""
        if self.hindrance and not isinstance(request, Relax | Enable):
            self.refused = self.hindrance
        else:
            self._requests.append(request)

    def relax(self) -> None:
        """Switch torque off in the next cycle, until the next command."""
        self.ask(Relax())

    def hold(self) -> None:
        """Come to rest within its limits in the next cycles, and stay there with torque."""
        self.ask(Hold())

    def follow(self, sample: JointSample) -> None:
        """Be at a position at the end of the next cycle, and pass there with its velocity."""
        raise TypeError(f"joint '{self.joint.name}' takes velocities")

    def turn(self, velocity: float) -> None:
        """Move with a velocity [rad/s or m/s] up to the end of the next cycle, then brake unless it is repeated."""
        raise TypeError(f"joint '{self.joint.name}' takes positions")

    def step(self, now: float, dt: float) -> list[Writes]:
        """Return what is to be written in the cycle that ends `dt` [s] from `now`, one after the other."""
        found = tuple(self._requests)
        inputs = JointInputs(self.measured.position, self.measured_at, self.warmest, self.error, found)
        self._requests.clear()
        was_blocked = self.condition.is_blocked
        self.condition, actions = step_joint(self.condition, inputs, now, self.policy)
        if was_blocked and not self.condition.is_blocked:
            self.refused = ""  # the reason is over
        writes: list[Writes] = []
        for action in actions:
            match action:
                case WriteGoal(position=position):
                    self.limiter = Limiter(self.joint.limits, position)
                    writes.append(self._goal(position))
                case TorqueOn():
                    writes.append(self._same({"torque_enable": 1}))
                case TorqueOff():
                    writes.append(self._same({"torque_enable": 0}))
                case Pursue(request=request) if self.limiter is not None:
                    self.refused = self._pursue(request, self.limiter, dt)
                case BringToRest() if self.limiter is not None:
                    self.limiter.brake()
                case Refuse(request=request, reason=reason) if not isinstance(request, Relax):
                    self.refused = reason
        return [*writes, *self._moved(dt)] if self.has_torque else writes

    def _same(self, raw: Raw) -> Writes:
        return dict.fromkeys(self.joint.ids, raw)

    @abstractmethod
    def _goal(self, position: float) -> Writes:
        """Return what keeps it where it is when torque is switched on."""

    @abstractmethod
    def _pursue(self, request: JointRequest, limiter: Limiter, dt: float) -> str:
        """Pass what is wanted on to the limiter; return why not, or nothing."""

    @abstractmethod
    def _moved(self, dt: float) -> Iterator[Writes]:
        """Yield the next goal, if its command changes; the joint has torque."""


def _faults(servo: JointServo, reading: ServoReading) -> Iterator[str]:
    bits = reading.alert & ONE_ERRORS if servo.model.protocol == 1 else reading.values.get("hardware_error", 0)
    yield from (words for bit, words in HARDWARE_ERRORS.items() if bits & bit)
