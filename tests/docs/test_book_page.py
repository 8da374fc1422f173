"""The page on the book tells which mission runs on which robot with an arm, and a test of missions proves each."""

from __future__ import annotations

import re

import yaml

from tests.conftest import ROOT
from tests.loops import for_all

PAGE = ROOT / "docs/book.md"
HEAD = "| missions | pi_robot |"


def cells() -> list[tuple[str, str, str]]:
    """Return mission, profile and robot where the page says that it runs."""
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    [at] = (number for number, line in enumerate(lines) if line.startswith(HEAD))
    robots = re.findall(r"(\w+) \|", lines[at])[1:-1]
    found = []
    for line in lines[at + 2 :]:
        if not line.startswith("|"):
            break
        missions, *told, profile = (cell.strip() for cell in line.strip("|").split("|"))
        assert len(told) == len(robots)
        assert all(told), "what does not run has a reason"
        names = re.findall(r"`(\w+)`", missions)
        [word] = re.findall(r"`(\w+)`", profile) or [""]
        for robot, cell in zip(robots, told, strict=True):
            found += [(name, word, robot) for name in names if cell == "yes" and "for the" not in profile]
    return found


def proved() -> set[tuple[str, str, str]]:
    """Return mission, profile and robot of all tests in which the whole robot moves."""
    found = set()
    for path in (ROOT / "missions/tests").glob("*.test.yaml"):
        test = yaml.safe_load(path.read_text(encoding="utf-8"))
        if "mocks" not in test and test["expect"].get("outcome") == "success":
            robots = [text.split("/")[-2] for text in (test["robot"], *test.get("also", []))]
            found |= {(test["mission"], test.get("profile", ""), robot) for robot in robots}
    return found


PROVED = proved()


@for_all("cell", cells())
def test_a_mission_that_is_said_to_run_on_a_robot_has_a_test_there(cell: tuple[str, str, str]) -> None:
    assert cell in PROVED


def test_the_page_names_three_robots_and_most_missions_of_arms() -> None:
    assert {robot for *_, robot in cells()} == {"pi_robot", "pedestal_pi", "porter"}
    assert len(cells()) >= 50
