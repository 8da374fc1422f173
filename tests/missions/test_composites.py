"""What the kinds do with the nodes below them, in virtual time."""

from __future__ import annotations

from dataclasses import replace

import pytest

from rbxcompose.base.expressions.types import FLAG, choice_of, quantity_of
from rbxcompose.base.units import LENGTH
from rbxcompose.missions.engine.events import SkillStarted
from rbxcompose.missions.program.program import Skill
from tests.missions.simulated import ROBOT, SKILLS, Simulated, program_of, simulate


def fails(*calls: int) -> frozenset[int]:
    return frozenset(calls)


def skills(simulated: Simulated) -> list[str]:
    """Return the times and names of the skills that were started."""
    lines = zip(simulated.events, simulated.told, strict=True)
    return [line for (_, event), line in lines if isinstance(event, SkillStarted)]


def test_a_sequence_does_its_nodes_in_order_without_a_gap() -> None:
    simulated = simulate("do: [a, b, c]")
    assert simulated.advance(10) == "success"
    assert skills(simulated) == ["0 a", "1 b", "2 c"]


def test_a_sequence_fails_with_the_first_failure_and_says_which_it_was() -> None:
    simulated = simulate("do: [a, b, c]", fails={"b": fails(1)})
    assert simulated.advance(10) == "failure"
    assert simulated.told[-1] == "2 mission test: failure: mission.yaml:1: no luck"
    assert "c" not in simulated.calls


def test_a_fallback_goes_on_after_a_failure_and_ends_with_the_first_success() -> None:
    simulated = simulate("do: {fallback: [a, b, c]}", fails={"a": fails(1)})
    assert simulated.advance(10) == "success"
    assert skills(simulated) == ["0 a", "1 b"]


def test_a_fallback_fails_when_all_have_failed() -> None:
    simulated = simulate("do: {fallback: [a, b]}", fails={"a": fails(1), "b": fails(1)})
    assert simulated.advance(10) == "failure"


def test_a_fallback_passes_over_what_was_skipped() -> None:
    text = """
    do:
      fallback:
        - a:
          only_if: 1 > 2
        - b
    """
    assert simulate(text).advance(10) == "success"
    assert simulate(text, fails={"b": fails(1)}).advance(10) == "failure"


@pytest.mark.parametrize(
    "node",
    [
        "repeat: 0\n  do: a",
        "for: x\n  in: []\n  do: a",
        "if: 1 > 2\n  then: a",
        "sequence:\n    - a:\n      only_if: 1 > 2",
        "fallback:\n    - a:\n      only_if: 1 > 2",
        "repeat: 2\n  do:\n    a:\n    only_if: 1 > 2",
        "for: x\n  in: [1, 2]\n  do:\n    a:\n    only_if: 1 > 2",
    ],
)
def test_what_has_nothing_to_do_is_skipped_and_a_skipped_mission_succeeds(node: str) -> None:
    simulated = simulate(f"do:\n  {node}")
    assert simulated.advance(10) == "success"
    assert simulated.calls == {}
    assert simulated.engine.statuses[0] == 4


def test_a_condition_chooses_between_then_and_else() -> None:
    text = "do:\n  if: $door\n  then: a\n  else: b"
    for is_open, chosen in ((True, "0 a"), (False, "0 b")):
        simulated = simulate(text)
        simulated.set("door", is_open)
        assert simulated.advance(10) == "success"
        assert skills(simulated) == [chosen]


def test_a_condition_whose_value_has_not_arrived_does_not_hold_even_under_not() -> None:
    simulated = simulate("do:\n  if: not $door\n  then: a\n  else: b")
    simulated.advance(10)
    assert skills(simulated) == ["0 b"]


def test_repeat_does_its_rounds_and_reads_their_number_at_the_start() -> None:
    simulated = simulate("data: {n: 3}\ndo:\n  repeat: $n\n  do:\n    - a\n    - set:\n        n: 1")
    assert simulated.advance(10) == "success"
    assert skills(simulated) == ["0 a", "1 a", "2 a"]


def test_a_failing_round_fails_the_loop() -> None:
    simulated = simulate("do: {repeat: 3, do: a}", fails={"a": fails(2)})
    assert simulated.advance(10) == "failure"
    assert simulated.calls == {"a": 2}


def test_until_is_asked_after_each_round_and_never_cuts_one() -> None:
    simulated = simulate("do:\n  repeat: forever\n  until: $door\n  do: a")
    simulated.at(1.5, lambda: simulated.set("door", True))
    assert simulated.advance(10) == "success"
    assert skills(simulated) == ["0 a", "1 a"]
    assert simulated.now == 2.0


def test_every_counts_from_start_to_start_and_not_after_the_last_round() -> None:
    simulated = simulate("do:\n  repeat: 3\n  every: 4 s\n  do: a")
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "4 a", "8 a"]
    assert simulated.now == 9.0


def test_a_round_that_is_longer_than_every_is_followed_at_once() -> None:
    simulated = simulate("do:\n  repeat: 2\n  every: 1 s\n  do: a", takes={"a": 3.0})
    simulated.advance(20)
    assert skills(simulated) == ["0 a", "3 a"]


def test_for_does_each_item_in_the_order_written() -> None:
    simulated = simulate("do:\n  for: corner\n  in: [corner_1, dock]\n  do:\n    go_to: $corner")
    assert simulated.advance(10) == "success"
    assert skills(simulated) == ["0 go_to corner_1", "1 go_to dock"]


def test_for_goes_through_the_keys_of_a_map() -> None:
    simulated = simulate("data:\n  chores: {kitchen: 1, dock: 2}\ndo:\n  for: x\n  in: $chores\n  do:\n    go_to: $x")
    assert simulated.advance(10) == "success"
    assert skills(simulated) == ["0 go_to kitchen", "1 go_to dock"]


def test_the_list_of_for_is_read_once_at_the_start() -> None:
    body = "    - go_to: $x\n    - set:\n        rooms: '[]'"
    simulated = simulate(f"data:\n  rooms: [dock, kitchen]\ndo:\n  for: x\n  in: $rooms\n  do:\n{body}")
    simulated.advance(10)
    assert simulated.calls == {"go_to": 2}


def test_a_failed_item_stops_the_loop_unless_the_next_is_wanted() -> None:
    text = "do:\n  for: x\n  in: [1, 2, 3]\n  if_one_fails: {}\n  do: a"
    for word, calls in (("stop", 1), ("next", 3)):
        simulated = simulate(text.replace("{}", word), fails={"a": fails(1)})
        assert simulated.advance(10) == "failure"
        assert simulated.calls == {"a": calls}


def test_loops_of_one_item_name_may_stand_beside_each_other_and_within_an_interrupt() -> None:
    text = """
    interrupts:
      open:
        when: $door
        do:
          for: x
          in: [kitchen]
          do:
            go_to: $x
    do:
      - for: x
        in: [dock]
        do:
          go_to: $x
      - for: x
        in: [corner_1]
        do:
          go_to: $x
    """
    simulated = simulate(text)
    simulated.at(0.5, lambda: simulated.set("door", True))
    simulated.at(0.7, lambda: simulated.set("door", False))
    simulated.advance(10)
    assert skills(simulated) == ["0 go_to dock", "0.5 go_to kitchen", "1.5 go_to dock", "2.5 go_to corner_1"]


def test_wait_takes_its_time_and_wait_for_its_condition() -> None:
    simulated = simulate("do:\n  - wait: 2.5 s\n  - wait_for: $battery > 50 %\n  - a")
    simulated.at(4.0, lambda: simulated.set("battery", 0.6))
    assert simulated.advance(10) == "success"
    assert skills(simulated) == ["4 a"]


def test_new_counts_messages_from_the_start_of_its_node() -> None:
    simulated = simulate("do:\n  - a\n  - wait_for: new($door)\n  - b")
    simulated.at(0.5, lambda: simulated.set("door", True))
    simulated.at(3.0, lambda: simulated.set("door", True))
    simulated.advance(10)
    assert skills(simulated) == ["0 a", "3 b"]


def test_age_is_asked_at_the_rate_of_the_mission() -> None:
    simulated = simulate("rate: 10 Hz\ndo:\n  - wait_for: age($door) > 0.75 s\n  - a")
    simulated.set("door", True)
    simulated.advance(10)
    assert skills(simulated) == ["0.8 a"]


def test_set_computes_all_right_sides_first() -> None:
    simulated = simulate("data: {x: 1, y: 2}\ndo:\n  set:\n    x: $y\n    y: $x + 10")
    simulated.advance(1)
    assert simulated.engine.data == {"x": 2.0, "y": 11.0}


def test_log_fills_in_values_with_their_units() -> None:
    simulated = simulate("data: {pause: 90 s, room: kitchen}\ndo:\n  log: $battery of $pause in $room for $$5")
    simulated.set("battery", 0.25)
    simulated.advance(1)
    assert simulated.told[0] == "0 25 % of 90 s in kitchen for $5"


def test_text_arguments_are_templates_and_take_their_scalar_as_written() -> None:
    simulated = simulate("do:\n  - say: 7\n  - for: room\n    in: [corner_1]\n    do:\n      say: I am at $room now")
    simulated.advance(10)
    assert skills(simulated) == ["0 say 7", "1 say I am at corner 1 now"]


def test_arguments_of_numbers_are_expressions() -> None:
    simulated = simulate("do:\n  go_to:\n    pose: dock\n    tolerance: 2 * 5 cm")
    simulated.advance(10)
    assert skills(simulated) == ["0 go_to pose dock, tolerance 0.1 m"]


@pytest.mark.parametrize(
    ("node", "report"),
    [
        ("wait: 1 s / $battery", "division by zero"),
        ("repeat: $count_of_people\n  do: a", "'repeat' must be a whole number, not 2.5"),
        ("set:\n    x: $x / $battery", "division by zero"),
        ("wait: 0 s - 1 s", "a duration must be a number, at least 0, not -1"),
        ("log: $door", "'$door' has not arrived yet"),
        ("go_to: $nowhere", "there is no place 'nowhere'"),
        ("for: one\n  in: $none + [5]\n  do: {go_to: $one}", "5 is no place"),
    ],
)
def test_a_node_without_a_value_is_a_reported_failure(node: str, report: str) -> None:
    simulated = simulate(f"data: {{x: 1, nowhere: nowhere, none: []}}\ndo:\n  {node}")
    simulated.set("battery", 0.0)
    simulated.set("count_of_people", 2.5)
    assert simulated.advance(10) == "failure"
    assert simulated.told[0].endswith(report)


def test_an_exception_of_a_leaf_is_a_reported_failure() -> None:
    simulated = simulate("do: {fallback: [a, b]}", raises=frozenset({"a"}))
    assert simulated.advance(10) == "success"
    assert simulated.told[:3] == ["0 a", "0 mission.yaml:1: RuntimeError: out of order", "0 b"]


def test_in_texts_a_name_of_a_place_has_no_underscores_wherever_it_comes_from() -> None:
    text = """
    data:
      rooms: {corner_1: [corner_2, far_away]}
    do:
      - for: room
        in: $rooms
        do:
          - say: I am at $room now
          - go_to: $room
          - log: Left are $rooms
          - check: $room == 'corner_1'
    """
    simulated = simulate(text)
    assert simulated.advance(10) == "success"
    assert skills(simulated) == ["0 say I am at corner 1 now", "1 go_to corner_1"]
    assert "2 Left are corner 1: corner 2, far_away" in simulated.told


def test_in_texts_entries_of_lists_and_maps_and_items_of_loops_have_their_units() -> None:
    text = """
    data:
      limits: [50 %, 20 s, 90 deg]
      kitchen: {time: 5 min, level: 20 %, near: [1 m]}
      stops: [{to: far_away, stay: 5 s}, {to: dock}]
    do:
      - log: $limits; $kitchen; $kitchen.level
      - {for: one, in: $stops, do: {log: $one.to $one}}
      - {for: one, in: [1 m, 2 m], do: {log: $one}}
    """
    simulated = simulate(text)
    assert simulated.advance(10) == "success"
    assert simulated.told[:5] == [
        "0 50 %, 20 s, 90 deg; time: 300 s, level: 20 %, near: 1 m; 20 %",
        "0 far_away to: far_away, stay: 5 s",
        "0 dock to: dock",
        "0 1 m",
        "0 2 m",
    ]


def test_the_story_shows_a_step_as_it_was_written_and_what_an_expression_gives() -> None:
    lengths = {name: quantity_of(LENGTH) for name in "xyz"}
    reach = Skill("reach", {**lengths, "any_orientation": FLAG}, "z")
    robot = replace(ROBOT, skills={**SKILLS, "reach": reach})
    text = "data: {up: 25 cm}\ndo: {reach: {x: 25 cm, y: -5cm, z: $up, any_orientation: true}}"
    simulated = Simulated(program_of(text, robot), robot=robot)
    assert simulated.advance(5) == "success"
    shown = "reach x 25 cm, y -5cm, z 0.25 m, any_orientation true"
    assert simulated.told[:2] == [f"0 {shown}", f"1 {shown}: success (1 s)"]


def test_in_a_message_to_programs_a_text_stays_as_it_was_written() -> None:
    simulated = simulate("data: {room: corner_1}\ndo: {publish: greetings, message: $room}")
    assert simulated.advance(5) == "success"
    assert simulated.published == [(0.0, "greetings", {"data": "corner_1"})]


def test_a_bare_word_is_a_choice_where_one_is_expected_also_if_a_place_has_that_name() -> None:
    paint = Skill("paint", {"where": choice_of("dock", "wall")}, "where")
    robot = replace(ROBOT, skills={**SKILLS, "paint": paint})
    simulated = Simulated(program_of("do: [{paint: dock}, {paint: wall}]", robot), robot=robot)
    assert simulated.advance(5) == "success"
    given = [event.arguments["where"] for _, event in simulated.events if isinstance(event, SkillStarted)]
    assert given == ["dock", "wall"]
