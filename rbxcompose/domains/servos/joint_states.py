"""The state machine of a joint: what goes in, and what a joint may do now. All times are robot time."""

from __future__ import annotations

import math
from dataclasses import replace
from enum import StrEnum
from typing import Literal

from rbxcompose.base.dataclass import dataclass


class JointMode(StrEnum):
    """State of a joint, as people see it."""

    UNKNOWN = "unknown"
    """Nothing has been measured yet."""
    RELAXED = "relaxed"
    """Without torque; the next command switches it on."""
    HOLDING = "holding"
    """With torque, at rest or coming to rest."""
    ACTIVE = "active"
    """Follows commands."""
    DISABLED = "disabled"
    """Without torque, and commands are refused until it is enabled."""
    FAULT = "fault"
    """Without torque, after an error of the hardware or without measurements."""
    RESTING = "resting"
    """Without torque until it has cooled down."""


_FELL = "its servo has lost its torque, as after a moment without supply"
_MEND = "when that is mended, enable the joint, or reboot it if its servo has shut down"
WITH_TORQUE = frozenset({JointMode.HOLDING, JointMode.ACTIVE})


@dataclass(frozen=True, slots=True)
class ThermalPolicy:
    """When a joint is too hot [degC]: above `limit` it rests, for `rest` [s] and until it is at `resume` or below."""

    warn: float = 50.0
    limit: float = 60.0
    resume: float = 45.0
    rest: float = 60.0

    def __post_init__(self) -> None:
        if not (self.resume < self.limit and self.warn <= self.limit and self.rest >= 0.0):
            raise ValueError("'resume' is below 'limit', 'warn' is not above it, and 'rest' is not below 0 s")


@dataclass(frozen=True, slots=True)
class JointPolicy:
    """How a joint is watched."""

    cycle: float = 0.01
    """Period of measurements [s]."""
    hold_after: float = 3.0
    """A measurement older than this many cycles is stale: the joint holds and refuses commands."""
    fault_after: float = 0.5
    """A measurement older than this [s] is a fault."""
    on_start: Literal["relax", "hold", "wait"] = "relax"
    """What to do at the first measurement; nobody knows then whether the servo has torque. `wait` leaves that as is."""
    thermal: ThermalPolicy = ThermalPolicy()

    def __post_init__(self) -> None:
        if not 0.0 < self.cycle * self.hold_after <= self.fault_after:
            raise ValueError("a measurement is stale before it is a fault")


@dataclass(frozen=True, slots=True)
class Enable:
    """Enable the joint, or disable it: torque off, and commands are refused until it is enabled again."""

    on: bool


@dataclass(frozen=True, slots=True)
class Relax:
    """Switch torque off; the next command switches it on again."""


@dataclass(frozen=True, slots=True)
class Hold:
    """Switch torque on and stay where the joint is, or come to rest if it moves."""


@dataclass(frozen=True, slots=True)
class MoveTo:
    """Follow a command: a position [rad or m]."""

    position: float
    velocity: float | None = None
    """With which it is to pass there, for a path [rad/s or m/s]; None stops there."""


@dataclass(frozen=True, slots=True)
class MoveAt:
    """Follow a command: a velocity [rad/s or m/s]."""

    velocity: float


JointRequest = Enable | Relax | Hold | MoveTo | MoveAt


@dataclass(frozen=True, slots=True)
class JointInputs:
    """What is known of a joint in a cycle, and what is asked of it, in this order."""

    position: float | None = None
    """Last measured position [rad or m]; None, or no finite number, if there is none."""
    measured_at: float = -math.inf
    """When it was measured [s]."""
    temperature: float | None = None
    """[degC]; None while unknown."""
    hardware_error: str = ""
    """What the servo reports, such as `overload`; empty if nothing."""
    requests: tuple[JointRequest, ...] = ()
    has_lost_torque: bool = False
    """Whether a servo has none though it was switched on, as after a moment without supply."""


@dataclass(frozen=True, slots=True)
class WriteGoal:
    """Write the measured position as the goal, and start the limiter again from it."""

    position: float


@dataclass(frozen=True, slots=True)
class TorqueOn:
    """Switch torque on; a `WriteGoal` always comes before it, so that the joint does not snap to an old goal."""


@dataclass(frozen=True, slots=True)
class TorqueOff:
    """Switch torque off."""


@dataclass(frozen=True, slots=True)
class Pursue:
    """Hand what is wanted to the limiter."""

    request: MoveTo | MoveAt


@dataclass(frozen=True, slots=True)
class BringToRest:
    """Let the limiter bring the joint to rest and keep it there."""


@dataclass(frozen=True, slots=True)
class Refuse:
    """A request was refused."""

    request: JointRequest
    reason: str


JointAction = WriteGoal | TorqueOn | TorqueOff | Pursue | BringToRest | Refuse


@dataclass(frozen=True, slots=True)
class JointCondition:
    """State of a joint between two steps."""

    base: JointMode = JointMode.UNKNOWN
    """Unknown (so is its torque), relaxed, holding or active: where it stands if nothing blocks it."""
    is_enabled: bool = True
    hardware_error: str = ""
    """What a fault was for; it stays until the joint is enabled again."""
    is_lost: bool = False
    """A fault because measurements are missing; it ends when there are new ones."""
    has_lost_torque: bool = False
    """A fault for one cycle: who leads the joint gives up, and the next command switches torque on where it is."""
    has_fallen: bool = False
    """Since then, it has had no torque, and nobody has relaxed it."""
    rest_until: float | None = None
    """When the thermal rest may end [s]; None if the joint does not rest."""
    position: float | None = None
    """Last measured position that was a number [rad or m]."""
    measured_at: float = -math.inf
    """When it was measured [s]."""
    note: str = ""
    """Why it is as it is; empty if there is nothing to say."""

    @property
    def mode(self) -> JointMode:
        """The state that people see: the strongest of what blocks the joint."""
        if not self.is_enabled:
            return JointMode.DISABLED
        if self.hardware_error or self.is_lost or self.has_lost_torque:
            return JointMode.FAULT
        return JointMode.RESTING if self.rest_until is not None else self.base

    @property
    def is_blocked(self) -> bool:
        """Return whether the joint must have no torque, whatever is commanded."""
        return self.mode in (JointMode.DISABLED, JointMode.FAULT, JointMode.RESTING)


def step_joint(
    state: JointCondition, inputs: JointInputs, now: float, policy: JointPolicy
) -> tuple[JointCondition, tuple[JointAction, ...]]:
    """Return the state after what is known at `now` [s], and what to do, in this order."""
    cycle = _Cycle(state, inputs, now, policy)
    cycle.observe()
    for request in inputs.requests:
        cycle.answer(request)
    state = replace(cycle.state, position=cycle.position, measured_at=cycle.measured_at, note=cycle.note())
    return state, tuple(cycle.actions)


class _Cycle:
    """One step: the state as it changes, and the actions so far."""

    def __init__(self, state: JointCondition, inputs: JointInputs, now: float, policy: JointPolicy) -> None:
        self.inputs, self.now, self.policy = inputs, now, policy
        self.actions: list[JointAction] = []
        is_new = _finite(inputs.position) is not None
        self.state = state
        self.position, self.measured_at = (
            (inputs.position, inputs.measured_at) if is_new else (state.position, state.measured_at)
        )
        self.temperature = _finite(inputs.temperature)
        self.age = now - self.measured_at
        self.is_stale = self.age > policy.cycle * policy.hold_after

    def observe(self) -> None:
        """Take in what was measured: it counts before any request."""
        before, was_lost = self.state, self.state.is_lost
        is_known = before.base is not JointMode.UNKNOWN
        is_lost = (was_lost and self.is_stale) or (is_known and self.age > self.policy.fault_after)
        error, until = self.inputs.hardware_error or before.hardware_error, self._rest_until()
        is_limp = self.inputs.has_lost_torque and before.base in WITH_TORQUE
        now, then = (is_lost, error, until, is_limp), (was_lost, before.hardware_error, before.rest_until)
        if now != (*then, before.has_lost_torque):  # seldom: a copy takes long
            fell = before.has_fallen or is_limp
            self.state = replace(
                before,
                is_lost=is_lost,
                hardware_error=error,
                rest_until=until,
                has_lost_torque=is_limp,
                has_fallen=fell,
            )
        if self.state.is_lost:
            self._lose()
        elif self.state.is_blocked:
            self._block()
        elif self.is_stale:
            self._settle()
        elif self.state.base is JointMode.UNKNOWN:
            self._start("relax" if was_lost else self.policy.on_start)

    def answer(self, request: JointRequest) -> None:
        """Carry out a request, or refuse it with the reason."""
        reason = self._objection(request)
        if reason:
            self.actions.append(Refuse(request, reason))
            return
        match request:
            case Enable(on=True):
                self.state = replace(self.state, is_enabled=True, hardware_error="")
            case Enable():
                self.state = replace(self.state, is_enabled=False)
                self._switch_off()
            case Relax():
                self._switch_off()
                if self.state.has_fallen:
                    self.state = replace(self.state, has_fallen=False)
            case Hold():
                self._hold()
            case MoveTo() | MoveAt():
                self._pursue(request)

    def note(self) -> str:
        """Return why the joint is as it is; empty if there is nothing to say."""
        warn = self.policy.thermal.warn
        warm = f"{self.temperature:g} degC is above {warn:g} degC" if (self.temperature or -math.inf) > warn else ""
        return self._block_reason() or self._age_reason() or (_FELL if self.state.has_fallen else "") or warm

    def _rest_until(self) -> float | None:
        thermal, until = self.policy.thermal, self.state.rest_until
        if until is None:
            is_hot = self.temperature is not None and self.temperature > thermal.limit
            return self.now + thermal.rest if is_hot else None
        is_cool = self.temperature is not None and self.temperature <= thermal.resume
        return None if is_cool and self.now >= until else until

    def _lose(self) -> None:
        """Try to switch torque off; it is switched off again when the servo has come back, maybe with torque."""
        if self.state.base is not JointMode.UNKNOWN:
            self.actions.append(TorqueOff())
            self._become(JointMode.UNKNOWN)

    def _block(self) -> None:
        if self.state.base in WITH_TORQUE or (self.state.base is JointMode.UNKNOWN and not self.is_stale):
            self.actions.append(TorqueOff())
            self._become(JointMode.RELAXED)

    def _settle(self) -> None:
        """Let a joint that nobody sees come to rest."""
        if self.state.base is JointMode.ACTIVE:
            self.actions.append(BringToRest())
            self._become(JointMode.HOLDING)

    def _start(self, how: str) -> None:
        if how == "hold":
            self._hold()
        elif how == "relax":
            self.actions.append(TorqueOff())
            self._become(JointMode.RELAXED)

    def _switch_off(self) -> None:
        if self.state.base is JointMode.RELAXED:
            return
        self.actions.append(TorqueOff())
        if self.state.base in WITH_TORQUE:
            self._become(JointMode.RELAXED)

    def _hold(self) -> None:
        if self.state.base is JointMode.ACTIVE:
            self.actions.append(BringToRest())
        elif self.state.base is not JointMode.HOLDING:
            self._switch_on()
        self._become(JointMode.HOLDING)

    def _pursue(self, request: MoveTo | MoveAt) -> None:
        if self.state.base not in WITH_TORQUE:
            self._switch_on()
        self.actions.append(Pursue(request))
        self._become(JointMode.ACTIVE)

    def _switch_on(self) -> None:
        if self.position is not None:  # else the request was refused
            self.actions += [WriteGoal(self.position), TorqueOn()]

    def _become(self, base: JointMode) -> None:
        if base is not self.state.base:
            self.state = replace(self.state, base=base, has_fallen=self.state.has_fallen and base not in WITH_TORQUE)

    def _objection(self, request: JointRequest) -> str:
        match request:
            case Enable(on=on):
                error = self.inputs.hardware_error
                return f"the servo still reports {error}; if it has shut down, reboot it" if on and error else ""
            case Relax():
                return ""
            case MoveTo(position=position) if not math.isfinite(position):
                return f"the position {position} is not a finite number"
            case MoveAt(velocity=velocity) if not math.isfinite(velocity):
                return f"the velocity {velocity} is not a finite number"
            case _:
                return self._block_reason() or self._age_reason()

    def _block_reason(self) -> str:
        state = self.state
        if not state.is_enabled:
            return "it is disabled"
        if state.hardware_error:
            return f"the servo reported {state.hardware_error}; {_MEND}"
        if state.is_lost:
            return f"nothing has been measured for {self.age:.2f} s"
        if state.has_lost_torque:
            return _FELL
        if state.rest_until is None:
            return ""
        resume, left = self.policy.thermal.resume, max(0.0, state.rest_until - self.now)
        heat = "its temperature is unknown" if self.temperature is None else f"it has {self.temperature:g} degC"
        return f"it was too hot and rests for {left:.0f} s, then until {resume:g} degC: {heat}"

    def _age_reason(self) -> str:
        if self.position is None:
            return "its position is not known"
        return f"its measured position is {self.age:.3f} s old" if self.is_stale else ""


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
