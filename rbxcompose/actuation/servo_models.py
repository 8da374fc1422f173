"""Models of servos: their names and numbers, control tables and ranges, as ROBOTIS's e-manual lists them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import field
from functools import cache
from types import MappingProxyType

from rbxcompose.actuation.control_items import ControlItem
from rbxcompose.actuation.control_tables import items_of
from rbxcompose.dataclass import dataclass
from rbxcompose.findings import suggest

HARDWARE_ERRORS: Mapping[int, str] = MappingProxyType(
    {1: "input voltage", 4: "overheated", 8: "encoder", 16: "electric shock", 32: "overload"}
)
"""Bits of `hardware_error` in protocol 2.0. In 1.0, those of voltage, heat and load have the same places."""
EXTENDED = "extended_position"  # the mode without ends
ONE_ERRORS = 1 | 4 | 32  # bits of the error byte in protocol 1.0 that tell of the servo, not of the request
_ONE_BAUDS: Mapping[int, int] = MappingProxyType({250: 2_250_000, 251: 2_500_000, 252: 3_000_000})  # MX only
_TWO_BAUDS = (9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)
COMMON_BAUDS = (57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000)
"""Rates that adapters and several models have [bit/s]."""
_BAUD_TOLERANCE = 0.03  # of a UART


@dataclass(frozen=True, slots=True)
class ServoFamily:
    """What models of a family share: protocol, positions, modes, and the habits of their firmware.

    `span` [rad] is the angle of `ticks` positions; `modes` has the codes of `operating_mode`, none where both position
    limits at 0 make a wheel.
    """

    table: str
    protocol: int
    ticks: int
    span: float
    centre: int
    modes: Mapping[str, int] = field(default_factory=dict)
    has_bulk_read: bool = True
    enables_at_goal: bool = False
    """Its firmware switches torque on when a goal position is written."""

    @property
    def is_endless(self) -> bool:
        """Tell whether it can be given positions beyond one turn."""
        return EXTENDED in self.modes


@dataclass(frozen=True, slots=True)
class ServoModel:
    """One model: its name, model number, family and control table."""

    name: str
    number: int
    family: ServoFamily
    items: Mapping[str, ControlItem]

    @property
    def protocol(self) -> int:
        """Return 1 or 2."""
        return self.family.protocol

    @property
    def volts(self) -> tuple[float, float]:
        """Return the least and the greatest supply that it works with [V]."""
        return next(volts for begin, volts in _VOLTS.items() if self.name.startswith(begin))

    @property
    def per_tick(self) -> float:
        """Return the angle of one tick of its position [rad]."""
        return self.family.span / self.family.ticks

    def item(self, name: str) -> ControlItem:
        """Return an item of the control table.

        Raises:
            KeyError: if the model has no such item; the text names similar ones.
        """
        try:
            return self.items[name]
        except KeyError:
            raise KeyError(f"{self.name} has no item '{name}'; {suggest(name, self.items, 'items')}") from None

    def to_si(self, item: str, raw: int) -> float:
        """Return a raw value in the SI unit of its item."""
        return self.item(item).to_si(raw)

    def to_raw(self, item: str, value: float) -> int:
        """Return the raw value nearest to an SI value."""
        return self.item(item).to_raw(value)

    def baud_of(self, code: int) -> int | None:
        """Return the baud rate [bit/s] of a code of its item `baud`, None if there is none."""
        if self.protocol == 1:
            if self.family.table == "MX 1.0":
                return _ONE_BAUDS.get(code, 2_000_000 // (code + 1) if code < 250 else None)
            return 2_000_000 // (code + 1) if 0 < code < 250 else None  # up to 1 Mbit/s
        codes = range(4) if self.family.table == "XL-320" else range(len(_TWO_BAUDS))
        return _TWO_BAUDS[code] if code in codes else None

    def code_of(self, baud: int) -> int | None:
        """Return the code of a baud rate [bit/s], None if the model does not have it within 3 %."""
        near = min(range(256), key=lambda code: abs((self.baud_of(code) or 0) - baud))
        return near if abs((self.baud_of(near) or 0) - baud) <= _BAUD_TOLERANCE * baud else None


_TURN = 2 * math.pi
_MODES_X = MappingProxyType({"velocity": 1, "position": 3, EXTENDED: 4, "pwm": 16})
_MODES_CURRENT = MappingProxyType({"current": 0, "current_position": 5, **_MODES_X})
_MODES_P = MappingProxyType({"current": 0, **_MODES_X})
_AX = ServoFamily("AX", 1, 1024, math.radians(300), 512, has_bulk_read=False, enables_at_goal=True)
_RX = ServoFamily("RX", 1, 1024, math.radians(300), 512, has_bulk_read=False, enables_at_goal=True)
_EX = ServoFamily("EX", 1, 4096, math.radians(250.92), 2048, has_bulk_read=False, enables_at_goal=True)
_MX = ServoFamily("MX 1.0", 1, 4096, _TURN, 2048, enables_at_goal=True)
_XL320 = ServoFamily("XL-320", 2, 1024, math.radians(300), 512, MappingProxyType({"velocity": 1, "position": 2}))
_X_LOAD = ServoFamily("X load", 2, 4096, _TURN, 2048, _MODES_X)
_X_1MA = ServoFamily("X 1 mA", 2, 4096, _TURN, 2048, _MODES_CURRENT)
_X_2MA = ServoFamily("X 2.69 mA", 2, 4096, _TURN, 2048, _MODES_CURRENT)
_X540 = ServoFamily("X540", 2, 4096, _TURN, 2048, _MODES_CURRENT)


def _p(half_turn: int) -> ServoFamily:
    return ServoFamily("P", 2, 2 * half_turn, _TURN, 0, _MODES_P)


_PM42, _PM54, _PH42, _PH54 = _p(263_187), _p(251_417), _p(303_750), _p(501_923)
_MODELS: tuple[tuple[ServoFamily, Mapping[str, int]], ...] = (
    (_AX, {"AX-12": 12, "AX-12W": 300, "AX-18": 18}),
    (_RX, {"RX-24": 24, "RX-28": 28, "RX-64": 64}),
    (_EX, {"EX-106+": 107}),
    (_MX, {"MX-12W": 360, "MX-28": 29, "MX-64": 310, "MX-106": 320}),
    (_XL320, {"XL-320": 350}),
    (_X_LOAD, {"MX-28(2.0)": 30, "XL430-W250": 1060, "XC430-W150": 1070, "XC430-W240": 1080}),
    (_X_1MA, {"XL330-M077": 1190, "XL330-M288": 1200}),
    (_X_1MA, {"XC330-T181": 1210, "XC330-T288": 1220, "XC330-M181": 1230, "XC330-M288": 1240}),
    (_X_2MA, {"MX-64(2.0)": 311, "MX-106(2.0)": 321}),
    (_X_2MA, {"XM430-W350": 1020, "XM430-W210": 1030, "XH430-W350": 1000, "XH430-W210": 1010}),
    (_X540, {"XM540-W270": 1120, "XM540-W150": 1130, "XH540-W270": 1100, "XH540-W150": 1110}),
    (_PM42, {"PM42-010": 2100}),
    (_PM54, {"PM54-040": 2110, "PM54-060": 2120}),
    (_PH42, {"PH42-020": 2000}),
    (_PH54, {"PH54-100": 2010, "PH54-200": 2020}),
)

_VOLTS: Mapping[str, tuple[float, float]] = {
    **dict.fromkeys(("AX-", "RX-24"), (9.0, 12.0)),
    **dict.fromkeys(("RX-", "EX-"), (12.0, 18.5)),
    "XL-320": (6.0, 8.4),
    **dict.fromkeys(("XL330", "XC330-M"), (3.7, 6.0)),
    "XL430": (6.5, 12.0),
    **dict.fromkeys(("XC330-T", "XC430"), (6.5, 14.8)),
    **dict.fromkeys(("MX-", "XM", "XH"), (10.0, 14.8)),
    **dict.fromkeys(("PM", "PH"), (24.0, 24.0)),
}
"""By how the names of models begin; the first that fits counts."""


def _made() -> Iterator[ServoModel]:
    for family, numbers in _MODELS:
        items = items_of(family.table, family.span / family.ticks, family.centre)
        yield from (ServoModel(name, number, family, items) for name, number in numbers.items())


@cache
def servo_models() -> Mapping[str, ServoModel]:
    """Return all models by name."""
    return MappingProxyType({model.name: model for model in _made()})


@cache
def _by_number() -> Mapping[int, ServoModel]:
    return {model.number: model for model in servo_models().values()}


def model_of_number(number: int) -> ServoModel | None:
    """Return the model with the number that a servo has told, None if it is not known."""
    return _by_number().get(number)


def find_model(name: str, models: Mapping[str, ServoModel]) -> ServoModel | None:
    """Return a model by its name; capitals, signs and the revision (`AX-12A`, `AX-12+`) do not matter."""
    folded = _folded(name)
    known = {_folded(one.name): one for one in models.values()}
    return known.get(folded) or known.get(folded.removesuffix("a").removesuffix("f"))


def model_named(name: str) -> ServoModel | None:
    """Return a model of Dynamixel by its name."""
    return find_model(name, servo_models())


def _folded(name: str) -> str:
    return "".join(letter for letter in name.casefold() if letter.isalnum())


def hardware_errors(bits: int) -> tuple[str, ...]:
    """Return the names of the faults that `hardware_error` tells."""
    return tuple(name for bit, name in HARDWARE_ERRORS.items() if bits & bit)
