"""Configurations as parameters: names, values, descriptions, and what a change takes and refuses."""

from __future__ import annotations

import math
import re
from enum import StrEnum
from typing import Annotated, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field, model_validator

from rbxcompose.base.config import Angle, Bound, Config, Live, Place, PlaceName, Ratio, Secret, Speed, Time
from rbxcompose.msgs.rcl_interfaces import Parameter, ParameterType, ParameterValue
from rbxcompose.sdk.parameters import (
    UnsettableError,
    changed,
    differences,
    dimension_in,
    from_message,
    listed,
    settings,
    shown,
    to_message,
    values_of,
)
from tests.loops import for_all


class Input(Config):
    """One of several."""

    priority: int
    timeout: Time


class Sample(Config):
    """All kinds of fields."""

    speed: Annotated[Speed, Live()] = Field(0.3, gt=0)
    """Largest speed."""
    heading: Annotated[Angle, Live()] = 0.5
    """Where it looks."""
    low: Annotated[Ratio, Live()] = Field(0.2, ge=0, le=1)
    """Below this it warns."""
    high: Annotated[Ratio, Live()] = Field(0.8, ge=0, le=1)
    """Above this it warns."""
    turns: Annotated[tuple[Angle, ...], Live()] = ()
    """Angles."""
    count: Annotated[int, Live()] = Field(3, ge=1, le=9)
    """How many."""
    mode: Annotated[Literal["calm", "wild"], Live()] = "calm"
    """How it moves."""
    fixed: float = 1.0
    """Set at the start."""
    inputs: dict[str, Input] = {}
    """By name."""
    nothing: Time | None = None
    """May be left out."""
    key: Secret | None = None
    """Not to be seen."""
    dock: PlaceName = Place("dock", 0.0, 0.0, 1.0)
    """Where it charges."""

    @model_validator(mode="after")
    def _in_order(self) -> Sample:
        if self.low > self.high:
            raise ValueError("'low' lies above 'high'")
        return self


SAMPLE = Sample(key=Secret("hush"), inputs={"door": Input(priority=7, timeout=0.5)})


def parameter(name: str, value: object) -> Parameter:
    message = to_message(value)
    assert message is not None
    return Parameter(name=name, value=message)


def set_to(name: str, value: object) -> Sample:
    new = changed(SAMPLE, [parameter(name, value)])
    assert isinstance(new, Sample)
    return new


def test_fields_and_what_lies_below_them_are_parameters_but_no_secret_and_no_place() -> None:
    names = "speed heading low high turns count mode fixed inputs.door.priority inputs.door.timeout nothing"
    assert list(settings(SAMPLE)) == names.split()


def test_what_is_unknown_has_no_value() -> None:
    values = values_of(settings(SAMPLE), ["count", "no", "nothing"])
    assert [(value.type, from_message(value)) for value in values] == [
        (ParameterType.PARAMETER_INTEGER, 3),
        (0, None),
        (0, None),
    ]


def test_a_descriptor_tells_unit_range_and_whether_it_may_change() -> None:
    known = settings(SAMPLE)
    speed, count, mode = (known[name].descriptor for name in ("speed", "count", "mode"))
    assert (speed.description, speed.read_only) == ("Largest speed. [m/s]", False)
    assert speed.additional_constraints == "greater than 0 m/s"
    assert [(one.from_value, one.to_value) for one in speed.floating_point_range] == [
        (math.nextafter(0.0, 1.0), math.inf)
    ]
    assert [(one.from_value, one.to_value) for one in count.integer_range] == [(1, 9)]
    assert mode.additional_constraints == "one of calm, wild"
    assert known["fixed"].descriptor.read_only
    assert known["inputs.door.priority"].descriptor.read_only


@for_all(
    "name, value, expected",
    [
        ("speed", 0.5, 0.5),
        ("speed", 1, 1.0),
        ("speed", "20 cm/s", 0.2),
        ("heading", 1.25, 1.25),
        ("heading", "90 deg", math.pi / 2),
        ("low", "40 %", 0.4),
        ("turns", (0.5, 1.5), (0.5, 1.5)),
        ("count", 4, 4),
        ("mode", "wild", "wild"),
    ],
)
def test_a_change_takes_si_and_text_with_units(name: str, value: object, expected: object) -> None:
    new = set_to(name, value)
    assert getattr(new, name) == pytest.approx(expected) if name != "mode" else getattr(new, name) == expected
    assert [difference.name for difference in differences(SAMPLE, new)] == [name]


@for_all(
    "name, value, reason",
    [
        ("sped", 0.5, "there is no parameter 'sped'; did you mean 'speed'?"),
        ("fixed", 2.0, "'fixed' cannot change while the robot runs"),
        ("inputs.door.priority", 2, "'inputs.door.priority' cannot change while the robot runs"),
        ("speed", 0.0, "'speed' must be greater than 0"),
        ("speed", "3 s", "'speed' must be a speed, such as '0.3 m/s'; this is a time"),
        ("speed", True, "'speed' must be a speed, such as '0.3 m/s'"),
        ("count", 2.5, "'count' must be a valid integer"),
        ("count", 10, "'count' must be less than or equal to 9"),
        ("mode", "mad", "'mode' must be 'calm' or 'wild'"),
        ("low", 0.9, "'low' lies above 'high'"),
        ("speed", None, "'speed' needs a value"),
    ],
)
def test_what_does_not_fit_is_refused_with_the_reason(name: str, value: object, reason: str) -> None:
    with pytest.raises(UnsettableError) as refused:
        set_to(name, value)
    assert str(refused.value) == reason


def test_parameters_that_fit_only_together_are_set_together() -> None:
    new = changed(SAMPLE, [parameter("low", 0.9), parameter("high", 0.95)])
    assert isinstance(new, Sample)
    assert (new.low, new.high, new.key, new.dock) == (0.9, 0.95, SAMPLE.key, SAMPLE.dock)


def test_names_are_listed_by_prefix_and_depth() -> None:
    names = ["a", "b.c", "b.d.e", "bc.f"]
    assert listed(names, [], 0).names == tuple(names)
    assert listed(names, [], 0).prefixes == ("b", "b.d", "bc")
    assert listed(names, [], 1).names == ("a",)
    assert listed(names, ["b"], 0).names == ("b.c", "b.d.e")
    assert listed(names, ["b"], 1).names == ("b.c",)
    assert listed(names, ["a", "bc"], 0).names == ("a", "bc.f")
    assert listed(names, ["x"], 0).names == ()


WHOLE = st.integers(-(2**63), 2**63 - 1)
NUMBERS = st.floats(allow_nan=False)
VALUES = st.one_of(
    st.booleans(),
    WHOLE,
    NUMBERS,
    st.text(),
    *(st.lists(one, min_size=1).map(tuple) for one in (st.booleans(), WHOLE, NUMBERS, st.text())),
)


@given(VALUES)
def test_a_value_comes_back_from_its_message(value: object) -> None:
    message = to_message(value)
    assert message is not None
    assert from_message(message) == value


@given(st.builds(ParameterValue, type=st.integers(0, 255)))
def test_a_message_of_any_type_but_of_no_speed_is_refused(message: ParameterValue) -> None:
    with pytest.raises(UnsettableError, match="'speed' "):
        changed(SAMPLE, [Parameter(name="speed", value=message)])


def test_a_bound_beside_the_field_holds_and_is_told() -> None:
    bounds = {"speed": [Bound(0.1, 0.4, "an argument")]}
    (told,) = settings(SAMPLE, bounds)["speed"].descriptor.floating_point_range
    assert (told.from_value, told.to_value) == (0.1, 0.4)
    assert changed(SAMPLE, [parameter("speed", 0.4)], bounds) != SAMPLE
    for value, words in ((0.05, "at least 0.1 m/s"), (0.41, "at most 0.4 m/s")):
        with pytest.raises(UnsettableError, match=f"'speed' must be {words}: an argument says so"):
            changed(SAMPLE, [parameter("speed", value)], bounds)


def test_values_are_shown_in_the_unit_that_their_description_tells() -> None:
    known = settings(SAMPLE)
    found = {
        name: shown(setting.value, dimension_in(setting.descriptor.description)) for name, setting in known.items()
    }
    assert found["heading"] == "0.5 rad"
    assert (found["speed"], found["low"], found["count"], found["mode"]) == ("0.3 m/s", "20 %", "3", "calm")
    assert (found["inputs.door.timeout"], found["nothing"], found["turns"]) == ("0.5 s", "-", "[]")


@pytest.mark.parametrize("description", ["", "[", "]", "speed", "of [its] kind", "a list [x]"])
def test_other_descriptions_tell_no_unit(description: str) -> None:
    assert dimension_in(description) is None


class Shade(StrEnum):
    """What a lamp may be."""

    WARM = "warm"
    COLD = "cold"


class Lamp(Config):
    """Steps, open bounds and choices."""

    power: Annotated[Ratio, Live()] = Field(0.5, gt=0, lt=1, multiple_of=0.25)
    """How bright it is."""
    blinks: Annotated[int, Live()] = Field(2, gt=0, lt=10, multiple_of=2)
    """How often it blinks."""
    shade: Annotated[Shade, Live()] = Shade.WARM
    """Which white it has."""


def test_the_wire_has_steps_and_no_bound_that_a_value_may_not_have() -> None:
    power, blinks, shade = (setting.descriptor for setting in settings(Lamp()).values())
    ((low, high, step),) = [(one.from_value, one.to_value, one.step) for one in power.floating_point_range]
    assert (low, high, step) == (math.nextafter(0.0, 1.0), math.nextafter(1.0, 0.0), 0.25)
    assert [(one.from_value, one.to_value, one.step) for one in blinks.integer_range] == [(1, 9, 2)]
    assert power.additional_constraints == "greater than 0 %, less than 100 %, in steps of 25 %"
    assert shade.additional_constraints == "one of warm, cold"


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("power", 0.3, "'power' must be a multiple of 0.25"),
        ("power", 1.0, "'power' must be less than 1"),
        ("blinks", 3, "'blinks' must be a multiple of 2"),
        ("shade", "green", "'shade' must be one of warm, cold"),
    ],
)
def test_steps_and_choices_are_enforced(name: str, value: object, reason: str) -> None:
    with pytest.raises(UnsettableError, match=re.escape(reason)):
        changed(Lamp(), [parameter(name, value)])


def test_a_choice_is_set_by_its_word() -> None:
    assert changed(Lamp(), [parameter("shade", "cold")]) == Lamp(shade=Shade.COLD)
