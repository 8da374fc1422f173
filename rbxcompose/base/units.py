"""Quantities: numbers with units, read from text and written for people. Inside, everything is SI."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import suggest

# What people write for a unit whose symbol looks quite different.
OTHER_NAMES: Mapping[str, str] = {
    name: unit
    for unit, names in {
        "m": "meter meters metre metres",
        "in": 'inch inches "',
        "m/s": "mps",
        "s": "sec secs second seconds",
        "min": "minute minutes mins",
        "h": "hour hours hr hrs",
        "km/h": "kmh kph kmph",
        "deg": "degree degrees ° grad",
        "deg/s": "dps",
        "rad": "radian radians",
        "degC": "c °c celsius",
        "Nm": "n*m n·m n.m newtonmeter newtonmetre",
        "%": "percent pct",
        "us": "µs μs",
    }.items()
    for name in names.split()
}
_NO_LETTER = re.compile(r"[^a-z]")
# In [Nm]: gravity is 9.80665 m/s^2, an inch 2.54 cm, an ounce 28.349523 g (NIST SP 811).
_TORQUES: Mapping[str, float] = {
    name: factor
    for factor, names in {
        0.0980665: "kgcm kgfcm cmkg cmkgf",
        9.80665: "kgm kgfm mkg",
        9.80665e-5: "gcm gfcm",
        0.00706155: "ozin ozfin inoz",
        0.112985: "lbin lbfin inlb inlbf",
        1.35582: "lbft lbfft ftlb ftlbf",
        0.01: "ncm",
        0.001: "nmm",
    }.items()
    for name in names.split()
}


def torque_factor(written: str) -> float | None:
    """Return how many [Nm] a unit of torque has, however it is written: `kg-cm`, `kgf·cm`; None for others."""
    return _TORQUES.get(_NO_LETTER.sub("", written.casefold()))


MOST = 1e15  # magnitudes from here on are refused: they are slips, and floats soon stop being exact for whole numbers
LONGEST_NUMBER = 40  # characters of a number's text
NUMBER_TEXT = r"(?:[0-9]+(?:\.[0-9]+)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"

# The units that dimensions are made of. An angle is one, so that rad/s is not Hz and Nm is not J; so is the bit,
# because B/s and bit/s differ by a factor that must not get lost.
BASES = ("m", "s", "rad", "kg", "A", "degC", "B", "bit")


class UnitError(ValueError):
    """Raised when a text or a number is not the required quantity.

    `message` says what is wrong, `detail` what was found instead, `help` what to do; the last two may be empty.
    """

    def __init__(self, message: str, *, detail: str = "", help: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.detail = detail
        self.help = help


@dataclass(frozen=True, slots=True)
class Dimension:
    """What a quantity measures: a name, and the exponents over `BASES`.

    `ratio`, `number` and `quotient` (what a division of equal dimensions gives) have no exponents but differ by name: a
    ratio cannot be compared with a bare number, a quotient with either.
    """

    name: str
    exponents: tuple[int, ...]

    @property
    def phrase(self) -> str:
        """Return the name as used in a sentence: 'an angular speed'."""
        if self != QUOTIENT and self.name not in DIMENSIONS:
            return f"a quantity in {self.name}"
        if self is DATA:
            return "an amount of data"
        return f"{'an' if self.name[0] in 'aeiou' else 'a'} {self.name.replace('_', ' ')}"

    def is_comparable(self, other: Dimension) -> bool:
        """Return whether values of the two dimensions may be compared or added."""
        return self.exponents == other.exponents and {self, other} != {RATIO, NUMBER}

    def __mul__(self, other: Dimension) -> Dimension:
        if not any(self.exponents) and not any(other.exponents):
            return next(pure for pure in (RATIO, QUOTIENT, NUMBER) if pure in (self, other))
        return _measured(tuple(a + b for a, b in zip(self.exponents, other.exponents, strict=True)))

    def __truediv__(self, other: Dimension) -> Dimension:
        if self == RATIO and other in (NUMBER, QUOTIENT):
            return RATIO
        return _measured(tuple(a - b for a, b in zip(self.exponents, other.exponents, strict=True)))


def _dimension(name: str, **exponents: int) -> Dimension:
    return Dimension(name, tuple(exponents.get(base, 0) for base in BASES))


LENGTH = _dimension("length", m=1)
TIME = _dimension("time", s=1)
SPEED = _dimension("speed", m=1, s=-1)
ACCELERATION = _dimension("acceleration", m=1, s=-2)
ANGLE = _dimension("angle", rad=1)
ANGULAR_SPEED = _dimension("angular_speed", rad=1, s=-1)
ANGULAR_ACCELERATION = _dimension("angular_acceleration", rad=1, s=-2)
JERK = _dimension("jerk", m=1, s=-3)
ANGULAR_JERK = _dimension("angular_jerk", rad=1, s=-3)
FREQUENCY = _dimension("frequency", s=-1)
RATIO = _dimension("ratio")
MASS = _dimension("mass", kg=1)
FORCE = _dimension("force", kg=1, m=1, s=-2)
TORQUE = _dimension("torque", kg=1, m=2, s=-2, rad=-1)
VOLTAGE = _dimension("voltage", kg=1, m=2, s=-3, A=-1)
CURRENT = _dimension("current", A=1)
POWER = _dimension("power", kg=1, m=2, s=-3)
ENERGY = _dimension("energy", kg=1, m=2, s=-2)
CHARGE = _dimension("charge", A=1, s=1)
TEMPERATURE = _dimension("temperature", degC=1)
VOLUME = _dimension("volume", m=3)
DATA = _dimension("data", B=1)
BIT_RATE = _dimension("bit_rate", bit=1, s=-1)
NUMBER = _dimension("number")
QUOTIENT = _dimension("quotient")


# Each dimension with an example and its units; a value in SI is `value * times / per`. Two factors, because 35 / 100
# is exact and 35 * 0.01 is not.
_TABLE: Mapping[Dimension, tuple[str, Mapping[str, tuple[float, float]]]] = {
    LENGTH: ("0.5 m", {"m": (1, 1), "cm": (1, 100), "mm": (1, 1000), "km": (1000, 1), "in": (254, 10_000)}),
    TIME: ("5 s", {"s": (1, 1), "ms": (1, 1000), "us": (1, 1_000_000), "min": (60, 1), "h": (3600, 1)}),
    SPEED: ("0.3 m/s", {"m/s": (1, 1), "cm/s": (1, 100), "km/h": (1000, 3600)}),
    ACCELERATION: ("0.5 m/s^2", {"m/s^2": (1, 1)}),
    ANGLE: ("90 deg", {"rad": (1, 1), "deg": (math.pi, 180)}),
    ANGULAR_SPEED: ("90 deg/s", {"rad/s": (1, 1), "deg/s": (math.pi, 180), "rpm": (math.pi, 30)}),
    ANGULAR_ACCELERATION: ("180 deg/s^2", {"rad/s^2": (1, 1), "deg/s^2": (math.pi, 180)}),
    JERK: ("5 m/s^3", {"m/s^3": (1, 1)}),
    ANGULAR_JERK: ("20 rad/s^3", {"rad/s^3": (1, 1), "deg/s^3": (math.pi, 180)}),
    FREQUENCY: ("20 Hz", {"Hz": (1, 1), "kHz": (1000, 1)}),
    RATIO: ("50 %", {"%": (1, 100)}),
    MASS: ("2 kg", {"kg": (1, 1), "g": (1, 1000)}),
    FORCE: ("10 N", {"N": (1, 1)}),
    TORQUE: ("1.5 Nm", {"Nm": (1, 1)}),
    VOLTAGE: ("12 V", {"V": (1, 1), "mV": (1, 1000)}),
    CURRENT: ("2 A", {"A": (1, 1), "mA": (1, 1000)}),
    POWER: ("20 W", {"W": (1, 1)}),
    ENERGY: ("50 Wh", {"Wh": (3600, 1)}),
    CHARGE: ("2.2 Ah", {"Ah": (3600, 1)}),
    TEMPERATURE: ("50 degC", {"degC": (1, 1)}),
    VOLUME: ("0.5 l", {"l": (1, 1000), "ml": (1, 1_000_000)}),
    DATA: ("64 kB", {"B": (1, 1), "kB": (1000, 1), "MB": (1_000_000, 1)}),
    BIT_RATE: ("1 Mbit/s", {"bit/s": (1, 1), "kbit/s": (1000, 1), "Mbit/s": (1_000_000, 1)}),
    NUMBER: ("2", {}),
}
DIMENSIONS: Mapping[str, Dimension] = MappingProxyType({dimension.name: dimension for dimension in _TABLE})
_BY_EXPONENTS = {dimension.exponents: dimension for dimension in (*DIMENSIONS.values(), QUOTIENT)}

# These have two conventions each, so a bare number is ambiguous.
_AMBIGUOUS: Mapping[Dimension, tuple[str, ...]] = {ANGLE: ("deg", "rad"), RATIO: ("%",), TEMPERATURE: ("degC",)}


def _measured(exponents: tuple[int, ...]) -> Dimension:
    """Return the dimension with these exponents; one without a name is named by its unit: 'm^2/s'."""
    if known := _BY_EXPONENTS.get(exponents):
        return known
    above = [_power(base, size) for base, size in zip(BASES, exponents, strict=True) if size > 0]
    below = [_power(base, -size) for base, size in zip(BASES, exponents, strict=True) if size < 0]
    return Dimension("/".join(["*".join(above) or "1", *below]), exponents)


def _power(base: str, size: int) -> str:
    return base if size == 1 else f"{base}^{size}"


@dataclass(frozen=True, slots=True)
class Unit:
    """One unit of the closed list, with its two factors to SI."""

    name: str
    dimension: Dimension
    times: float
    per: float

    def to_si(self, value: float) -> float:
        """Convert from this unit to SI."""
        return value * self.times / self.per

    def from_si(self, value: float) -> float:
        """Convert from SI to this unit."""
        return value * self.per / self.times


UNITS: Mapping[str, Unit] = MappingProxyType(
    {name: Unit(name, dimension, *scale) for dimension, (_, scales) in _TABLE.items() for name, scale in scales.items()}
)
_SHOWN_IN = {dimension: UNITS[text.split()[1]] for dimension, (text, _) in _TABLE.items() if " " in text}
_SHOWN_IN |= {DATA: UNITS["B"], BIT_RATE: UNITS["bit/s"]}

_QUANTITY = re.compile(rf"([+-]?{NUMBER_TEXT})\s*(.*)", re.DOTALL)
_FACTOR = re.compile(r"([^\d^/²³]+?)(?:\^?([23²³]))?")
_POWERS = {"²": "2", "³": "3"}


@dataclass(frozen=True, slots=True)
class Quantity:
    """A value in SI with its dimension."""

    value: float
    dimension: Dimension


def example(dimension: Dimension) -> str:
    """Return a sample text of a named dimension: '0.3 m/s'."""
    return _TABLE[dimension][0]


def unit_help(written: str, number: str = "", wanted: Dimension | None = None) -> str:
    """Return the help for an unknown unit: what was probably meant, else the units of the wanted dimension.

    `number` stands before the unit. A unit of another dimension than the wanted one is never proposed, and where the
    number would be another one, the help says the whole quantity.
    """
    if number and wanted in (None, TORQUE) and (factor := torque_factor(written)):
        return f"write '{float(number) * factor:.4g} Nm': 1 {written} is {factor:g} Nm"
    made = _made_of_units(written)
    if made and wanted in (None, made.dimension) and (shown := _SHOWN_IN.get(made.dimension)):
        if same := next((unit for unit in units_of(made.dimension) if UNITS[unit].to_si(1) == made.to_si(1)), ""):
            return f"did you mean '{same}'?"
        if number:
            return f"write '{shown.from_si(made.to_si(float(number))):.12g} {shown.name}', which is the same"
    usual = _SHOWN_IN[wanted].name if wanted in _SHOWN_IN else ""
    fitting = sorted(units_of(wanted), key=lambda unit: unit != usual) if wanted else list(UNITS)
    if number and wanted and (whole := [unit for unit in fitting if written and unit.endswith(written)]):
        return f"write {_with_each(number, whole)}"
    # What is of another dimension was not misspelt.
    return suggest("" if made else written, fitting, f"units of {wanted.phrase}" if wanted else "units")


def units_of(dimension: Dimension) -> list[str]:
    """Return the units of a dimension, the base unit first."""
    return [name for name, unit in UNITS.items() if unit.dimension == dimension]


def unit_named(word: str) -> Unit | None:
    """Return the unit of a name that people write; letters of another case will do."""
    if known := UNITS.get(word):
        return known
    folded = word.casefold()
    meant = OTHER_NAMES.get(folded) or next((unit for unit in UNITS if unit.casefold() == folded), "")
    return UNITS.get(meant)


def _made_of_units(written: str) -> Unit | None:
    """Return the unit that a text means: one by another name, or one made of known units, such as `mm/s^2`."""
    if (known := unit_named(written)) or not written:
        return known
    made = Unit(written, NUMBER, 1.0, 1.0)
    for index, part in enumerate(written.split("/")):
        found = _FACTOR.fullmatch(part.strip())
        unit = unit_named(found[1]) if found else None
        if unit and found:
            for _ in range(int(_POWERS.get(found[2], found[2]) or 1)):
                made = _times(made, Unit("", unit.dimension, unit.per, unit.times) if index else unit, index > 0)
        elif index or part.strip() not in ("", "1"):
            return None
    return made


def _times(unit: Unit, other: Unit, is_below: bool) -> Unit:
    dimension = unit.dimension / other.dimension if is_below else unit.dimension * other.dimension
    return Unit(unit.name, dimension, unit.times * other.times, unit.per * other.per)


def _with_each(number: str, units: list[str]) -> str:
    return " or ".join(f"'{number} {unit}'" for unit in units)


def needs_unit(dimension: Dimension) -> bool:
    """Return whether a bare number is ambiguous for a dimension; otherwise it is taken as SI."""
    return dimension in _AMBIGUOUS


def bare_number_help(dimension: Dimension, value: float) -> str:
    """Return what to write instead of a bare number, with that number; empty if it is taken as SI."""
    if dimension == RATIO and 0 < abs(value) < 1:
        share, same = format_number(value * 100), format_number(value)
        return f"write '{share} %', or '{same} %' if it is that little"
    return f"write {_with_each(format_number(value), list(_AMBIGUOUS[dimension]))}" if needs_unit(dimension) else ""


def quantity(number: str, unit: Unit | None) -> Quantity:
    """Return the quantity given by the text of a number and a unit.

    Raises:
        UnitError: if the number is too long or too large.
    """
    if len(number) > LONGEST_NUMBER:
        raise UnitError(f"a number may have {LONGEST_NUMBER} characters; this one has {len(number)}")
    written = float(number)
    value = unit.to_si(written) if unit else written
    _require_moderate(written)
    _require_moderate(value)
    return Quantity(value, unit.dimension if unit else NUMBER)


def _require_moderate(value: float) -> None:
    if not abs(value) < MOST:  # false for NaN, too
        raise UnitError("a number must be finite and below 1e15")


@lru_cache(1000)  # robots repeat the same texts
def parse_quantity(text: str, wanted: Dimension | None = None) -> Quantity:
    """Read `0.3 m/s`, `5s`, `-90 deg`, `1e-3 m`, `50 %` or a plain number; `wanted` is for the help.

    Raises:
        UnitError: if the text is not a number with a unit of the list.
    """
    match = _QUANTITY.fullmatch(text.strip())
    if not match:
        alone = unit_named(text.strip())
        is_meant = alone is not None and wanted in (None, alone.dimension)
        help_text = f"write a number before '{alone.name}'" if alone and is_meant else ""
        raise UnitError("not a number with a unit, such as '0.3 m/s'", help=help_text)
    number, unit = match.groups()
    if re.match(r",\d", unit):
        raise UnitError("write a decimal point, not a comma", help=f"write '{text.strip().replace(',', '.', 1)}'")
    if unit and unit not in UNITS:
        raise UnitError(f"unknown unit '{_shortened(unit)}'", help=unit_help(unit, number, wanted))
    return quantity(number, UNITS.get(unit))


def written_unit(text: str) -> str | None:
    """Return the unit of a quantity as it is written, None if there is none: `cm/s` of `20 cm/s`."""
    match = _QUANTITY.fullmatch(text.strip())
    return match[2] if match and match[2] in UNITS else None


def number_and_unit(text: str) -> tuple[str, str]:
    """Return the number and the unit of a quantity, this by its name in the list: `deg` of `90°`, '' of `90`.

    Raises:
        UnitError: if the text is not a number with a unit that people write.
    """
    match = _QUANTITY.fullmatch(text.strip())
    unit = unit_named(match[2]) if match else None
    if not match or (match[2] and not unit):
        raise UnitError("not a number with a unit")
    quantity(match[1], unit)
    return match[1], unit.name if unit else ""


def _shortened(text: str) -> str:
    return text if len(text) <= 20 else f"{text[:20]}..."


_LEAST = 1e-9  # [s or Hz]: what is less, or more than its inverse, is no rate of anything


def _turned_round(wanted: Dimension, read: Quantity) -> str:
    """Return a period as a rate, or a rate as a period, if one is written for the other."""
    if not _LEAST < read.value < 1.0 / _LEAST or {wanted, read.dimension} != {TIME, FREQUENCY}:
        return ""
    shown = format_quantity(float(f"{1.0 / read.value:.6g}"), wanted)
    return f"once every {shown}: write '{shown}'" if wanted == TIME else f"a period as a rate: write '{shown}'"


def to_si(value: object, dimension: Dimension) -> float:
    """Return the SI value of a text, a bare number (already SI) or a quantity, which must be of this dimension.

    Raises:
        UnitError: if it is not; a bare number is ambiguous for an angle, ratio or temperature.
    """
    if isinstance(value, str):
        try:
            read = parse_quantity(value, dimension)
        except UnitError as error:
            raise UnitError(_must_be(dimension), detail=error.message, help=error.help) from None
    elif isinstance(value, Quantity):
        read = value
    elif isinstance(value, int | float) and not isinstance(value, bool):
        read = _bare(value)
    else:
        raise UnitError(_must_be(dimension))
    if read.dimension == NUMBER and (fix := bare_number_help(dimension, read.value)):
        raise UnitError(f"must be {dimension.phrase}", detail="the unit is missing", help=fix)
    if read.dimension not in (dimension, NUMBER):
        help_text = _turned_round(dimension, read) or (minutes_help(value) if dimension == TIME else "")
        raise UnitError(_must_be(dimension), detail=f"this is {read.dimension.phrase}", help=help_text)
    _require_moderate(read.value)
    return read.value


def minutes_help(written: object) -> str:
    """Return what to write for minutes, if metres may be meant as these."""
    found = _QUANTITY.fullmatch(written) if isinstance(written, str) else None
    return f"if these are minutes, write '{found[1]} min'" if found is not None and found[2] == "m" else ""


def _must_be(dimension: Dimension) -> str:
    return f"must be {dimension.phrase}, such as '{example(dimension)}'"


def _bare(value: float) -> Quantity:
    # Compared before conversion: a whole number may be too large to become a float.
    _require_moderate(value)
    return Quantity(float(value), NUMBER)


def format_number(value: float) -> str:
    """Write a number for people: six digits or all those before the point, no exponent between 1e-4 and 1e15."""
    text = f"{value:.6g}"
    if "e" in text and 1 <= abs(value) < MOST:
        text = f"{value:.0f}"
    return "0" if text == "-0" else text


def format_quantity(value: float, dimension: Dimension, unit: str | None = None) -> str:
    """Write an SI value for people in `unit`, else in the dimension's usual one: '90 deg'.

    Raises:
        UnitError: if the unit is not one of this dimension.
    """
    shown = _SHOWN_IN.get(dimension) if unit is None else UNITS.get(unit)
    if unit is not None and (shown is None or shown.dimension != dimension):
        raise UnitError(f"'{unit}' is not a unit of {dimension.phrase}")
    if shown is None:
        return format_number(value)
    return f"{format_number(shown.from_si(value))} {shown.name}"
