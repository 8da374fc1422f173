"""Stretches of memory: each item is where it belongs, and nothing else is written."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.servos.models import ServoModel, servo_models
from rbxcompose.domains.servos.transfers import Stretch, read_plan, write_plans

MODELS = list(servo_models().values())
ASKED = st.sampled_from(MODELS).flatmap(
    lambda model: st.tuples(st.just(model), st.sets(st.sampled_from(sorted(model.items)), min_size=1))
)


@given(ASKED, st.binary(min_size=1024, max_size=1024))
def test_what_is_planned_reads_just_what_memory_holds(asked: tuple[ServoModel, set[str]], memory: bytes) -> None:
    model, names = asked
    plan = read_plan(model, names)
    parts = [memory[one.address : one.end] for one in plan.stretches]
    items = {name: model.items[name] for name in names}
    expected = {name: item.decode(memory[item.address : item.end]) for name, item in items.items()}
    assert plan.values(parts, 0) == expected
    for stretch, other in pairwise(plan.stretches):
        assert other.address - stretch.end > 12


@given(ASKED, st.data())
def test_what_is_written_covers_the_items_and_nothing_else(
    asked: tuple[ServoModel, set[str]], data: st.DataObject
) -> None:
    model, names = asked
    names -= {"goal_velocity"} if "goal_speed" in names else set()  # which may be the same bytes
    values = {name: data.draw(st.integers(model.items[name].least, model.items[name].most)) for name in sorted(names)}
    memory: dict[int, int] = {}
    for plan in write_plans(model, values):
        part = plan.data(values)
        assert len(part) == plan.stretch.length
        memory |= dict(enumerate(part, plan.stretch.address))
    assert len(memory) == sum(model.items[name].size for name in names)
    for name, raw in values.items():
        item = model.items[name]
        assert item.decode(bytes(memory[address] for address in range(item.address, item.end))) == raw


@pytest.mark.parametrize(
    ("name", "stretches"),
    [("AX-12", [(36, 6)]), ("XL430-W250", [(126, 10)]), ("PH54-200", [(574, 10)]), ("XL-320", [(37, 6)])],
)
def test_position_speed_and_load_are_one_stretch(name: str, stretches: list[tuple[int, int]]) -> None:
    plan = read_plan(servo_models()[name], ("present_position", "present_speed", "present_load"))
    assert list(plan.stretches) == stretches
    assert Stretch(3, 4).end == 7


def test_faults_of_protocol_1_come_with_any_reply() -> None:
    plan = read_plan(servo_models()["AX-12"], ("hardware_error",))
    assert plan.values([b"\0"], 4 | 2) == {"hardware_error": 4}


def test_an_item_that_a_model_lacks_is_refused() -> None:
    with pytest.raises(KeyError, match="AX-12 has no item 'bus_watchdog'"):
        read_plan(servo_models()["AX-12"], ("bus_watchdog",))


def test_two_meanings_of_one_memory_cannot_be_written_together() -> None:
    with pytest.raises(ValueError, match="are the same memory"):
        write_plans(servo_models()["AX-12"], ["goal_velocity", "led", "goal_speed"])
