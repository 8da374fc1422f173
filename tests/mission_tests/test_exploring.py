"""Exploring finds the ends of a mission, and what is wrong with it, with the shortest way there."""

from __future__ import annotations

import time

from rbxcompose.testing.golden import Golden
from rbxcompose.tools.mission_tests.explorer import ExplorationLimits, Explored, explore, text_of
from tests.missions.simulated import ROBOT, program_of

ALL = ExplorationLimits()
HEAD = "rbx: 1\nkind: Mission\nname: m\n"
INDEXED = """
data:
  rooms: [kitchen]
  i: 0
do:
  - a:
    on_failure:
      set:
        i: 5
    optional: true
  - go_to: $rooms[$i]
"""
GUARDED = """
interrupts:
  low:
    when: $battery < 20 %
    do:
      - go_to: dock
      - recharge
do:
  - go_to: kitchen
  - wait_for: $door
    timeout: 5 s
"""
BRANCHES = """
do:
  parallel:
    one:
      - a
      - b
    two:
      - c
      - d
    three:
      - first
      - second
  fail_when: all
"""


def explored(text: str, limits: ExplorationLimits = ALL) -> Explored:
    program = program_of(HEAD + text)
    return explore(
        program,
        ROBOT,
        {name: input_.default.value for name, input_ in program.inputs.items() if input_.default},
        limits,
    )


def test_each_end_comes_with_the_shortest_way() -> None:
    out = explored("do:\n  - a\n  - fallback:\n      - b\n      - c\n")
    assert out.ends == {"success": ("a succeeds", "b succeeds"), "failure": ("a fails",)}
    assert not out.found
    assert not out.is_cut


def test_both_sides_of_a_limit_are_tried() -> None:
    out = explored("do:\n  if: $battery < 30 %\n  then:\n    check: 1 > 2\n  else:\n    a:\n    optional: true\n")
    assert out.ends["failure"] == ("battery becomes 27 %",)
    assert out.ends["success"] == ("a succeeds",)


def test_a_timeout_is_an_outcome() -> None:
    out = explored("do:\n  a:\n  timeout: 10 s\n  attempts: 2\n")
    assert out.ends["failure"] == ("10 s pass",)
    assert out.ends["success"] == ("a succeeds",)
    assert out.states < 10


def test_a_mission_that_waits_for_ever_is_found() -> None:
    out = explored("data:\n  ready: false\ndo:\n  - a\n  - if: $battery < 50 %\n    then:\n      wait_for: $ready\n")
    (found,) = out.found
    assert "waits for ever" in found.what
    assert set(found.script) == {"battery becomes 45 %", "a succeeds"}


def test_a_loop_that_never_waits_is_found() -> None:
    text = "data:\n  left: 3\ndo:\n  - a\n  - repeat: forever\n    do:\n      if: $door\n      then: b\n"
    out = explored(text)
    assert [found.script for found in out.found if "does not wait" in found.what] == [
        ("door becomes false", "a succeeds")
    ]


def test_an_expression_without_a_value_is_found() -> None:
    out = explored(INDEXED)
    (found,) = out.found
    assert found.script == ("a fails",)


def test_states_that_were_met_are_not_met_again() -> None:
    out = explored("do:\n  repeat: forever\n  do:\n    - a\n    - wait: 2 s\n")
    assert not out.is_cut
    assert out.states < 8


def test_limits_are_told() -> None:
    out = explored(
        "data:\n  n: 0\ndo:\n  repeat: forever\n  do:\n    - a\n    - set:\n        n: $n + 1\n",
        ExplorationLimits(50, 30),
    )
    assert out.is_cut
    assert out.states <= 50


def test_it_is_told_in_words(golden: Golden) -> None:
    golden.check("explored.txt", text_of(explored(GUARDED)) + "\n")


def test_a_thousand_states_take_seconds_at_most() -> None:
    began = time.perf_counter()
    out = explored(BRANCHES, ExplorationLimits(300))
    assert out.states <= 300
    assert time.perf_counter() - began < 5
