"""A new mission for an existing robot: what `new mission` reads from the robot's file and adds to it."""

from __future__ import annotations

import os
from pathlib import Path, PurePosixPath

from rbxcompose.atomic_files import replace_file
from rbxcompose.compiler import Compilation, compile_robot
from rbxcompose.dataclass import dataclass
from rbxcompose.manifest.files import find, project_of, shown_name
from rbxcompose.manifest.library import PREFIX
from rbxcompose.manifest.limits import FILE_BYTES
from rbxcompose.model.charge import navigator_of, top_speed
from rbxcompose.model.robot import Robot
from rbxcompose.regular_files import read_regular
from rbxcompose.scaffold.answers import ANSWER, AnswerError
from rbxcompose.scaffold.mission import MissionAnswers, with_entry


class MistakenRobotError(Exception):
    """Raised with the compiler's result when the robot itself has mistakes."""

    def __init__(self, compilation: Compilation) -> None:
        super().__init__("the robot has errors")
        self.compilation = compilation


@dataclass(frozen=True, slots=True)
class MissionHome:
    """The robot that gets a mission, its file, and the project of both."""

    robot: Robot
    file: Path
    project: Path

    def usual(self, name: str) -> MissionAnswers:
        """Return the default answers for a mission of this robot."""
        file = PurePosixPath(self.file.relative_to(self.project))
        places = tuple(self.robot.manifest.places.values())
        for skill in sorted(self.robot.skills) if places else ():
            if driver := navigator_of(self.robot, skill):
                return MissionAnswers(name, file, places, skill, top_speed(self.robot, *driver))
        return MissionAnswers(name, file)

    def add(self, answers: MissionAnswers) -> bool:
        """Write the mission's entry into the robot's file, if that surely changes nothing else; return whether done."""
        before = read_regular(self.file, FILE_BYTES)
        text = with_entry(before.decode("utf-8"), answers)
        if text is None:
            return False
        unsaved = {self.file: text.removeprefix("\ufeff").replace("\r\n", "\n")}
        after = compile_robot(str(self.file), environment=os.environ, unsaved=unsaved)
        if after.plan is None or after.robot is None or answers.name not in after.robot.missions:
            return False
        if before != read_regular(self.file, FILE_BYTES):
            return False
        try:
            replace_file(self.file, text.encode("utf-8"))
        except OSError:  # the caller reports what to write by hand
            return False
        return True


def find_home(written: str) -> MissionHome:
    """Return the robot that gets the mission; if none is named, the only one below `robots/`.

    Raises:
        AnswerError: if there is no such robot, if there are several, or if it belongs to the library.
        MistakenRobotError: if it has mistakes.
    """
    file = _file(written)
    out = compile_robot(str(file), environment=os.environ)
    if out.robot is None or out.report.has_errors:
        raise MistakenRobotError(out)
    return MissionHome(out.robot, file, project_of(file))


def _file(written: str) -> Path:
    if written.startswith(PREFIX):
        help_text = "create your own with 'rbxcompose new robot NAME'"
        raise AnswerError(
            ANSWER.at(None, f"'{written}' is a robot of the library, which stays as it is", help=help_text)
        )
    path = find(written or _only())
    if isinstance(path, Path):
        return path
    raise AnswerError(path)


def _only() -> str:
    files = sorted(Path("robots").glob("*/robot.yaml"))
    if len(files) == 1:
        return str(files[0])
    if files:
        names = ", ".join(shown_name(file.parent) for file in files)
        raise AnswerError(ANSWER.at(None, "which robot is the mission for?", help=f"name it with '--robot': {names}"))
    raise AnswerError(ANSWER.at(None, "there is no robot below 'robots/'", help="name one with '--robot PATH'"))
