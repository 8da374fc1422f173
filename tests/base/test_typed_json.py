"""Dataclasses as plain data: what is written comes back, what does not fit is refused with its place."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.requests import Family, UnreadableError, from_data, to_data
from tests.loops import for_all


class Colour(StrEnum):
    RED = "red"
    BLUE = "blue"


@dataclass(frozen=True, slots=True)
class Lamp:
    name: str
    colour: Colour = Colour.RED
    levels: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Room:
    lamps: Sequence[Lamp]
    floor: int
    sizes: tuple[float, float]
    is_lit: bool = False
    owner: str | None = None
    marks: Mapping[str, Lamp] = field(default_factory=dict)


LAMPS = st.builds(Lamp, st.text(), st.sampled_from(Colour), st.lists(st.floats(-1e9, 1e9)).map(tuple))
ROOMS = st.builds(
    Room,
    st.lists(LAMPS, max_size=3).map(tuple),
    st.integers(),
    st.tuples(st.floats(0, 1), st.floats(0, 1)),
    st.booleans(),
    st.none() | st.text(),
    st.dictionaries(st.text(), LAMPS, max_size=2),
)


@given(ROOMS)
def test_what_is_written_comes_back_as_it_was(room: Room) -> None:
    assert from_data(Room, json.loads(json.dumps(to_data(room)))) == room


GOOD = {"lamps": [{"name": "a"}], "floor": 1, "sizes": [1, 2.5]}


@for_all(
    "changes, problem",
    [
        ({"floor": "1"}, "'floor' is not a whole number"),
        ({"floor": True}, "'floor' is not a whole number"),
        ({"lamps": {}}, "'lamps' is not a list"),
        ({"lamps": "abc"}, "'lamps' is not a list"),
        ({"lamps": [{}]}, "'lamps.0.name' is missing"),
        ({"lamps": [{"name": "a", "colour": "green"}]}, "'lamps.0.colour' is not one of red, blue"),
        ({"lamps": ["a"]}, "'lamps.0' is not an object"),
        ({"sizes": [1]}, "'sizes' is not a list of 2"),
        ({"sizes": [1, "2"]}, "'sizes.1' is not a number"),
        ({"is_lit": 1}, "'is_lit' is neither true nor false"),
        ({"owner": 5}, "'owner' is not null"),
        ({"marks": {"x": {"name": None}}}, "'marks.x.name' is not text"),
        ({"height": 2}, "'height' is not known here"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_place(changes: dict[str, object], problem: str) -> None:
    assert isinstance(from_data(Room, GOOD), Room)
    with pytest.raises(UnreadableError) as caught:
        from_data(Room, {**GOOD, **changes})
    assert str(caught.value) == problem


@for_all("data", [None, 5, [], {}, {"type": 5}, {"type": []}, {"type": "Chair"}, {"type": "__class__"}])
def test_a_family_takes_its_own_types_alone(data: object) -> None:
    family: Family[Lamp | Room] = Family((Lamp, Room))
    assert family.from_line(family.to_line(Lamp("a"))) == Lamp("a")
    with pytest.raises(UnreadableError, match="is not known here"):
        family.from_data(data)
