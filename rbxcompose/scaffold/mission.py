"""A new mission for an existing robot: its file, a test, and the robot's entry for it."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from itertools import combinations
from pathlib import PurePosixPath

from rbxcompose.config import Place
from rbxcompose.dataclass import dataclass
from rbxcompose.scaffold.texts import render

MOST_PLACES = 2  # places that it visits

_SECTION = re.compile(r"^missions:[ \t]*(#[^\n]*)?\r?\n", re.MULTILINE)
_INDENT = re.compile(r"(?:[ \t]*(?:#[^\n]*)?\r?\n)*( +)\S")


@dataclass(frozen=True, slots=True)
class MissionAnswers:
    """What must be known about a new mission.

    `robot` is the path of the robot's file in its project, `skill` the skill that drives to places, if there is one, at
    `speed` [m/s].
    """

    name: str
    robot: PurePosixPath
    places: Sequence[Place] = ()
    skill: str = ""
    speed: float = 1.0
    about: str = ""

    def __post_init__(self) -> None:
        """Set the default description."""
        if not self.about:
            ways = " and ".join(f"to {place.name}" for place in self.goals)
            object.__setattr__(self, "about", f"Goes {ways}." if ways else "Waits, and says so.")

    @property
    def goals(self) -> Sequence[Place]:
        """The places that it visits."""
        return self.places[:MOST_PLACES] if self.skill else ()

    @property
    def entry(self) -> str:
        """The mission's file as named in the robot's file."""
        return os.path.relpath(f"missions/{self.name}.yaml", self.robot.parent)


def mission_files(answers: MissionAnswers) -> dict[str, str]:
    """Return the texts of the mission and its test, by path in the project."""
    said = {"name": answers.name, "robot": answers.robot.as_posix()}
    mission = render(
        "mission.yaml.j2",
        **said,
        about=answers.about,
        skill=answers.skill,
        places=[place.name for place in answers.goals],
        timeout=f"{_timeout(answers)} s",
    )
    test = render("mission_test.py.j2", **said)
    return {f"missions/{answers.name}.yaml": mission, f"tests/test_{answers.name}.py": test}


def _timeout(answers: MissionAnswers) -> int:
    """Return a time in which the robot can drive from any of its places to any other [s]."""
    ways = [math.hypot(one.x - other.x, one.y - other.y) for one, other in combinations(answers.places, 2)]
    return 10 * math.ceil((2 * max(ways, default=0.0) / answers.speed + 20) / 10)


def with_entry(text: str, answers: MissionAnswers) -> str | None:
    """Return a robot's text with an entry for the mission, all else unchanged; None if there is no safe place for it.

    The entry becomes the first one below `missions:`; a text without that section gets one at its end.
    """
    newline = "\r\n" if "\r\n" in text else "\n"
    sections = list(_SECTION.finditer(text))
    if not sections and not re.search(r"^[\"']?missions\b", text, re.MULTILINE):
        end = "" if text.endswith("\n") else newline
        return f"{text}{end}{newline}missions:{newline}  {answers.name}: {answers.entry}{newline}"
    if len(sections) != 1:
        return None
    at = sections[0].end()
    indent = _INDENT.match(text, at)
    if indent is None:
        return None
    return f"{text[:at]}{indent[1]}{answers.name}: {answers.entry}{newline}{text[at:]}"
