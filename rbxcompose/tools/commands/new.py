"""Write a new robot, mission, part or component, each with a test, or a new world.

What it writes has no findings and runs in simulation. At a terminal it asks a few questions; each has a default and an
option. It never overwrites a file.
"""

import argparse
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import read_regular, replace_file
from rbxcompose.base.printable import plain
from rbxcompose.commands import new_files
from rbxcompose.commands.console import INTERRUPTED, ReportedError, emit, refuse, write_report
from rbxcompose.commands.options import argument
from rbxcompose.compiler.compile import compile_robot
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.model.skills import navigator_of, top_speed
from rbxcompose.manifest.files import PREFIX, find, project_of, shown_name
from rbxcompose.manifest.tree import FILE_BYTES
from rbxcompose.tools import scaffold
from rbxcompose.tools.scaffold import MissionAnswers, with_entry

GROUP = "write"
IS_COMMON = True
_WIDEST = 4096  # characters per line, enough for any path
ABOUT = "What is it for?"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    name = argument("name", metavar="NAME", help="lower-case letters, digits, underscores")
    yes = argument("--yes", action="store_true", help="ask nothing; use the defaults where there is no option")
    words = "the project's folder (default: this one)"
    into = argument("--into", metavar="DIR", type=Path, default=Path(), help=words)
    said = argument("--about", metavar="TEXT", help="what it is for, in a sentence")
    base = argument("--base", metavar="TYPE", help=f"the component that drives ({scaffold.BASE})")
    place = argument("--place", metavar="NAME=X,Y", action="append", help="a place to go to, besides the dock at 0,0")
    robot = argument("--robot", metavar="PATH", default="", help="the robot, if there is more than one")
    bare = argument("--no-add", action="store_true", help="do not change the robot's file; show what to add")
    kinds = parser.add_subparsers(dest="what", metavar="WHAT", required=True)
    for what, about, make, own in (
        ("robot", "a robot that drives, with its mission", _robot, (into, said, base, place)),
        ("mission", "one more mission for a robot", _mission, (said, robot, bare)),
        ("part", "a part that robots can include", _part, (into, said)),
        ("world", "a world for simulated robots, with a map", _world, (into, said)),
        ("component", "a component type in Python, as a package to install", _component, (into,)),
    ):
        subparser = kinds.add_parser(what, help=about, description=f"Write {about}.", allow_abbrev=False)
        subparser.set_defaults(make=make)
        for declare in (name, yes, *own):
            declare(subparser)


def run(arguments: argparse.Namespace) -> int:
    """Ask, write the files, and report them."""
    asker = new_files.Asker(is_asking=not arguments.yes)
    try:
        return int(arguments.make(arguments, asker))
    except new_files.CancelledError:
        return INTERRUPTED


def _write(folder: Path, files: Mapping[str, str], then: Sequence[str], entry: Callable[[], list[str]] = list) -> int:
    """Write files below a folder, and show what a user may want to do next.

    `entry` is called once the files exist, and returns the lines that report it.
    """
    finding = new_files.write_new(folder, files)
    if finding is not None:
        return refuse(finding)
    lines = [f"wrote {shown_name(folder / file)}" for file in files]
    lines += [*entry(), "then:", *(f"  {line}" for line in then)]
    emit("\n".join(plain(line, _WIDEST) for line in lines))
    return 0


def _robot(arguments: argparse.Namespace, asker: new_files.Asker) -> int:
    name = new_files.read_name(arguments.name, "the robot")
    about = asker.ask(ABOUT, new_files.read_text, scaffold.ROBOT_ABOUT, given=arguments.about)
    base = asker.ask("Which component drives it?", scaffold.read_base, scaffold.BASE, given=arguments.base)
    if arguments.place is None:
        question = "Where can it go? Write one place, such as 'table=2,0' in metres from the dock, or nothing to go on"
        places = tuple(asker.ask_several(question, scaffold.read_next_place)) or scaffold.PLACES
    else:
        places = scaffold.read_places(arguments.place)
    files = scaffold.robot_files(name, about, base, places)
    path = shown_name(arguments.into / f"robots/{name}")
    then = (
        f"rbxcompose check {path}",
        f"rbxcompose up --rate 10x {path}",
        f"python -m pytest {_test(arguments, name)}",
    )
    return _write(arguments.into, files, then)


def _test(arguments: argparse.Namespace, name: str) -> str:
    return shown_name(arguments.into / f"tests/test_{name}.py")


def _part(arguments: argparse.Namespace, asker: new_files.Asker) -> int:
    name = new_files.read_name(arguments.name, "the part")
    about = asker.ask(ABOUT, new_files.read_text, scaffold.PART_ABOUT, given=arguments.about)
    then = (f"include it in a robot, as parts/{name}.yaml shows", f"python -m pytest {_test(arguments, name)}")
    return _write(arguments.into, scaffold.part_files(name, about), then)


def _world(arguments: argparse.Namespace, asker: new_files.Asker) -> int:
    name = new_files.read_name(arguments.name, "the world")
    about = asker.ask(ABOUT, new_files.read_text, scaffold.WORLD_ABOUT, given=arguments.about)
    path = shown_name(arguments.into / f"worlds/{name}.yaml")
    then = (f"rbxcompose world picture {path}", f"rbxcompose up ROBOT --world {path}")
    return _write(arguments.into, scaffold.world_files(name, about), then)


def _component(arguments: argparse.Namespace, asker: new_files.Asker) -> int:
    name = scaffold.read_component_name(arguments.name)
    folder = shown_name(arguments.into / name)
    then = (f"python -m pip install -e {folder}", f"python -m pytest {folder}", f"use it in a robot: type: {name}")
    return _write(arguments.into, scaffold.component_files(name), then)


def _mission(arguments: argparse.Namespace, asker: new_files.Asker) -> int:
    home = find_home(arguments.robot)
    usual = home.usual(new_files.read_name(arguments.name, "the mission", home.robot.manifest.missions))
    answers = replace(usual, about=asker.ask(ABOUT, new_files.read_text, usual.about, given=arguments.about))
    file = shown_name(home.file)
    is_wanted = not arguments.no_add and asker.ask(f"Shall it be added to {file}?", new_files.read_yes, "yes")
    then = (
        f"rbxcompose up --rate 10x {shown_name(home.file.parent)} --set start={answers.name}",
        f"python -m pytest {shown_name(home.project / 'tests')}/test_{answers.name}.py",
    )

    def entry() -> list[str]:
        if is_wanted and home.add(answers):
            return [f"added '{answers.name}' to {file}"]
        why = f"it could not be added to {file} safely; " if is_wanted else ""
        return [f"{why}write into {file}:", "  missions:", f"    {answers.name}: {answers.entry}"]

    return _write(home.project, scaffold.mission_files(answers), then, entry)


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
        after = compile_robot(str(self.file), environment=os.environ, unsaved=unsaved, tries_profiles=True)
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
        ReportedError: if it has mistakes.
    """
    file = _file(written)
    out = compile_robot(str(file), environment=os.environ)
    if out.robot is None or out.report.has_errors:
        write_report(out.report, out.sources)
        raise ReportedError
    return MissionHome(out.robot, file, project_of(file))


def _file(written: str) -> Path:
    if written.startswith(PREFIX):
        message = f"'{written}' is a robot of the library, which stays as it is"
        raise new_files.wrong_answer(message, "create your own with 'rbxcompose new robot NAME'")
    path = find(written or _only())
    if isinstance(path, Path):
        return path
    raise new_files.AnswerError(path)


def _only() -> str:
    files = sorted(Path("robots").glob("*/robot.yaml"))
    if len(files) == 1:
        return str(files[0])
    if files:
        names = ", ".join(shown_name(file.parent) for file in files)
        raise new_files.wrong_answer("which robot is the mission for?", f"name it with '--robot': {names}")
    raise new_files.wrong_answer("there is no robot below 'robots/'", "name one with '--robot PATH'")
