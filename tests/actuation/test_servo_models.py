"""Control tables and models: what the e-manual says, and conversions that lose nothing."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.servos.models import (
    Coding,
    ControlItem,
    ServoModel,
    hardware_errors,
    model_named,
    model_of_number,
    servo_models,
)
from tests.loops import for_all

MODELS = list(servo_models().values())
NAMED = for_all("model", MODELS)
EVERYWHERE = {
    *("model_number", "id", "baud", "return_delay", "torque_enable", "led", "goal_position", "goal_speed"),
    *("goal_velocity", "present_position", "present_speed", "present_load", "present_voltage"),
    *("present_temperature", "moving", "temperature_limit", "min_position", "max_position", "shutdown"),
}
ITEMS = st.sampled_from([item for model in MODELS for item in model.items.values()])


@NAMED
def test_a_model_is_found_by_its_number_and_its_name(model: ServoModel) -> None:
    assert model_of_number(model.number) is model
    assert model_named(model.name) is model
    assert model_named(model.name.lower().replace("-", "")) is model


def test_revisions_of_a_model_are_that_model() -> None:
    assert model_named("ax-12a") is model_named("AX-12+") is servo_models()["AX-12"]
    assert model_named("EX-106") is servo_models()["EX-106+"]
    assert model_named("nonsense") is None
    assert model_of_number(9999) is None


@NAMED
def test_a_table_has_what_every_servo_has_and_what_its_protocol_brings(model: ServoModel) -> None:
    assert model.items.keys() >= EVERYWHERE
    brings = {"operating_mode", "hardware_error"}
    assert brings & model.items.keys() == (brings if model.protocol == 2 else set())
    assert ("lock" in model.items) == (model.protocol == 1)
    assert ("bus_watchdog" in model.items) == (model.protocol == 2 and model.name != "XL-320")


@NAMED
def test_items_do_not_overlap_but_for_the_two_meanings_of_one_speed(model: ServoModel) -> None:
    ordered = sorted(model.items.values(), key=lambda item: item.address)
    for control_item, other in pairwise(ordered):
        assert control_item.end <= other.address or {control_item.name, other.name} == {"goal_speed", "goal_velocity"}


@NAMED
def test_every_tick_becomes_an_angle_and_the_same_tick_again(model: ServoModel) -> None:
    item, ticks = model.items["present_position"], model.family.ticks
    step = 1 if ticks <= 4096 else 37
    every = range(item.centre - ticks // 2, item.centre + ticks // 2 + 1, step)
    assert [item.to_raw(item.to_si(tick)) for tick in every] == list(every)


@NAMED
def test_zero_is_the_middle_of_the_range(model: ServoModel) -> None:
    half, item = model.family.ticks // 2, model.items["goal_position"]
    assert model.to_si("goal_position", item.centre) == 0.0
    assert model.to_si("goal_position", item.centre + half) == pytest.approx(model.family.span / 2, rel=1e-12)
    assert model.to_raw("goal_position", model.per_tick * 100) == item.centre + 100


@for_all(
    "name, item, raw, value",
    [
        ("AX-12", "present_position", 1023, math.radians(150 - 300 / 1024)),
        ("AX-12", "goal_speed", 1023, 113.553 * math.tau / 60),
        ("AX-12", "present_voltage", 120, 12.0),
        ("AX-12", "return_delay", 250, 0.0005),
        ("EX-106+", "present_position", 4095, math.radians(125.46 - 250.92 / 4096)),
        ("MX-28", "present_position", 3072, math.pi / 2),
        ("MX-28", "goal_speed", 100, 11.4 * math.tau / 60),
        ("XL-320", "present_position", 0, math.radians(-150)),
        ("XL430-W250", "goal_speed", 1, 0.02398),
        ("XL430-W250", "profile_acceleration", 1, 0.3745),
        ("XL430-W250", "present_load", -1000, -1.0),
        ("XM430-W350", "present_load", 100, 0.269),
        ("XL330-M288", "present_load", -100, -0.1),
        ("XL430-W250", "bus_watchdog", 10, 0.2),
        ("PH54-200", "present_position", 501923, math.pi),
        ("PH54-200", "present_position", 1, 6.259e-6),
        ("PM42-010", "goal_speed", 6000, 60 * math.tau / 60),
        ("PM42-010", "present_temperature", 41, 41.0),
    ],
)
def test_raw_values_have_their_meaning(name: str, item: str, raw: int, value: float) -> None:
    assert servo_models()[name].to_si(item, raw) == pytest.approx(value, rel=1e-3)


@given(st.data(), ITEMS)
def test_bytes_of_a_raw_value_give_the_raw_value(data: st.DataObject, item: ControlItem) -> None:
    raw = data.draw(st.integers(item.least, item.most))
    written = item.encode(raw)
    assert len(written) == item.size
    assert item.decode(written) == raw
    assert item.to_raw(item.to_si(raw)) == raw


@given(ITEMS, st.integers(1, 1000))
def test_what_does_not_fit_is_refused(item: ControlItem, beyond: int) -> None:
    for raw in (item.most + beyond, item.least - beyond):
        with pytest.raises(ValueError, match=f"{item.name} must be {item.least} to {item.most}"):
            item.encode(raw)


def test_a_direction_is_bit_10() -> None:
    item = ControlItem("present_speed", 38, 2, Coding.DIRECTION)
    assert item.decode(bytes([5, 4])) == -5
    assert item.encode(-5) == bytes([5, 4])
    assert item.decode(bytes([0, 4])) == 0


@NAMED
def test_baud_rates_have_codes(model: ServoModel) -> None:
    for baud in (57_600, 115_200, 1_000_000):
        code = model.code_of(baud)
        assert code is not None
        assert model.baud_of(code) == pytest.approx(baud, rel=0.03)
    assert model.code_of(1_234_567) is None


def test_codes_of_baud_rates_are_those_of_the_protocols() -> None:
    assert servo_models()["AX-12"].code_of(1_000_000) == 1
    assert servo_models()["MX-28"].code_of(57_600) == 34
    assert servo_models()["XL430-W250"].code_of(4_500_000) == 7
    assert servo_models()["MX-28"].code_of(3_000_000) == 252
    assert servo_models()["XL-320"].code_of(2_000_000) is None
    assert servo_models()["AX-12"].code_of(2_000_000) is None


def test_an_item_that_a_model_lacks_is_told_with_a_similar_one() -> None:
    with pytest.raises(KeyError, match="AX-12 has no item 'present_positon'; did you mean 'present_position'"):
        servo_models()["AX-12"].item("present_positon")


def test_hardware_errors_have_names() -> None:
    assert hardware_errors(0) == ()
    assert hardware_errors(4 | 32) == ("overheated", "overload")
