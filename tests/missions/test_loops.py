"""`for` in its orders and with its results, `run`, `choose`, and what leaves the data."""

from __future__ import annotations

import pytest

from rbxcompose.base.findings import Report
from rbxcompose.base.geometry import Pose2
from rbxcompose.missions.analysis.examined import check_program
from rbxcompose.missions.engine.world import Settings
from rbxcompose.missions.language.reader import read_program
from rbxcompose.testing import compile_mission
from tests.loops import for_all
from tests.missions.simulated import ROBOT, Simulated, simulate, tree
from tests.missions.test_composites import fails, skills

SAY = "do:\n  for: n\n  in: [1, 2, 3]\n{}  do:\n    say: $n\n  save: got\n"


def said(simulated: Simulated) -> list[str]:
    """Return what was said, in order."""
    return [line.split()[-1] for line in skills(simulated) if " say " in line]


def loop(options: str = "", **settings: object) -> Simulated:
    """Return a loop over three numbers."""
    return simulate(SAY.format("".join(f"  {line}\n" for line in options.splitlines())), **settings)


@pytest.mark.parametrize(
    ("options", "failing", "outcome", "spoken"),
    [
        ("", (), "success", "123"),
        ("", (2,), "failure", "12"),
        ("if_one_fails: next", (2,), "failure", "123"),
        ("succeed_when: any", (1,), "success", "12"),
        ("succeed_when: any", (1, 2, 3), "failure", "123"),
        ("if_one_fails: next\nsucceed_when: any", (1,), "success", "12"),
    ],
)
def test_what_the_results_of_items_mean(options: str, failing: tuple[int, ...], outcome: str, spoken: str) -> None:
    simulated = loop(options, fails={"say": fails(*failing)})
    assert simulated.advance(20) == outcome
    assert "".join(said(simulated)) == spoken


def test_the_list_is_read_once_at_the_start() -> None:
    text = "data: {all: [1, 2], none: []}\ndo:\n  for: n\n  in: $all\n  do:\n    - set: {all: $none}\n    - say: $n"
    simulated = simulate(text)
    simulated.advance(20)
    assert said(simulated) == ["1", "2"]


def test_of_a_map_the_keys_are_taken() -> None:
    simulated = simulate("data: {rooms: {red: 1, blue: 2}}\ndo:\n  for: n\n  in: $rooms\n  do:\n    say: $n")
    simulated.advance(20)
    assert said(simulated) == ["red", "blue"]


def test_a_random_order_has_all_items_and_is_the_same_for_the_same_seed() -> None:
    orders = []
    for seed in (1, 1, 2, 3, 4):
        simulated = loop("order: random", settings=Settings(seed=seed))
        assert simulated.advance(20) == "success"
        assert sorted(said(simulated)) == ["1", "2", "3"]
        orders.append(tuple(said(simulated)))
    assert orders[0] == orders[1]
    assert len(set(orders)) > 1


def test_a_random_order_is_drawn_again_at_each_start() -> None:
    text = "do:\n  repeat: 8\n  do:\n    for: n\n    in: [1, 2, 3]\n    order: random\n    do:\n      say: $n"
    simulated = simulate(text)
    assert simulated.advance(40) == "success"
    spoken = "".join(said(simulated))
    assert len({spoken[start : start + 3] for start in range(0, 24, 3)}) > 1


def test_the_nearest_place_comes_first_from_where_the_robot_is_then() -> None:
    text = "do:\n  for: place\n  in: [corner_2, dock, corner_1, kitchen]\n  order: nearest\n  do:\n    go_to: $place"
    simulated = simulate(text)
    simulated.values["pose"] = Pose2(1.2, 0.0, 0.0)
    simulated.at(0.5, lambda: simulated.set("pose", Pose2(2.9, 0.0, 0.0)))
    simulated.advance(20)
    assert [line.split()[-1] for line in skills(simulated)] == ["kitchen", "corner_2", "corner_1", "dock"]


def test_the_nearest_place_needs_to_know_where_the_robot_is() -> None:
    text = "do:\n  for: place\n  in: [dock, kitchen]\n  order: nearest\n  do:\n    go_to: $place"
    simulated = simulate(text)
    assert simulated.advance(20) == "failure"
    assert "pose" in simulated.told[-1]


def test_an_item_that_succeeded_leaves_the_data_and_one_that_failed_or_was_skipped_stays() -> None:
    text = """
    data: {chores: [1, 2, 3, 4]}
    do:
      for: n
      in: $chores
      remove_done: true
      if_one_fails: next
      do:
        say: $n
        skip_if: $n == 3
    """
    simulated = simulate(text, fails={"say": fails(2)})
    assert simulated.advance(20) == "failure"
    assert simulated.engine.data["chores"] == [2, 3]


def test_an_item_leaves_also_a_list_within_a_map_and_a_map_itself() -> None:
    text = """
    data: {rooms: {red: [1, 2], blue: [3]}}
    do:
      for: room
      in: $rooms
      remove_done: true
      do:
        for: n
        in: $rooms[$room]
        remove_done: true
        do: {say: $n}
    """
    simulated = simulate(text, fails={"say": fails(3)})
    assert simulated.advance(20) == "failure"
    assert simulated.engine.data["rooms"] == {"blue": [3]}


def test_what_was_done_and_what_failed_can_be_kept() -> None:
    simulated = loop("if_one_fails: next", fails={"say": fails(2)})
    simulated.advance(20)
    assert simulated.engine.data["got"] == {"done": [1, 3], "failed": [2]}


def test_a_skipped_item_is_neither_done_nor_failed() -> None:
    text = "do:\n  for: n\n  in: [1, 2]\n  do:\n    say: $n\n    only_if: $n == 2\n  save: got"
    simulated = simulate(text)
    simulated.advance(20)
    assert simulated.engine.data["got"] == {"done": [2], "failed": []}


RUN = """
data:
  steps:
    red:
      - a
      - [b, c]
    blue:
      - say: $word
        attempts: 2
  word: hi
do:
  for: colour
  in: $steps
  do:
    for: step
    in: $steps[$colour]
    do:
      run: $step
"""


def test_run_does_the_nodes_that_stand_in_the_data() -> None:
    simulated = simulate(RUN, fails={"say": fails(1)})
    assert simulated.advance(20) == "success"
    assert skills(simulated) == ["0 a", "1 b", "2 c", "3 say hi", "4 say hi"]


def test_run_does_a_step_that_was_chosen_earlier_wherever_it_stands_and_whatever_its_kind() -> None:
    simulated = simulate("""
        data: {next: a, jobs: [b, {wait: 3 s}], other: {log: Another}, chosen: a}
        do:
        - repeat: 2
          do:
          - run: $next  # the second time, the last job
          - {for: job, in: $jobs, do: {set: {next: $job}}}
        - set: {next: '$jobs[0]'}
        - run: $next
        - set: {chosen: $other}
        - set: {next: $chosen}
        - run: $next
    """)
    assert simulated.advance(20) == "success"
    assert simulated.told == [
        "0 a", "1 a: success (1 s)", "4 b", "5 b: success (1 s)", "5 Another", "5 mission test: success",
    ]  # fmt: skip


def test_steps_that_are_given_to_each_other_in_a_circle_are_found() -> None:
    simulated = simulate("data: {x: a, y: b}\ndo: [set: {x: $y, y: $x}, run: $x, run: $y]")
    assert simulated.advance(5) == "success"
    assert skills(simulated) == ["0 b", "1 a"]


NO_STEP = "this must be a step from the data"
WRITE_IT = "write it under 'data', and its name here, such as '$chore'"


@for_all(
    "text, what",
    [
        ("'\"foo\"'", "it is a text"),
        ("5 m + 2 m", "it is a length"),
        ("$battery", "it is a ratio"),
        ("foo", "nothing is named 'foo'"),
        ("kitchen", "'kitchen' is a place"),
    ],
)
def test_run_of_what_is_no_step_is_found(text: str, what: str) -> None:
    _, findings = compile_mission(f"do: {{run: {text}}}", ROBOT)
    assert [(finding.message, finding.help) for finding in findings] == [(f"{NO_STEP}; {what}", WRITE_IT)]


def test_only_a_step_may_follow_a_step() -> None:
    _, findings = compile_mission("data: {next: a}\ndo: [run: $next, set: {next: 5}]", ROBOT)
    assert [finding.message for finding in findings] == [f"{NO_STEP}; it is a count"]


CHOOSE = """
data: {{room: {room}}}
do:
  fallback:
    - choose: $room
      cases:
        kitchen: a
        3: b
        true: c
      {otherwise}
    - d
"""


@pytest.mark.parametrize(
    ("room", "otherwise", "done"),
    [
        ("kitchen", "", "a"),
        ("3", "", "b"),
        ("true", "", "c"),
        ("cellar", "", "d"),
        ("cellar", "else: react", "react"),
        ("kitchen", "else: react", "a"),
    ],
)
def test_choose_takes_the_case_that_is_equal_else_it_is_skipped(room: str, otherwise: str, done: str) -> None:
    simulated = simulate(CHOOSE.format(room=room, otherwise=otherwise))
    assert simulated.advance(5) == "success"
    assert skills(simulated) == [f"0 {done}"]


def test_choose_asks_once() -> None:
    text = "data: {n: 1}\ndo:\n  choose: $n\n  cases:\n    1: [{set: {n: 2}}, a, b]\n    2: c"
    simulated = simulate(text)
    assert simulated.advance(5) == "success"
    assert skills(simulated) == ["0 a", "1 b"]


@pytest.mark.parametrize(("given", "items"), [("data: {}", "[1, 2]"), ("inputs: {left: {type: list}}", "$left")])
def test_what_is_not_in_the_data_cannot_leave_it(given: str, items: str) -> None:
    report = Report()
    program = read_program(tree(f"{given}\ndo:\n  for: x\n  in: {items}\n  remove_done: true\n  do: a"), report)
    assert program is not None
    report.extend(check_program(program, ROBOT))
    assert [finding.message for finding in report] == ["'remove_done' needs an 'in' that names data"]


@pytest.mark.parametrize("options", ["", "if_one_fails: next"])
def test_an_item_that_failed_is_kept_whatever_comes_of_the_loop(options: str) -> None:
    simulated = loop(options, fails={"say": fails(3)})
    assert simulated.advance(20) == "failure"
    assert simulated.engine.data["got"] == {"done": [1, 2], "failed": [3]}


def test_a_loop_without_items_keeps_that_nothing_was_done() -> None:
    simulated = simulate("do:\n  for: n\n  in: []\n  do: a\n  save: got")
    assert simulated.advance(5) == "success"
    assert simulated.engine.data["got"] == {"done": [], "failed": []}


def test_until_ends_a_number_of_rounds_early_and_does_not_wait_for_the_next_one() -> None:
    simulated = simulate("do:\n  repeat: 5\n  every: 4 s\n  until: $door\n  do: a")
    simulated.at(4.5, lambda: simulated.set("door", True))
    assert simulated.advance(30) == "success"
    assert skills(simulated) == ["0 a", "4 a"]
    assert simulated.now == 5.0


def test_until_is_asked_also_after_a_round_that_was_skipped() -> None:
    simulated = simulate("do:\n  repeat: forever\n  until: $door\n  do: {a: {}, only_if: false}")
    simulated.set("door", True)
    assert simulated.advance(5) == "success"


def test_a_round_that_fails_fails_the_loop_also_when_until_holds() -> None:
    simulated = simulate("do:\n  repeat: forever\n  until: $door\n  do: a", fails={"a": fails(1)})
    simulated.set("door", True)
    assert simulated.advance(5) == "failure"


@pytest.mark.parametrize(
    "loop_of_three",
    [
        "repeat: 3\n  do: {set: {n: $n + 1}}",
        "for: x\n  in: [1, 2, 3]\n  do: {set: {n: $n + 1}}",
        "sequence: [{set: {n: $n + 1}}, {check: $n == 3}]\n  attempts: 3",
        "machine:\n    start: one\n    states:\n"
        "      one: {do: {set: {n: $n + 1}}, next: two}\n      two: {do: {set: {n: $n + 1}}, next: three}\n"
        "      three: {do: {set: {n: $n + 1}}, next: finished}",
    ],
)
def test_interrupts_are_looked_at_between_rounds_items_attempts_and_states(loop_of_three: str) -> None:
    text = f"data: {{n: 0}}\ninterrupts:\n  first:\n    when: $n == 1\n    do: {{log: at $n}}\ndo:\n  {loop_of_three}"
    simulated = simulate(text)
    assert simulated.advance(5) == "success"
    assert "0 at 1" in simulated.told
    assert simulated.engine.data["n"] == 3
