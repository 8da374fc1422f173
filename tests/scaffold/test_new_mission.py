"""A new mission, and its entry in the robot's file: every other byte stays as it was."""

from __future__ import annotations

from pathlib import PurePosixPath

import pytest

from rbxcompose.base.config import Place
from rbxcompose.testing import Golden
from rbxcompose.tools.scaffold import MissionAnswers, mission_files, with_entry

ROBOT = PurePosixPath("robots/cart/robot.yaml")
LAP = MissionAnswers("lap", ROBOT)
ENTRY = "lap: ../../missions/lap.yaml\n"


def test_it_is_written_as_people_would_write_it(golden: Golden) -> None:
    places = (Place("dock", 0.0, 0.0, 0.0), Place("table", 2.0, 0.0, 0.0), Place("far", 9.0, 0.0, 0.0))
    for name, text in mission_files(MissionAnswers("lap", ROBOT, places, "go_to", 0.3)).items():
        golden.check(f"mission/{name}.txt", text)


def test_on_a_robot_that_cannot_drive_it_goes_nowhere() -> None:
    mission = mission_files(MissionAnswers("lap", ROBOT, (Place("dock", 0.0, 0.0, 0.0),)))["missions/lap.yaml"]
    assert "dock" not in mission
    assert "about: Waits, and says so.\n" in mission


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("missions:\n", "  a: a.yaml\nstart: a\n"),
        ("x: 1\nmissions:   # those\n", "\n  # a comment\n    a: a.yaml\n"),
        ("# missions:\nmissions:\n", "  a:\n    file: a.yaml\n"),
        ('"x": 1\nmissions:\n', '  "a": a.yaml   \n\n\n'),
    ],
)
def test_the_entry_is_the_first_below_missions(before: str, after: str) -> None:
    indent = "    " if "    a: " in after else "  "
    assert with_entry(before + after, LAP) == before + indent + ENTRY + after


@pytest.mark.parametrize("text", ["name: x\n", "name: x", "", "x:\n  missions:\n    a: a.yaml\n"])
def test_a_robot_without_missions_gets_the_section_at_its_end(text: str) -> None:
    made = with_entry(text, LAP)
    assert made is not None
    assert made.startswith(text)
    assert made.endswith(f"\nmissions:\n  {ENTRY}")


def test_the_ends_of_its_lines_are_those_of_the_file() -> None:
    made = with_entry("missions:\r\n  a: a.yaml\r\n", LAP)
    assert made == "missions:\r\n  lap: ../../missions/lap.yaml\r\n  a: a.yaml\r\n"


@pytest.mark.parametrize(
    "text",
    ["missions: {a: a.yaml}\n", "missions: {}\n", "missions:\n", "missions:\nstart: a\n", "'missions':\n  a: b\n"],
)
def test_what_is_written_in_another_way_is_left_to_a_person(text: str) -> None:
    assert with_entry(text, LAP) is None
