"""A joint and the servos that drive it: what is measured, what is asked, and what is to be written, once a cycle."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Literal

from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.servos import joint_states
from rbxcompose.domains.servos.bus import ServoReading
from rbxcompose.domains.servos.curves import JointSample
from rbxcompose.domains.servos.limits import Limiter, MotionLimits
from rbxcompose.domains.servos.models import ONE_ERRORS, ServoModel, hardware_errors
from rbxcompose.domains.servos.trajectory import JointRules
from rbxcompose.domains.servos.transmission import Gear, Transmission

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
        return tuple(servo.id for servo in self.servos)

    def servo(self, id: int) -> JointServo:
        """Return its servo with this id."""
        return next(servo for servo in self.servos if servo.id == id)

    @property
    def per_tick(self) -> float:
        """Return how far it moves for one tick of its first servo, in the middle of its range."""
        return abs(self.servos[0].model.per_tick * self.transmission.slope(0.0))

    @property
    def reach(self) -> tuple[float, float]:
        """Return the least and the greatest position that all of its servos reach; infinite if it turns without end."""
        least, greatest = -math.inf, math.inf
        for servo in self.servos:
            if not (self.is_continuous and servo.model.family.is_endless):
                ends = sorted(self.transmission.position(servo.angle(tick)) for tick in servo.ends)
                least, greatest = max(least, ends[0]), min(greatest, ends[1])
        return least, greatest

    @property
    def least_velocity(self) -> float:
        """Return the least velocity of its first servo, in the middle of its range [rad/s or m/s]."""
        servo = self.servos[0].model
        return abs(servo.item("goal_velocity").per_raw * self.transmission.slope(0.0))

    def positions(self, raws: Mapping[int, int]) -> dict[int, float]:
        """Return the positions that the ticks of servos stand for, by id."""
        return {
            servo.id: self.transmission.position(servo.angle(raws[servo.id]))
            for servo in self.servos
            if servo.id in raws
        }

    def raws(self, position: float) -> dict[int, int]:
        """Return the ticks of its servos at a position, by id."""
        angle = self.transmission.angle(position)
        return {servo.id: servo.raw(angle, is_endless=self.is_continuous) for servo in self.servos}

    def wheel_raws(self, velocity: float, position: float) -> dict[int, int]:
        """Return the raw velocities of its servos, by id, for that of the joint at a position [rad/s or m/s]."""
        speed = velocity / self.transmission.slope(self.transmission.angle(position))
        return {servo.id: _turning(servo, speed) for servo in self.servos}


def _turning(servo: JointServo, speed: float) -> int:
    item = servo.model.item("goal_velocity")
    return max(item.least, min(item.most, item.to_raw(-speed if servo.is_inverted else speed)))


Raw = Mapping[str, int]
"""Raw values by item."""
Writes = Mapping[int, Raw]
"""Raw values by id of the servo."""


FAR = 0.2  # [rad] of a servo between where it is and where it should be, which is no lag and no sag of a joint at rest
STRAYED = 0.5  # [s] that it stands there


class JointDrive(ABC):
    """Carries out what is asked of one joint, within its limits and as its state permits."""

    def __init__(self, joint: ServoJoint, policy: joint_states.JointPolicy) -> None:
        self.joint, self.policy = joint, policy
        self.rules = JointRules(joint.limits, joint.is_continuous and joint.limits.are_endless)
        self.condition = joint_states.JointCondition()
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
        self.stranger = ""
        """Which of its servos is not what it was said to be; empty if none."""
        self.astray = ""
        """Where it stands instead of where it was commanded; empty if it is there."""
        self.missing = ""
        """Which servos have never been heard, when they should have; empty if all have."""
        self.is_back = False
        """Whether all of its servos are heard again, or at last, since this cycle."""
        self._far = abs(FAR * joint.transmission.slope(0.0))
        self._is_away, self._begun, self._stands, self._told = False, math.inf, math.inf, math.nan
        self._positions: dict[int, float] = {}  # of each servo, as the joint counts
        self._ticks: dict[int, int] = {}  # of wheels, without their jumps after each turn
        self._stamps: dict[int, float] = {}
        self._warmth: dict[int, float] = {}
        self._errors: dict[int, str] = {}
        self._raws: dict[int, int] = {}  # of servos that turn without end
        self._jump = ""
        self._is_limp = False
        self._requests: list[joint_states.JointRequest] = []

    @property
    def commanded(self) -> JointSample:
        """Return the last command, or what is measured if there is none."""
        limiter = self.limiter
        return self.measured if limiter is None else JointSample(limiter.position, limiter.velocity)

    @property
    def mode(self) -> joint_states.JointMode:
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
        is_let_go = any(isinstance(request, joint_states.Relax) for request in self._requests)
        return not self.condition.is_blocked and self.condition.base in joint_states.WITH_TORQUE and not is_let_go

    @property
    def measured_at(self) -> float:
        """Return when all of its servos had been measured [s], -inf if they never were."""
        return min(self._stamps.values()) if len(self._stamps) == len(self.joint.servos) else -math.inf

    @property
    def is_at_rest(self) -> bool:
        """Return whether its command does not move."""
        return self.limiter is None or self.limiter.is_at_rest

    def take(self, id: int, reading: ServoReading) -> None:
        """Take over what one of its servos reported."""
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
        if model.protocol == 1 or "hardware_error" in values:  # in 2.0, not each reading has errors
            bits = reading.alert & ONE_ERRORS if model.protocol == 1 else values["hardware_error"]
            self._errors[id] = ", ".join(hardware_errors(bits))

    def _measure(self, servo: JointServo, raw: int, speed: int, stamp: float) -> None:
        if self.joint.mode == "velocity":
            raw = self._ticks[servo.id] = self._unrolled(servo, raw)
        elif self.joint.is_continuous and servo.model.family.is_endless:
            if abs(raw - self._raws.get(servo.id, raw)) > servo.model.family.ticks // 2:  # no cycle is that long
                self._jump = "another position, since it counts turns anew without supply"
            self._raws[servo.id] = raw
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
        self._keep_to(replace(self.joint.limits, velocity=fastest))
        return True

    def narrow(self, lower: float, upper: float) -> bool:
        """Move within this range [rad or m], if it can at all; return whether that is narrower than before."""
        limits = self.joint.limits
        least, greatest = limits.clamped(lower), limits.clamped(upper)
        if least - limits.clamped(-math.inf) <= self.per_tick and limits.clamped(math.inf) - greatest <= self.per_tick:
            return False
        if lower <= greatest and least <= upper:
            self._keep_to(replace(limits, lower=least, upper=greatest))
        return True

    def _keep_to(self, limits: MotionLimits) -> None:
        self.joint, self.rules = replace(self.joint, limits=limits), replace(self.rules, limits=limits)
        if self.limiter is not None:
            self.limiter.limits = limits

    def was_cut(self) -> None:
        """Go on from where the joint is: a servo has stopped by itself, since the bus was silent for too long."""
        if self.limiter is not None and math.isfinite(self.measured.position):
            self.limiter.put(self.measured.position)

    def lost_torque(self) -> None:
        """Give up in the next cycle: a servo has no torque any more."""
        self._is_limp = True

    @property
    def error(self) -> str:
        """Return what its servos report, such as `overload`; empty if nothing."""
        return ", ".join(words for words in self._errors.values() if words)

    def ask(self, request: joint_states.JointRequest) -> None:
        """Take a request for the next cycle."""
        if self.hindrance and not isinstance(request, joint_states.Relax | joint_states.Enable):
            self.refused = self.hindrance
        else:
            self._requests.append(request)

    def objection(self, now: float, *requests: joint_states.JointRequest) -> str:
        """Return why these requests, one after the other, would be refused at `now` [s]; empty if they would not."""
        _, actions = joint_states.step_joint(self.condition, self._inputs(requests), now, self.policy)
        reasons = (action.reason for action in actions if isinstance(action, joint_states.Refuse))
        return self.hindrance or next(reasons, "")

    def _inputs(self, requests: Iterable[joint_states.JointRequest]) -> joint_states.JointInputs:
        position, at, error = self.measured.position, self.measured_at, self.error or self._jump
        return joint_states.JointInputs(position, at, self.warmest, error, tuple(requests), self._is_limp)

    def relax(self) -> None:
        """Switch torque off in the next cycle, until the next command."""
        self.ask(joint_states.Relax())

    def hold(self) -> None:
        """Come to rest within its limits in the next cycles, and stay there with torque."""
        self.ask(joint_states.Hold())

    def follow(self, sample: JointSample) -> None:
        """Be at a position at the end of the next cycle, and pass there with its velocity."""
        raise TypeError(f"joint '{self.joint.name}' takes velocities")

    def turn(self, velocity: float) -> None:
        """Move with a velocity [rad/s or m/s] up to the end of the next cycle, then brake unless it is repeated."""
        raise TypeError(f"joint '{self.joint.name}' takes positions")

    def step(self, now: float, dt: float) -> list[Writes]:
        """Return what is to be written in the cycle that ends `dt` [s] from `now`, one after the other."""
        inputs = self._inputs(self._requests)
        self._requests.clear()
        self._is_limp, self._jump = False, ""
        was_blocked = self.condition.is_blocked
        self.condition, actions = joint_states.step_joint(self.condition, inputs, now, self.policy)
        if was_blocked and not self.condition.is_blocked:
            self.refused = ""  # the reason is over
        writes: list[Writes] = []
        for action in actions:
            match action:
                case joint_states.WriteGoal(position=position):
                    self.limiter, self._told = Limiter(self.joint.limits, position), position
                    writes.append(self._goal(position))
                case joint_states.TorqueOn():
                    writes.append(self._same({"torque_enable": 1}))
                case joint_states.TorqueOff():
                    writes.append(self._same({"torque_enable": 0}))
                case joint_states.Pursue(request=request) if self.limiter is not None:
                    self.refused = self._pursue(request, self.limiter, dt)
                case joint_states.BringToRest() if self.limiter is not None:
                    self.limiter.brake()
                case joint_states.Refuse(request=request, reason=reason) if not isinstance(request, joint_states.Relax):
                    self.refused = reason
        self._watch(now)
        return [*writes, *self._moved(dt)] if self.has_torque else writes

    def _watch(self, now: float) -> None:
        """Note whether its servos are heard, and whether it is where it should be."""
        never = self.condition.measured_at == -math.inf
        is_away = never or self.condition.is_lost
        self.is_back, self._is_away = self._is_away and not is_away, is_away
        if never:
            self._begun = min(self._begun, now)
            silent = [str(id_) for id_ in self.joint.ids if id_ not in self._stamps]
            is_late = now - self._begun > self.policy.fault_after
            self.missing = f"no servo answers at id {' and '.join(silent)}" if is_late else ""
        elif self.missing:
            self.missing = ""
        if self.joint.mode == "position":
            self._note_stray(now)

    def _note_stray(self, now: float) -> None:
        """Go on from where it is, at the next command, if it stands far from where it was told to be.

        It has fallen, or something holds it. Its servo would get there at once, as fast as it can.
        """
        limiter, position = self.limiter, self.measured.position
        if limiter is None or not self.is_far_from(self._told) or not limiter.is_settled or not self.has_torque:
            self._stands, self.astray = math.inf, ""
        elif abs(self.measured.velocity) > self._far:  # in a second: it moves
            self._stands = math.inf
        elif now - (since := min(self._stands, now)) < STRAYED:
            self._stands = since
        else:
            self.astray = f"it is at {position:.3g}, and was told to be at {self._told:.3g}"
            if self.joint.limits.clamped(position) == position:
                limiter.reseed(position)

    def is_far_from(self, position: float) -> bool:
        """Return whether it is somewhere else, and not only a little behind or below."""
        return abs(self.measured.position - position) > self._far

    @property
    def discord(self) -> str:
        """Return how far its servos are apart, as if one were not fixed to it; empty if they are not."""
        apart = max(self._positions.values()) - min(self._positions.values()) if len(self._positions) > 1 else 0.0
        return f"its servos are {apart:.3g} apart" if apart > self._far and self.joint.mode == "position" else ""

    def _same(self, raw: Raw) -> Writes:
        return dict.fromkeys(self.joint.ids, raw)

    @abstractmethod
    def _goal(self, position: float) -> Writes:
        """Return what keeps it where it is when torque is switched on."""

    @abstractmethod
    def _pursue(self, request: joint_states.JointRequest, limiter: Limiter, dt: float) -> str:
        """Pass what is wanted on to the limiter; return why not, or nothing."""

    @abstractmethod
    def _moved(self, dt: float) -> Iterator[Writes]:
        """Yield the next goal, if its command changes; the joint has torque."""


class PositionDrive(JointDrive):
    """Leads a joint to positions, along paths or by itself; `speed` is how fast it goes by itself [rad/s or m/s]."""

    def __init__(self, joint: ServoJoint, policy: joint_states.JointPolicy, speed: float | None = None) -> None:
        super().__init__(joint, policy)
        self.speed = speed

    def follow(self, sample: JointSample) -> None:
        """Be at a position at the end of the next cycle, and pass there with its velocity."""
        self.ask(joint_states.MoveTo(sample.position, sample.velocity))

    def _goal(self, position: float) -> Writes:
        return {id_: {"goal_position": raw} for id_, raw in self.joint.raws(position).items()}

    def _pursue(self, request: joint_states.JointRequest, limiter: Limiter, dt: float) -> str:
        if not isinstance(request, joint_states.MoveTo):
            return f"joint '{self.joint.name}' takes positions"
        limits = self.joint.limits
        if request.velocity is None and self.speed is not None:
            limits = replace(limits, velocity=min(self.speed, limits.speed))
        limiter.limits = limits
        self._note_clamped(request)
        return limiter.want(request.position, request.velocity or 0.0) or ""

    def _note_clamped(self, request: joint_states.MoveTo) -> None:
        """Note that a single command is beyond the limits; controllers note that of theirs."""
        inside = self.joint.limits.clamped(request.position)
        is_beyond = request.velocity is None and abs(inside - request.position) > self.per_tick
        self.clamped = f"a command for {request.position:g} is clamped to its limit, {inside:g}" if is_beyond else ""

    def _moved(self, dt: float) -> Iterator[Writes]:
        limiter = self.limiter
        if limiter is None or limiter.is_settled:
            return
        before = self.joint.raws(limiter.position)
        limiter.step(dt)
        goal = self.joint.raws(limiter.position)
        self._told = limiter.position
        if goal != before:
            yield {id_: {"goal_position": raw} for id_, raw in goal.items()}


class VelocityDrive(JointDrive):
    """Moves a joint with velocities that hold for one cycle each; without one it brakes within its limits."""

    _sent: Mapping[int, int] = {}  # raw velocities by id

    def turn(self, velocity: float) -> None:
        """Move with a velocity [rad/s or m/s] up to the end of the next cycle."""
        self.ask(joint_states.MoveAt(velocity))

    def _goal(self, position: float) -> Writes:
        self._sent = dict.fromkeys(self.joint.ids, 0)
        return self._same({"goal_velocity": 0})

    def was_cut(self) -> None:
        """Go on from rest: a servo has stopped by itself."""
        super().was_cut()
        self._sent = {}

    def _pursue(self, request: joint_states.JointRequest, limiter: Limiter, dt: float) -> str:
        if not isinstance(request, joint_states.MoveAt):
            return f"joint '{self.joint.name}' takes velocities"
        limiter.position = self.measured.position
        return limiter.want(limiter.position + request.velocity * dt, request.velocity) or ""

    def _moved(self, dt: float) -> Iterator[Writes]:
        limiter = self.limiter
        if limiter is None:
            return
        limiter.step(dt)
        velocity = limiter.velocity
        limiter.position = self.measured.position
        limiter.want(limiter.position)  # unless it is repeated
        raws = self.joint.wheel_raws(velocity, self.measured.position)
        is_lost = velocity == 0.0 and abs(self.measured.velocity) > self.joint.least_velocity
        if raws != self._sent or is_lost:  # nobody confirms a group write, and a wheel must stop
            self._sent = raws
            yield {id_: {"goal_velocity": raw} for id_, raw in raws.items()}
