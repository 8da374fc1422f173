"""How a mission file becomes a flat program."""

from __future__ import annotations

from pathlib import Path

from rbxcompose.base.expressions.types import TYPES
from tests.missions.simulated import program_of

PATROL = Path(__file__).parents[2] / "missions" / "patrol.yaml"


def test_the_patrol_is_a_flat_tuple_of_nodes_in_the_order_of_the_text() -> None:
    program = program_of(PATROL.read_text(encoding="utf-8").replace("corner_3, corner_4", "kitchen"))
    assert [(node.number, node.path, node.children, node.end) for node in program.nodes] == [
        (0, "do.repeat", (1,), 3),
        (1, "do.repeat.for", (2,), 3),
        (2, "do.repeat.for.go_to", (), 3),
        (3, "interrupts.battery_low.sequence", (4, 5), 6),
        (4, "interrupts.battery_low.sequence.go_to.0", (), 5),
        (5, "interrupts.battery_low.sequence.recharge.1", (), 6),
    ]
    assert {
        name: (input_.type, input_.default and input_.default.value) for name, input_ in program.inputs.items()
    } == {"rounds": (TYPES["count"], 2.0), "low": (TYPES["ratio"], 0.5)}
    assert [interrupt.name for interrupt in program.interrupts] == ["battery_low"]
    assert program.reads == {"rounds", "corner", "battery", "low"}


def test_names_stand_in_paths_in_place_of_kind_and_index() -> None:
    program = program_of(
        "do:\n  - a\n  - repeat: 2\n    name: tour\n    do:\n      if: $door\n      then: a\n      else: b"
    )
    assert [node.path for node in program.nodes] == [
        "do.sequence",
        "do.sequence.a.0",
        "do.sequence.tour",
        "do.sequence.tour.if",
        "do.sequence.tour.if.then.a",
        "do.sequence.tour.if.else.b",
    ]


def test_a_word_a_list_and_a_mapping_are_nodes() -> None:
    program = program_of("do:\n  - a\n  - [b]\n  - go_to: dock")
    assert [node.step.word for node in program.nodes] == ["sequence", "a", "sequence", "b", "go_to"]


def test_data_keeps_its_values_in_si_with_their_types() -> None:
    program = program_of("data: {pause: 2 min, n: 3, open: true, room: dock, all: [1 cm, 2 cm]}\ndo: a")
    assert {name: datum.value for name, datum in program.data.items()} == {
        "pause": 120.0,
        "n": 3.0,
        "open": True,
        "room": "dock",
        "all": [0.01, 0.02],
    }
    assert program.data["pause"].type == TYPES["time"]
    assert program.data["all"].type.entry == TYPES["length"]
