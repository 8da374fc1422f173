"""What goes into the state machine of a joint, and what it answers. All times are robot time [s]."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Literal

from rbxcompose.dataclass import dataclass


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
        if self.hardware_error or self.is_lost:
            return JointMode.FAULT
        return JointMode.RESTING if self.rest_until is not None else self.base

    @property
    def is_blocked(self) -> bool:
        """Return whether the joint must have no torque, whatever is commanded."""
        return self.mode in (JointMode.DISABLED, JointMode.FAULT, JointMode.RESTING)
