from __future__ import annotations

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base import units
from rbxcompose.base.units import (
    DIMENSIONS,
    UNITS,
    Dimension,
    Quantity,
    UnitError,
    example,
    format_quantity,
    parse_quantity,
    to_si,
)
from tests.loops import for_all

LISTED = (
    "m cm mm km in s ms us min h m/s cm/s km/h m/s^2 m/s^3 rad deg rad/s deg/s rpm rad/s^2 deg/s^2 rad/s^3 deg/s^3 "
    "Hz kHz % kg g N Nm V mV A mA W Wh Ah degC l ml B kB MB bit/s kbit/s Mbit/s"
)


def test_the_list_of_units_is_closed() -> None:
    assert set(LISTED.split()) == set(UNITS)


@for_all(
    "text, value, dimension",
    [
        ("0.3 m/s", 0.3, units.SPEED),
        ("5s", 5.0, units.TIME),
        ("-90 deg", -math.pi / 2, units.ANGLE),
        ("1e-3 m", 0.001, units.LENGTH),
        ("50 %", 0.5, units.RATIO),
        ("35 %", 0.35, units.RATIO),
        ("2", 2.0, units.NUMBER),
        ("  +7.5  Hz ", 7.5, units.FREQUENCY),
        (".5 in", 0.0127, units.LENGTH),
        ("36 km/h", 10.0, units.SPEED),
        ("60 rpm", 2 * math.pi, units.ANGULAR_SPEED),
        ("1 Wh", 3600.0, units.ENERGY),
        ("2 Ah", 7200.0, units.CHARGE),
        ("50 degC", 50.0, units.TEMPERATURE),
        ("250 ml", 0.00025, units.VOLUME),
        ("64 kB", 64_000.0, units.DATA),
        ("1 Mbit/s", 1e6, units.BIT_RATE),
        ("20 min", 1200.0, units.TIME),
    ],
)
def test_a_text_is_read_into_si(text: str, value: float, dimension: Dimension) -> None:
    read = parse_quantity(text)
    assert read.value == pytest.approx(value, rel=1e-15)
    assert read.dimension == dimension


@for_all(
    "text",
    [
        *("", "m", "nan", "inf", "-inf s", "1e308 km", "1e15", "-1e15 m", "1_000 m", "0x10", "1,5 m", "5 s s", "- 5 s"),
        *("9" * 41, "1e999999999", "5 m/s^4", "5 furlong", "٣ m", "5 " + "x" * 1000),
    ],
)
def test_what_is_no_quantity_is_refused(text: str) -> None:
    with pytest.raises(UnitError):
        parse_quantity(text)


@for_all(
    "text, meant",
    [
        ("20 hz", "Hz"),
        ("5 S", "s"),
        ("3 seconds", "s"),
        ("30 percent", "%"),
        ("90 °", "deg"),
        ("20 C", "degC"),
        ("1 mbit/s", "Mbit/s"),
        ("3 m / s", "m/s"),
    ],
)
def test_an_unknown_unit_comes_with_the_one_that_was_meant(text: str, meant: str) -> None:
    with pytest.raises(UnitError) as caught:
        parse_quantity(text)
    assert caught.value.help == f"did you mean '{meant}'?"


def test_a_unit_error_is_a_value_error_with_a_short_message() -> None:
    with pytest.raises(ValueError) as caught:
        parse_quantity("5 " + "x" * 1000)
    assert len(str(caught.value)) < 60


def test_a_field_takes_its_own_dimension_in_any_unit() -> None:
    assert to_si("20 cm", units.LENGTH) == 0.2
    assert to_si(Quantity(0.3, units.SPEED), units.SPEED) == 0.3


def test_a_bare_number_is_si() -> None:
    assert to_si(0.3, units.SPEED) == 0.3
    assert to_si("0.3", units.SPEED) == 0.3
    assert to_si(3, units.NUMBER) == 3.0
    assert to_si(Quantity(2.0, units.NUMBER), units.LENGTH) == 2.0


@pytest.mark.parametrize(
    ("dimension", "fix"),
    [
        (units.ANGLE, "write '45 deg' or '45 rad'"),
        (units.RATIO, "write '45 %'"),
        (units.TEMPERATURE, "write '45 degC'"),
    ],
)
@pytest.mark.parametrize("bare", [45, 45.0, "45", Quantity(45.0, units.NUMBER)])
def test_a_bare_number_is_no_angle_ratio_or_temperature_and_the_help_keeps_it(
    dimension: Dimension, fix: str, bare: object
) -> None:
    with pytest.raises(UnitError) as caught:
        to_si(bare, dimension)
    assert (caught.value.help, caught.value.detail) == (fix, "the unit is missing")


def test_a_bare_share_of_one_may_be_a_percentage_of_either_kind() -> None:
    with pytest.raises(UnitError) as caught:
        to_si(0.15, units.RATIO)
    assert caught.value.help == "write '15 %', or '0.15 %' if it is that little"


@for_all(
    "text, dimension, fix",
    [
        ("0.3 mps", units.SPEED, "did you mean 'm/s'?"),
        ("0.3 m/sec", units.SPEED, "did you mean 'm/s'?"),
        ("1 m/s2", units.ACCELERATION, "did you mean 'm/s^2'?"),
        ("1000 mm/s^2", units.ACCELERATION, "write '1 m/s^2', which is the same"),
        ("6000 cm/min", units.SPEED, "write '1 m/s', which is the same"),
        ("1234567 mm/s^2", units.ACCELERATION, "write '1234.567 m/s^2', which is the same"),
        ("120/s", units.ANGULAR_SPEED, "write '120 deg/s' or '120 rad/s'"),
        ("0.3 mps", units.TIME, "units of a time: s, ms, us, min, h"),
        ("mps", units.SPEED, "write a number before 'm/s'"),
        ("mps", units.TIME, ""),
        ("45 grad", units.ANGLE, "did you mean 'deg'?"),
        ("12 kgcm", units.TORQUE, "write '1.177 Nm': 1 kgcm is 0.0980665 Nm"),
        ("150 oz-in", units.TORQUE, "write '1.059 Nm': 1 oz-in is 0.00706155 Nm"),
    ],
)
def test_the_help_for_an_unknown_unit_is_of_the_wanted_dimension(text: str, dimension: Dimension, fix: str) -> None:
    with pytest.raises(UnitError) as caught:
        to_si(text, dimension)
    assert caught.value.help == fix


@given(
    number=st.integers(1, 999),
    unit=st.text("mskgdeV/^2 ", min_size=1, max_size=8),
    dimension=st.sampled_from(list(DIMENSIONS.values())),
)
def test_no_help_proposes_a_unit_of_another_dimension(number: int, unit: str, dimension: Dimension) -> None:
    try:
        to_si(f"{number} {unit}", dimension)
    except UnitError as error:
        proposed = re.findall(r"'([^']*)'", error.help)
        assert all(
            units.UNITS[element.split(" ")[-1]].dimension == dimension for element in proposed if "," not in element
        )


def test_a_wrong_dimension_says_what_must_stand_there_and_what_does() -> None:
    with pytest.raises(UnitError) as caught:
        to_si("5 s", units.SPEED)
    assert str(caught.value) == "must be a speed, such as '0.3 m/s'"
    assert caught.value.detail == "this is a time"


@for_all("value", [True, None, [1], "fast", math.nan, math.inf, 1e15, 10**400, "1e308 km", "9" * 41])
def test_a_field_refuses_what_is_no_moderate_number(value: object) -> None:
    with pytest.raises(UnitError):
        to_si(value, units.SPEED)


def test_a_number_takes_no_unit() -> None:
    with pytest.raises(UnitError, match="must be a number, such as '2'"):
        to_si("30 %", units.NUMBER)


@for_all("dimension", DIMENSIONS.values())
def test_every_dimension_has_an_example_of_itself(dimension: Dimension) -> None:
    assert parse_quantity(example(dimension)).dimension == dimension
    assert to_si(example(dimension), dimension) > 0


@for_all(
    "text, unit, shown",
    [
        ("0.3 m/s", None, "0.3 m/s"),
        ("90 deg", None, "90 deg"),
        ("29 %", None, "29 %"),
        ("45 s", None, "45 s"),
        ("1 min", None, "60 s"),
        ("15 cm", "cm", "15 cm"),
        ("-0 m", None, "0 m"),
        ("1234567 m", None, "1234567 m"),
        ("0.1 s", "ms", "100 ms"),
        ("2", None, "2"),
    ],
)
def test_a_quantity_is_written_for_people(text: str, unit: str | None, shown: str) -> None:
    read = parse_quantity(text)
    assert format_quantity(read.value, read.dimension, unit) == shown


@pytest.mark.parametrize("unit", ["s", "furlong"])
def test_a_quantity_is_not_written_in_a_unit_of_something_else(unit: str) -> None:
    with pytest.raises(UnitError):
        format_quantity(1.0, units.LENGTH, unit)


@given(st.floats(-1e8, 1e8), st.sampled_from(sorted(UNITS)))
def test_what_is_written_reads_back_to_six_digits(number: float, unit: str) -> None:
    dimension = UNITS[unit].dimension
    value = UNITS[unit].to_si(number)
    text = format_quantity(value, dimension, unit)
    read = parse_quantity(text)
    assert read.dimension == dimension
    assert read.value == pytest.approx(value, rel=1e-5, abs=1e-300)
    assert format_quantity(read.value, dimension, unit) == text


@given(st.text())
def test_any_text_is_read_or_refused(text: str) -> None:
    try:
        value = parse_quantity(text).value
    except UnitError:
        return
    assert math.isfinite(value)


dimensions = st.sampled_from(sorted(DIMENSIONS.values(), key=lambda dimension: dimension.name))


@given(dimensions, dimensions)
def test_a_quotient_undoes_a_product(one: Dimension, other: Dimension) -> None:
    assert (one * other).is_comparable(other * one)
    assert (one * other / other).exponents == one.exponents


def test_products_and_quotients_have_the_names_of_the_field() -> None:
    assert units.LENGTH / units.TIME == units.SPEED
    assert units.VOLTAGE * units.CURRENT == units.POWER
    assert units.POWER * units.TIME == units.ENERGY
    assert units.TORQUE * units.ANGULAR_SPEED == units.POWER
    assert units.NUMBER / units.TIME == units.FREQUENCY
    assert (units.LENGTH * units.LENGTH).phrase == "a quantity in m^2"
    assert (units.NUMBER / units.LENGTH / units.ANGLE).name == "1/m/rad"


def test_a_ratio_is_no_bare_number_but_may_be_scaled_by_one() -> None:
    assert not units.RATIO.is_comparable(units.NUMBER)
    assert units.RATIO * units.NUMBER == units.NUMBER * units.RATIO == units.RATIO / units.NUMBER == units.RATIO
    assert units.RATIO * units.LENGTH == units.LENGTH


def test_the_quotient_of_like_things_is_compared_with_ratios_and_with_numbers() -> None:
    quotient = units.LENGTH / units.LENGTH
    assert quotient.is_comparable(units.RATIO)
    assert quotient.is_comparable(units.NUMBER)


def test_a_frequency_is_no_angular_speed_and_bytes_are_no_bits() -> None:
    assert not units.FREQUENCY.is_comparable(units.ANGULAR_SPEED)
    assert not (units.DATA / units.TIME).is_comparable(units.BIT_RATE)


@pytest.mark.parametrize(("written", "cure"), [("45 m", "if these are minutes, write '45 min'"), ("45 cm", "")])
def test_metres_for_a_time_may_be_minutes(written: str, cure: str) -> None:
    with pytest.raises(UnitError) as refused:
        to_si(written, units.TIME)
    assert refused.value.help == cure


@pytest.mark.parametrize(
    ("text", "wanted", "help_text"),
    [
        ("20 ms", units.FREQUENCY, "a period as a rate: write '50 Hz'"),
        ("2 Hz", units.TIME, "once every 0.5 s: write '0.5 s'"),
        ("1e-300 s", units.FREQUENCY, ""),
        ("0 s", units.FREQUENCY, ""),
    ],
)
def test_a_period_for_a_rate_is_turned_round_if_it_is_one(text: str, wanted: Dimension, help_text: str) -> None:
    with pytest.raises(UnitError) as error:
        to_si(text, wanted)
    assert error.value.help == help_text
