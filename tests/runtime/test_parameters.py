"""Parameters over the bus: what the six services of a component answer, and what a change does to it."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import pytest
from pydantic import Field, model_validator

from rbxcompose.base.units import ANGLE, Quantity
from rbxcompose.msgs import rcl_interfaces as rcl
from rbxcompose.msgs.rbxcompose_parameters import ChangeParameters
from rbxcompose.msgs.types import Message, Service
from rbxcompose.sdk import Angle, Component, Config, Live, Refused, component
from rbxcompose.sdk.bound import Reply
from rbxcompose.sdk.parameters import to_message
from rbxcompose.testing import Bench, instance


class Gains(Config):
    """What a group of settings has."""

    p: Annotated[float, Live()] = Field(1.0, ge=0, le=5)
    """How strongly."""
    lean: Annotated[Angle, Live()] = 0.5
    """How far."""
    way: Annotated[Literal["up", "down"], Live()] = "up"
    fixed: int = 3

    @model_validator(mode="after")
    def _fits(self) -> Gains:
        if self.way == "down" and self.p > 4.0:
            raise ValueError("this falls over")
        return self


class ToyConfig(Config):
    """What can be set."""

    size: Annotated[float, Live()] = 1.0
    """How large it is."""
    weight: Annotated[float, Live()] = 1.0
    """How heavy it is."""
    name: str = "toy"
    """What it is called."""
    gains: Gains = Gains()


@component("toy_for_parameters")
class Toy(Component[ToyConfig]):
    """Takes what it is told, unless it is too large."""

    rate = 10.0

    def configure(self) -> None:
        self.followed: list[tuple[float, float]] = []

    def reconfigure(self, old: ToyConfig) -> None:
        if self.config.size > 10.0:
            raise Refused("there is no room")
        if self.config.size < 0.0:
            raise ValueError("planted")
        self.followed.append((old.size, self.config.size))

    def step(self, dt: float) -> None:
        if self.config.size == 7.0 and self.now < 1.0:
            raise ValueError("planted, too")


PLANTED = "'toy' has failed: ValueError: planted"


def ask(bench: Bench, what: str, service: type[Service[Any, Any]], request: Message) -> Any:
    replies: list[Reply[Any]] = []
    bench.bus.client("bench", what, service)(request, replies.append)
    bench.advance(0.0)
    return replies[0].response or replies[0].error


def set_each(bench: Bench, **values: object) -> list[tuple[bool, str]]:
    request = rcl.SetParameters.Request(parameters=tuple(_parameter(*one) for one in values.items()))
    answer = ask(bench, "toy/set_parameters", rcl.SetParameters, request)
    return [(result.successful, result.reason) for result in answer.results]


def _parameter(name: str, value: object) -> rcl.Parameter:
    return rcl.Parameter(name=name, value=to_message(value) or rcl.ParameterValue())


@pytest.fixture
def bench() -> Bench:
    return Bench(instance("toy", "toy_for_parameters"), instance("other", "toy_for_parameters"))


def test_a_component_tells_its_parameters(bench: Bench) -> None:
    listed = ask(bench, "/toy/list_parameters", rcl.ListParameters, rcl.ListParameters.Request())
    assert listed.result.names == (*("size", "weight", "name"), *("gains.p", "gains.lean", "gains.way", "gains.fixed"))
    names = ("name", "size", "nothing")
    values = ask(bench, "/toy/get_parameters", rcl.GetParameters, rcl.GetParameters.Request(names=names)).values
    assert (values[0].string_value, values[1].double_value, values[2].type) == ("toy", 1.0, 0)
    types = ask(bench, "/toy/get_parameter_types", rcl.GetParameterTypes, rcl.GetParameterTypes.Request(names=names))
    assert types.types == bytes([4, 3, 0])
    request = rcl.DescribeParameters.Request(names=names)
    told = ask(bench, "/toy/describe_parameters", rcl.DescribeParameters, request).descriptors
    assert [(descriptor.name, descriptor.read_only, descriptor.description) for descriptor in told] == [
        ("name", True, "What it is called."),
        ("size", False, "How large it is."),
        ("nothing", False, ""),
    ]


def test_a_change_reaches_the_component_the_log_and_who_listens(bench: Bench) -> None:
    events = bench.collect("/parameter_events", rcl.ParameterEvent)
    assert set_each(bench, size=2.0) == [(True, "")]
    toy: Any = bench.component("toy")
    assert (toy.followed, toy.config.size) == ([(1.0, 2.0)], 2.0)
    assert "toy: set: size = 2.0" in bench.texts()
    changed = events[0].changed_parameters
    assert (events[0].node, [(parameter.name, parameter.value.double_value) for parameter in changed]) == (
        "/toy",
        [("size", 2.0)],
    )
    assert bench.component("other").config.size == 1.0


def test_each_parameter_of_a_list_is_set_for_itself(bench: Bench) -> None:
    answers = set_each(bench, size=11.0, weight=3.0, name="x")
    assert answers == [(False, "there is no room"), (True, ""), (False, "'name' cannot change while the robot runs")]
    assert (bench.component("toy").config.size, bench.component("toy").config.weight) == (1.0, 3.0)


def test_of_an_atomic_list_all_are_set_or_none(bench: Bench) -> None:
    request = rcl.SetParametersAtomically.Request(parameters=(_parameter("weight", 3.0), _parameter("name", "x")))
    answer = ask(bench, "toy/set_parameters_atomically", rcl.SetParametersAtomically, request)
    assert (answer.result.successful, bench.component("toy").config.weight) == (False, 1.0)
    request = rcl.SetParametersAtomically.Request(parameters=(_parameter("weight", 3.0), _parameter("size", 4.0)))
    assert ask(bench, "toy/set_parameters_atomically", rcl.SetParametersAtomically, request).result.successful
    assert (bench.component("toy").config.size, bench.component("toy").config.weight) == (4.0, 3.0)


def test_what_stays_as_it_is_is_no_event(bench: Bench) -> None:
    events = bench.collect("/parameter_events", rcl.ParameterEvent)
    assert set_each(bench, size=1.0) == [(True, "")]
    assert events == []


def test_a_component_that_is_restarted_keeps_what_was_set(bench: Bench) -> None:
    set_each(bench, size=7.0)
    bench.advance(3.0)
    assert bench.host.states()["toy"][0] == "active"
    assert bench.host.states()["toy"][1] > 0
    assert bench.component("toy").config.size == 7.0


def test_a_component_that_breaks_by_a_change_comes_back_without_it(bench: Bench) -> None:
    request = rcl.SetParameters.Request(parameters=(_parameter("size", -1.0),))
    assert ask(bench, "toy/set_parameters", rcl.SetParameters, request).results[0].reason == PLANTED
    bench.advance(1.0)
    assert bench.host.states()["toy"] == ("active", 1)
    assert bench.component("toy").config.size == 1.0


def change(bench: Bench, expected: float, wanted: float, **fields: Any) -> ChangeParameters.Response:
    request = ChangeParameters.Request(
        parameters=(_parameter("size", wanted),), expected=(_parameter("size", expected),), **fields
    )
    answer: ChangeParameters.Response = ask(bench, "toy/change_parameters", ChangeParameters, request)
    return answer


def test_a_change_knows_what_was_there_and_who_asked(bench: Bench) -> None:
    assert change(bench, 1.0, 2.0, by="somebody", together="abc").success
    assert set_each(bench, size=3.0) == [(True, "")]
    late = change(bench, 2.0, 4.0, tell_changes=True)
    assert (late.success, late.message) == (False, "'size' was changed meanwhile by a ROS 2 tool (toy:2)")
    told = [(one.number, one.before.double_value, one.after.double_value, one.by) for one in late.changes]
    assert told == [(1, 1.0, 2.0, "somebody"), (2, 2.0, 3.0, "a ROS 2 tool")]
    assert "toy: set: size = 2.0, by somebody" in bench.texts()


def test_the_history_outlives_a_restart_of_the_component(bench: Bench) -> None:
    set_each(bench, size=7.0)
    bench.advance(3.0)
    told = ask(bench, "toy/change_parameters", ChangeParameters, ChangeParameters.Request(tell_changes=True))
    assert [one.number for one in told.changes] == [1]


@pytest.mark.parametrize("value", [float("nan"), float("inf"), "text", True, (1.0, 2.0)])
def test_what_no_number_may_be_is_refused_and_changes_nothing(bench: Bench, value: object) -> None:
    ((successful, reason),) = set_each(bench, size=value)
    assert (successful, bool(reason), bench.component("toy").config.size) == (False, True, 1.0)


def test_a_setting_in_a_group_is_set_by_its_dotted_name(bench: Bench) -> None:
    events = bench.collect("/parameter_events", rcl.ParameterEvent)
    assert set_each(bench, **{"gains.p": 2, "gains.lean": "90 deg", "gains.way": "down"}) == [(True, "")] * 3
    config = bench.component("toy").config
    assert (config.gains, config.size) == (Gains(p=2.0, lean=Quantity(math.pi / 2, ANGLE), way="down"), 1.0)
    assert [event.changed_parameters[0].name for event in events] == ["gains.p", "gains.lean", "gains.way"]


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("gains.p", 6.0, "'gains.p' must be less than or equal to 5"),
        ("gains.p", "fast", "'gains.p' must be a valid number"),
        ("gains.lean", "3 m", "'gains.lean' must be an angle, such as '90 deg'"),
        ("gains.way", "left", "'gains.way' must be 'up' or 'down'"),
        ("gains.fixed", 4, "'gains.fixed' cannot change while the robot runs"),
        ("gains", "x", "there is no parameter 'gains'"),
        ("gains.q", 1.0, "there is no parameter 'gains.q'; did you mean 'gains.p'?"),
    ],
)
def test_a_setting_in_a_group_keeps_its_limits(bench: Bench, name: str, value: object, reason: str) -> None:
    ((is_set, told),) = set_each(bench, **{name: value})
    assert (is_set, told.startswith(reason), bench.component("toy").config.gains) == (False, True, Gains()), told


def test_settings_of_a_group_that_do_not_fit_together_are_refused_together(bench: Bench) -> None:
    parameters = (_parameter("gains.p", 4.5), _parameter("gains.way", "down"))
    request = rcl.SetParametersAtomically.Request(parameters=parameters)
    answer = ask(bench, "toy/set_parameters_atomically", rcl.SetParametersAtomically, request)
    assert (answer.result.reason, bench.component("toy").config.gains) == ("'gains' this falls over", Gains())


def test_a_parameter_that_is_set_twice_in_one_list_is_refused(bench: Bench) -> None:
    request = rcl.SetParametersAtomically.Request(parameters=(_parameter("size", 2.0), _parameter("size", 3.0)))
    answer = ask(bench, "toy/set_parameters_atomically", rcl.SetParametersAtomically, request)
    assert (answer.result.reason, bench.component("toy").config.size) == ("'size' is set twice", 1.0)
