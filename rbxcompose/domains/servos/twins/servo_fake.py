"""A simulated servo: a motor with heat and load, and the memory of a control table around it."""

from __future__ import annotations

import math
from collections.abc import Collection
from random import Random

from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.servos.models import ONE_ERRORS, ControlItem, ServoModel, servo_models
from rbxcompose.domains.servos.twins.servo_faults import ServoFaults

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

    def __init__(self, position: float, per_tick: float) -> None:
        self.traits = MotorTraits()
        self.position = self._aim = position  # the profile is at `_aim`, and moves at `_speed`
        self.velocity = self._speed = 0.0
        self.effort = 0.0
        self.temperature = self.traits.ambient
        self._fastest, self._strongest = self.traits.fastest / per_tick, self.traits.acceleration / per_tick

    def put(self, position: float) -> None:
        """Be somewhere else, at rest."""
        self.position = self._aim = position
        self.velocity = self._speed = self.effort = 0.0

    def relax(self) -> None:
        """Stay, without torque."""
        self.push(0.0)

    def push(self, effort: float) -> None:
        """Stay, at a load."""
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


FASTEST = MotorTraits().fastest  # [rad/s] without a limit of the speed
VOLTAGE, OVERHEATED, OVERLOAD = 1, 4, 32  # bits of errors
_SHUTDOWN = {1: 36, 2: 52}  # masks of the bits that switch torque off
_SIZE = 1024  # [B] of memory
_RIGHT, _FAILED, _RANGE, _LIMIT, _ACCESS = 0, 1, 4, 6, 7  # results in protocol 2.0
_ONE_RESULTS = {_RIGHT: 0, _FAILED: 0, _RANGE: 8, _LIMIT: 2, _ACCESS: 8}  # the nearest of protocol 1.0
_GOALS = ("goal_position", "goal_speed", "goal_velocity", "goal_current", "torque_limit")
_READ_ONLY = ("model_number", "firmware", "moving", "hardware_error")


@dataclass(frozen=True, slots=True)
class _Orders:
    """What the memory orders: positions in ticks, speeds in ticks/s."""

    id: int
    has_torque: bool
    is_wheel: bool
    goal: int
    speed: float
    fastest: float
    acceleration: float
    hottest: int
    shutdown: int
    patience: float | None
    strength: float  # of the most torque


class FakeServo:
    """One servo of a model, at `id`, at rest in the middle of its range, with torque off.

    `motor` is the type of its motor. `noise` [ticks] is the standard deviation of measured
    positions, which `seed` repeats.

    Raises:
        KeyError: if there is no such model.
    """

    def __init__(
        self,
        model: str | ServoModel,
        id: int,
        *,
        baud: int = 1_000_000,
        holds_on_enable: bool = True,
        motor: type[ServoMotor] = ServoMotor,
        noise: float = 0.0,
        seed: int = 0,
    ) -> None:
        self.model = model if isinstance(model, ServoModel) else servo_models()[model]
        self.memory = bytearray(_SIZE)
        self.faults = ServoFaults()
        self.holds_on_enable = holds_on_enable
        self.load = 0.0  # of the most, which the outside puts on it
        self.heard = 0.0  # [s], time of the last instruction
        centre = float(self.model.items["present_position"].centre)
        self.motor = motor(centre, self.model.per_tick)
        self.noise = noise
        self._random = Random(f"{seed}/{id}")  # noqa: S311 - no secret, and must be repeatable
        self._known: _Orders | None = None  # what the memory orders, until it changes
        self._shown: dict[str, int] = {}
        self._errors = 0
        self._is_shut_down = False
        self._prepare(id, baud)

    def _prepare(self, id: int, baud: int) -> None:
        family = self.model.family
        first = {"model_number": self.model.number, "firmware": 45, "id": id, "return_delay": 250}
        first |= {"baud": self.model.code_of(baud) or 0, "status_return_level": 2, "temperature_limit": 80}
        first |= {"shutdown": _SHUTDOWN[self.model.protocol]}
        first |= dict.fromkeys(("max_torque", "torque_limit"), self.model.to_raw("torque_limit", 1.0))
        first |= {"min_position": 0, "max_position": family.ticks - 1, "goal_position": family.centre}
        if "velocity_limit" in self.model.items:
            first["velocity_limit"] = self.model.to_raw("velocity_limit", FASTEST)
        if family.table == "P":
            first |= {"min_position": -family.ticks // 2, "max_position": family.ticks // 2}
        if family.modes:
            first["operating_mode"] = family.modes["position"]
        for name, raw in first.items():
            self.set(name, raw)
        self._show()

    @property
    def id(self) -> int:
        """Return the id to which it listens."""
        return self._orders.id

    @property
    def baud(self) -> int:
        """Return the rate at which it listens [bit/s]."""
        return self.model.baud_of(self.get("baud")) or 0

    @property
    def alert(self) -> int:
        """Return its health as a status reports it: bits of errors in protocol 1.0, bit 7 in 2.0."""
        if self.model.protocol == 1:
            return self._errors & ONE_ERRORS
        return 128 if self._errors else 0

    @property
    def is_wheel(self) -> bool:
        """Tell whether it turns without an end."""
        if modes := self.model.family.modes:
            return self.get("operating_mode") == modes["velocity"]
        return self.get("min_position") == self.get("max_position") == 0

    @property
    def has_torque(self) -> bool:
        """Tell whether its motor may pull: torque is on, and not limited to nothing."""
        return bool(self.get("torque_enable") and self.get("torque_limit"))

    def get(self, item: str) -> int:
        """Return the raw value of an item."""
        where = self.model.item(item)
        begin = where.address
        return where.decode(self.memory[begin : begin + where.size])

    def set(self, item: str, raw: int) -> None:
        """Set an item from outside, as if the servo had done it; what its table lacks has no effect."""
        where = self.model.items.get(item)
        if where:
            self.memory[where.address : where.end] = where.encode(raw)
            self._known = None
            self._shown.pop(item, None)

    @property
    def _orders(self) -> _Orders:
        if self._known is None:
            per_tick = self.model.per_tick
            has_watchdog = "bus_watchdog" in self.model.items and self.get("bus_watchdog") > 0
            self._known = _Orders(
                self.get("id"),
                self.has_torque,
                self.is_wheel,
                self.get("goal_position"),
                self._si("goal_velocity") / per_tick,
                self._si("goal_speed") / per_tick,
                self._si("profile_acceleration") / per_tick,
                self.get("temperature_limit"),
                self.get("shutdown"),
                self._si("bus_watchdog") if has_watchdog else None,
                min(1.0, self._si("torque_limit")),
            )
        return self._known

    def _si(self, item: str) -> float:
        return self.model.to_si(item, self.get(item)) if item in self.model.items else 0.0

    def move_to(self, raw: int) -> None:
        """Turn it by hand [ticks]."""
        self.motor.put(float(raw))
        self._show()

    def step(self, dt: float, now: float) -> None:
        """Let `dt` [s] pass until `now` [s]."""
        if self.faults.is_off:
            self.reboot()
        self._watch(now)
        self._move(dt)
        self.motor.warm(self._load, dt)
        if self.faults.is_hot:
            self.motor.temperature = self._orders.hottest
        self._protect()
        self._show()

    def _watch(self, now: float) -> None:
        """Stop when the bus has been silent for longer than the watchdog allows."""
        patience = self._orders.patience
        if patience is not None and now - self.heard > patience:
            self.set("bus_watchdog", -1)
            self.set("goal_velocity", 0)
            self.set("goal_position", round(self.motor.position))

    def _move(self, dt: float) -> None:
        orders, motor = self._orders, self.motor
        if not orders.has_torque:
            motor.relax()
        elif self.faults.is_jammed or (abs(self._outer) > orders.strength and not motor.is_ideal):
            wanted = orders.speed if orders.is_wheel else orders.goal - motor.position
            motor.push(math.copysign(orders.strength, wanted) if wanted else 0.0)
        elif not orders.is_wheel:
            motor.approach(orders.goal, orders.fastest, orders.acceleration, dt, orders.strength)
        else:
            motor.turn(orders.speed, orders.acceleration, dt, self._circle, orders.strength)

    @property
    def _circle(self) -> int:
        """Return after how many ticks its positions begin again while it turns; 0 if they go on."""
        return self.model.family.ticks if self.model.protocol == 1 else 0

    @property
    def _outer(self) -> float:
        """Return what is put on it from outside, of the most."""
        return self.load + self.faults.load

    @property
    def _load(self) -> float:
        """Return its load, of the most: what is put on it, and what the motor needs to move."""
        return max(-1.0, min(1.0, self._outer + self.motor.effort))

    @property
    def _voltage(self) -> float:
        """Return what is left of the supply under its load [V]."""
        traits = self.motor.traits
        return traits.supply - self.faults.missing - traits.sag * abs(self._load)

    def _protect(self) -> None:
        orders = self._orders
        found = OVERHEATED if self.motor.temperature > orders.hottest else 0
        found |= OVERLOAD if abs(self._outer) > 1.0 and (orders.has_torque or self._is_shut_down) else 0
        found |= 0 if 6.0 <= self._voltage <= 28.0 else VOLTAGE
        self._errors = found | (self._errors if self.model.protocol == 2 else 0)  # which keeps them until it reboots
        if self._errors & orders.shutdown:
            self._is_shut_down = True
            if orders.has_torque:
                self.set("torque_enable", 0)
            if self.model.protocol == 1:
                self.set("torque_limit", 0)
        elif self.model.protocol == 1:
            self._is_shut_down = False

    def _show(self) -> None:
        """Write what it measures into its memory."""
        motor, orders = self.motor, self._orders
        speed = motor.velocity * self.model.per_tick
        turned = motor.position % self._circle if orders.is_wheel and self._circle else motor.position
        measured = turned + (self._random.gauss(0.0, self.noise) if self.noise else 0.0)
        is_going = orders.has_torque and not orders.is_wheel and abs(orders.goal - motor.position) > 1
        self._write_measured("present_position", round(measured))
        self._write_measured("present_speed", self.model.to_raw("present_speed", speed))
        self._write_measured("present_load", round(1000 * self._load))
        self._write_measured("present_voltage", round(10 * self._voltage))
        self._write_measured("present_temperature", round(motor.temperature))
        self._write_measured("hardware_error", self._errors if self.model.protocol == 2 else 0)
        self._write_measured("moving", int(is_going or abs(speed) > 1e-3))

    def _write_measured(self, item: str, raw: int) -> None:
        """Write a measured value, as far as its item can hold it."""
        if self._shown.get(item) == raw:
            return
        self._shown[item] = raw
        if (where := self.model.items.get(item)) is not None:
            self.memory[where.address : where.end] = where.encode(max(where.least, min(where.most, raw)))

    def read(self, address: int, length: int) -> bytes | None:
        """Return memory, None if there is none."""
        return bytes(self.memory[address : address + length]) if 0 < length <= _SIZE - address else None

    def write(self, address: int, data: bytes) -> int:
        """Write memory as an instruction does; return the result in the terms of the protocol, 0 if it is right."""
        end = address + len(data)
        touched = [item for item in self.model.items.values() if item.address < end and item.end > address]
        result = next((found for item in touched if (found := self._refusal(item, address, data))), _RIGHT)
        if end > _SIZE:
            result = _RANGE
        if result == _RIGHT:
            was_on = bool(self.get("torque_enable"))
            self.memory[address:end] = data
            self._known = None
            self._follow({item.name for item in touched}, was_on)
        return result if self.model.protocol == 2 else _ONE_RESULTS[result]

    def _refusal(self, item: ControlItem, address: int, data: bytes) -> int:
        """Return why an item may not be written, 0 if it may."""
        if item.name in _READ_ONLY or item.name.startswith("present_"):
            return _ACCESS
        if item.end > address + len(data) or item.address < address:
            return _RIGHT  # only a part of it
        raw = item.decode(data[item.address - address : item.end - address])
        if self._is_kept(item):
            return _ACCESS
        if item.name in _GOALS and "bus_watchdog" in self.model.items and self.get("bus_watchdog") < 0:
            return _RANGE
        if item.name == "torque_enable" and raw and self._is_shut_down:
            return _FAILED
        if item.name == "torque_limit" and self.model.protocol == 2 and abs(raw) > self.get("max_torque"):
            return _LIMIT
        if item.name in ("goal_velocity", "goal_speed") and "velocity_limit" in self.model.items:
            return _LIMIT if abs(raw) > self.get("velocity_limit") else _RIGHT
        return _LIMIT if item.name == "goal_position" and not self._is_within(raw) else _RIGHT

    def _is_kept(self, item: ControlItem) -> bool:
        """Tell whether an item is in the part of memory that outlives the supply, which is locked now."""
        is_locked = self.get("torque_enable") if self.model.protocol == 2 else self.get("lock")
        return bool(is_locked) and item.address < self.model.items["torque_enable"].address

    def _is_within(self, raw: int) -> bool:
        modes = self.model.family.modes
        is_bounded = not self.is_wheel if not modes else self.get("operating_mode") == modes["position"]
        return not is_bounded or self.get("min_position") <= raw <= self.get("max_position")

    def _follow(self, written: Collection[str], was_on: bool) -> None:
        if "goal_position" in written and self.model.family.enables_at_goal and not self._is_shut_down:
            self.set("torque_enable", 1)
        elif "torque_enable" in written and not was_on and self.get("torque_enable") and self.holds_on_enable:
            at = self.model.items["goal_position"]
            self.set("goal_position", max(at.least, min(at.most, round(self.motor.position))))
        if "operating_mode" in written:
            self.set("torque_limit", self.get("max_torque"))
        if self.motor.is_ideal:
            self.step(0.0, self.heard)

    def reboot(self) -> None:
        """Start again: torque off, errors forgotten unless their cause is still there."""
        self._errors, self._is_shut_down = 0, False
        for item in ("torque_enable", "bus_watchdog", "led", "goal_speed"):
            self.set(item, 0)
        self.set("torque_limit", self.get("max_torque"))
