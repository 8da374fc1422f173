"""A servo for tests: the memory of a control table, a motor that moves, heat, load and shutdown. It knows no bytes.

It follows the e-manual where that is clear. Where servos differ from each other, the test chooses: `holds_on_enable`
tells whether torque keeps the present position or snaps to an old goal.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from rbxcompose.actuation.control_items import ControlItem
from rbxcompose.actuation.servo_models import ONE_ERRORS, ServoModel, servo_models
from rbxcompose.twins.servo_motor import IdealMotor, ServoMotor

FASTEST = 6.0  # [rad/s] without a limit of the speed
VOLTAGE, OVERHEATED, OVERLOAD = 1, 4, 32  # bits of errors
_SHUTDOWN = {1: 36, 2: 52}  # masks of the bits that switch torque off
_SIZE = 1024  # [B] of memory
_RIGHT, _FAILED, _RANGE, _LIMIT, _ACCESS = 0, 1, 4, 6, 7  # results in protocol 2.0
_ONE_RESULTS = {_RIGHT: 0, _FAILED: 0, _RANGE: 8, _LIMIT: 2, _ACCESS: 8}  # the nearest of protocol 1.0
_GOALS = ("goal_position", "goal_speed", "goal_velocity", "goal_current")
_READ_ONLY = ("model_number", "firmware", "moving", "hardware_error")


@dataclass(slots=True)
class ServoFaults:
    """What goes wrong with a servo's replies until it is set back."""

    is_mute: bool = False
    silences_next: bool = False
    """While mute, those after it in a group keep waiting for its reply, too."""
    delay: float = 0.0
    """How much later each reply is [s]."""
    garbage: bytes = b""
    """Stands before each reply."""
    corrupts: bool = False
    """Flips a bit of each reply."""
    cuts: int = 0
    """How many bytes at the end of each reply are missing."""
    id: int | None = None
    """Replies carry this id."""
    repeats: int = 1
    """How often each reply is sent."""


class FakeServo:
    """One servo of a model, at `id`, at rest in the middle of its range, with torque off.

    An ideal one is at its goal at once, without heat or load.

    Raises:
        KeyError: if there is no such model.
    """

    def __init__(
        self, model: str, id: int, *, baud: int = 1_000_000, holds_on_enable: bool = True, is_ideal: bool = False
    ) -> None:
        self.model: ServoModel = servo_models()[model]
        self.memory = bytearray(_SIZE)
        self.faults = ServoFaults()
        self.holds_on_enable = holds_on_enable
        self.load = 0.0  # of the most, which the outside puts on it
        self.heard = 0.0  # [s], time of the last instruction
        self.is_jammed = False
        centre = float(self.model.items["present_position"].centre)
        self.motor = IdealMotor(centre) if is_ideal else ServoMotor(centre)
        self._errors = 0
        self._is_shut_down = False
        self._prepare(id, baud)

    def _prepare(self, id: int, baud: int) -> None:
        family = self.model.family
        first = {"model_number": self.model.number, "firmware": 45, "id": id, "return_delay": 250}
        first |= {"baud": self.model.code_of(baud) or 0, "status_return_level": 2, "temperature_limit": 80}
        first |= {"shutdown": _SHUTDOWN[self.model.protocol], "present_voltage": 120, "torque_limit": 1023}
        first |= {"min_position": 0, "max_position": family.ticks - 1, "goal_position": family.centre}
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
        return self.get("id")

    @property
    def baud(self) -> int:
        """Return the rate at which it listens [bit/s]."""
        return self.model.baud_of(self.get("baud")) or 0

    @property
    def alert(self) -> int:
        """Return what a status tells of its health: bits of errors in protocol 1.0, bit 7 in 2.0."""
        if self.model.protocol == 1:
            return self._errors & ONE_ERRORS
        return 128 if self._errors else 0

    @property
    def is_wheel(self) -> bool:
        """Tell whether it turns without an end."""
        if modes := self.model.family.modes:
            return self.get("operating_mode") == modes["velocity"]
        return self.get("min_position") == self.get("max_position") == 0

    def get(self, item: str) -> int:
        """Return the raw value of an item."""
        where = self.model.item(item)
        return where.decode(bytes(self.memory[where.address : where.end]))

    def set(self, item: str, raw: int) -> None:
        """Set an item from outside, as if the servo had done it; what its table lacks has no effect."""
        where = self.model.items.get(item)
        if where:
            self.memory[where.address : where.end] = where.encode(raw)

    def heat_to(self, temperature: float) -> None:
        """Set its temperature [degC]."""
        self.motor.temperature = temperature

    def move_to(self, raw: int) -> None:
        """Turn it by hand [ticks]."""
        self.motor.put(float(raw))
        self._show()

    def step(self, dt: float, now: float) -> None:
        """Let `dt` [s] pass until `now` [s]."""
        self._watch(now)
        if not self.get("torque_enable") or self.is_jammed:
            self.motor.rest(dt)
        elif self.is_wheel:
            self._turn(dt)
        else:
            speed = self.model.to_si("goal_speed", self.get("goal_speed")) or FASTEST
            self.motor.approach(self.get("goal_position"), speed / self.model.per_tick, dt)
        self._protect()
        self._show()

    def _watch(self, now: float) -> None:
        """Stop when the bus has been silent for longer than the watchdog allows."""
        if "bus_watchdog" not in self.model.items:
            return
        limit = self.get("bus_watchdog")
        if limit > 0 and now - self.heard > self.model.to_si("bus_watchdog", limit):
            self.set("bus_watchdog", -1)
            self.set("goal_velocity", 0)
            self.set("goal_position", round(self.motor.position))

    def _turn(self, dt: float) -> None:
        motor, speed = self.motor, self.model.to_si("goal_velocity", self.get("goal_velocity"))
        motor.turn(speed / self.model.per_tick, dt)
        if self.model.protocol == 1:
            motor.position %= self.model.family.ticks

    def _protect(self) -> None:
        found = OVERHEATED if self.motor.temperature > self.get("temperature_limit") else 0
        found |= OVERLOAD if abs(self.load) > 1.0 and (self.get("torque_enable") or self._is_shut_down) else 0
        found |= 0 if 60 <= self.get("present_voltage") <= 280 else VOLTAGE
        self._errors = found | (self._errors if self.model.protocol == 2 else 0)  # which keeps them until it reboots
        if self._errors & self.get("shutdown"):
            self._is_shut_down = True
            self.set("torque_enable", 0)
        elif self.model.protocol == 1:
            self._is_shut_down = False

    def _show(self) -> None:
        """Write what it measures into its memory."""
        speed = self.motor.velocity * self.model.per_tick
        at = self.model.items["present_position"]
        aim = self.get("goal_position")
        self.set("present_position", max(at.least, min(at.most, round(self.motor.position))))
        self.set("present_speed", self._fitted("present_speed", self.model.to_raw("present_speed", speed)))
        self.set("present_load", self._fitted("present_load", round(1000 * self.load)))
        self.set("present_temperature", round(self.motor.temperature))
        self.set("hardware_error", self._errors if self.model.protocol == 2 else 0)
        is_going = bool(self.get("torque_enable")) and not self.is_wheel and abs(aim - self.motor.position) > 1
        self.set("moving", int(is_going or abs(speed) > 1e-3))

    def _fitted(self, item: str, raw: int) -> int:
        where = self.model.items[item]
        return max(where.least, min(where.most, raw))

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
        if self.motor.is_ideal:
            self.step(0.0, self.heard)

    def reboot(self) -> None:
        """Start again: torque off, errors forgotten unless their cause is still there."""
        self._errors, self._is_shut_down = 0, False
        for item in ("torque_enable", "bus_watchdog", "led", "goal_speed"):
            self.set(item, 0)
