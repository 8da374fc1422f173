"""How values are written for people."""

from __future__ import annotations

from rbxcompose.base.config import Place
from rbxcompose.base.expressions.types import TYPES
from rbxcompose.base.expressions.values import NOT_ARRIVED, Value
from rbxcompose.missions.engine.world import show, show_briefly
from tests.loops import for_all
from tests.missions.simulated import simulate


@for_all(
    "type_name, value, whole, brief",
    [
        ("ratio", 0.488889, "48.8889 %", "48.9 %"),
        ("time", 12345.6, "12345.6 s", "12346 s"),
        ("speed", 0.0, "0 m/s", "0 m/s"),
        ("count", 2.0, "2", "2"),
        ("text", "living_room", "living_room", "living_room"),
        ("place", Place("living_room", 0.0, 0.0, 0.0), "living room", "living room"),
        ("flag", True, "true", "true"),
        ("ratio", -1e308, "-inf %", "-inf %"),
        ("place", None, "None", "None"),  # nothing that a mission knows
        ("place", NOT_ARRIVED, "nothing yet", "nothing yet"),
    ],
)
def test_values_have_the_unit_of_their_type(type_name: str, value: Value, whole: str, brief: str) -> None:
    assert show(TYPES[type_name], value) == whole
    assert show_briefly(TYPES[type_name], value) == brief


def test_items_and_entries_in_a_text_have_the_unit_of_their_type() -> None:
    simulated = simulate(
        "data: {ways: [5 m, 3 s], rooms: {dock: {level: 20 %}}, room: dock}\n"
        'do: {log: \'$ways[1], $rooms[dock].level, $rooms["dock"].level, $rooms[$room]["level"], $ways [1]\'}'
    )
    assert simulated.advance(1.0) == "success"
    assert simulated.told[0] == "0 3 s, 20 %, 20 %, 20 %, 5 m, 3 s [1]"
