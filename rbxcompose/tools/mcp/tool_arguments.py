"""The arguments of the tools; their texts are what clients show."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from rbxcompose.base.config import Config

_WORD = r"^[A-Za-z0-9_$][^\s/\\]*$"  # never an option, and never a path
PlainWord = Annotated[str, Field(pattern=_WORD, max_length=200)]
PlainWordOrNone = Annotated[str, Field(pattern=rf"^$|{_WORD}", max_length=200)]
ProjectPath = Annotated[str, Field(min_length=1, max_length=1000)]


class WithTexts(Config):
    """Arguments of a tool that reads files."""

    unsaved: dict[str, str] = {}
    """Texts to use in place of those of files of the project, by path: a change is tried, and no file is written."""


class CheckArguments(WithTexts):
    """Arguments of `check`."""

    paths: Annotated[list[ProjectPath], Field(max_length=100)] = ["."]
    """Robots, missions, parts, tests or systems, or folders of them; without any, all robots of the project."""
    profiles: Annotated[list[PlainWord], Field(max_length=20)] = []
    """Profiles to apply."""


class ExplainArguments(Config):
    """Arguments of `explain`."""

    code: PlainWord
    """Such as RBX1001."""


class RobotArguments(WithTexts):
    """Arguments of a tool about a robot of the project."""

    robot: Annotated[str, Field(max_length=1000)] = ""
    """The robot's file or folder, or rbx:robots/NAME of the library; without it, the only one of the project."""
    profiles: Annotated[list[PlainWord], Field(max_length=20)] = []
    """Profiles to apply."""


class WhyArguments(RobotArguments):
    """Arguments of `why`."""

    value: PlainWord
    """The path of a value, such as battery.runtime, or of a port, such as go_to.cmd_vel."""


class TrialArguments(WithTexts):
    """Arguments of `test`."""

    paths: Annotated[list[ProjectPath], Field(max_length=100)] = ["missions"]
    """Tests, or folders of tests."""
    filter: Annotated[str, Field(max_length=200)] = ""
    """Only those with this text in their names."""


class DryRunArguments(WithTexts):
    """Arguments of `dry_run`."""

    mission: PlainWord
    """The name that the robot gives it."""
    robot: Annotated[str, Field(max_length=1000)] = ""
    """The robot's file or folder, or rbx:robots/NAME of the library; without it, the only one of the project."""


class UpArguments(Config):
    """Arguments of a tool about a robot that runs."""

    robot: PlainWordOrNone = ""
    """The name of a robot that is up; without it, the only one."""


class StoryArguments(UpArguments):
    """Arguments of `story`."""

    mission: PlainWordOrNone = ""
    """Only what this one did."""
    lines: Annotated[int, Field(ge=1, le=200)] = 100
    """How many of the newest lines."""


class MissionArguments(UpArguments):
    """Arguments of a tool about a mission that runs."""

    mission: PlainWordOrNone = ""
    """Which one; without it, the only one that runs."""


class RunArguments(UpArguments):
    """Arguments of `mission_run`."""

    mission: PlainWord
    """Which one."""
    inputs: dict[Annotated[str, Field(pattern=r"^[A-Za-z_][\w.]*$")], str] = {}
    """Its inputs as text, such as {"rounds": "2"}."""
    start: PlainWordOrNone = ""
    """Start in this state: 'outer.inner'."""
