"""Write a new robot, mission, part or component, each with a test.

What it writes has no findings and runs in simulation. At a terminal it asks a few questions; each has a default and an
option. It never overwrites a file.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from rbxcompose.cli.output.console import FINDINGS, refuse, tell, tell_report
from rbxcompose.cli.project.new_mission import MistakenRobotError, find_home
from rbxcompose.cli.project.questions import Asker, CancelledError
from rbxcompose.dataclass import dataclass
from rbxcompose.manifest.files import shown_name
from rbxcompose.printable import plain
from rbxcompose.scaffold import component, mission, part, robot
from rbxcompose.scaffold.answers import AnswerError, read_name, read_text, read_yes
from rbxcompose.scaffold.new_files import write_new

INTERRUPTED = 130
_WIDEST = 4096  # characters per line, enough for any path
ABOUT = "What is it for?"


@dataclass(frozen=True, slots=True)
class New:
    """Files to write below a folder, and what a user may want to do next."""

    folder: Path
    files: Mapping[str, str]
    then: Sequence[str]
    entry: Callable[[], list[str]] | None = None  # called once the files exist; returns the lines that report it


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    kinds = parser.add_subparsers(dest="what", metavar="WHAT", required=True)
    for what, about in (
        ("robot", "a robot that drives, with its mission"),
        ("mission", "one more mission for a robot"),
        ("part", "a part that robots can include"),
        ("component", "a component type in Python, as a package to install"),
    ):
        one = kinds.add_parser(what, help=about, description=f"Write {about}.", allow_abbrev=False)
        one.add_argument("name", metavar="NAME", help="lower-case letters, digits, underscores")
        one.add_argument("--yes", action="store_true", help="ask nothing; use the defaults where there is no option")
        if what != "mission":
            one.add_argument(
                "--into", metavar="DIR", type=Path, default=Path(), help="the project's folder (default: this one)"
            )
        if what != "component":
            one.add_argument("--about", metavar="TEXT", help="what it is for, in a sentence")
    new_robot, new_mission = kinds.choices["robot"], kinds.choices["mission"]
    new_robot.add_argument("--base", metavar="TYPE", help=f"the component that drives ({robot.BASE})")
    new_robot.add_argument(
        "--place", metavar="NAME=X,Y", action="append", help="a place to go to, besides the dock at 0,0"
    )
    new_mission.add_argument("--robot", metavar="PATH", default="", help="the robot, if there is more than one")
    new_mission.add_argument("--no-add", action="store_true", help="do not change the robot's file; show what to add")


def run(arguments: argparse.Namespace) -> int:
    """Ask, write the files, and report them."""
    asker = Asker(is_asking=not arguments.yes)
    try:
        return _write(_MAKERS[arguments.what](arguments, asker))
    except AnswerError as error:
        return refuse(error.finding)
    except MistakenRobotError as error:
        tell_report(error.compilation.report, error.compilation.sources)
        return FINDINGS
    except CancelledError:
        return INTERRUPTED


def _write(new: New) -> int:
    finding = write_new(new.folder, new.files)
    if finding is not None:
        return refuse(finding)
    lines = [f"wrote {shown_name(new.folder / file)}" for file in new.files]
    lines += [] if new.entry is None else new.entry()
    lines += ["then:", *(f"  {line}" for line in new.then)]
    tell("\n".join(plain(line, _WIDEST) for line in lines))
    return 0


def _robot(arguments: argparse.Namespace, asker: Asker) -> New:
    name = read_name(arguments.name, "the robot")
    about = asker.ask(ABOUT, read_text, robot.ABOUT, given=arguments.about)
    base = asker.ask("Which component drives it?", robot.read_base, robot.BASE, given=arguments.base)
    if arguments.place is None:
        question = "Where can it go? Write one place, such as 'table=2,0' in metres from the dock, or nothing to go on"
        places = tuple(asker.ask_several(question, robot.read_next_place)) or robot.PLACES
    else:
        places = robot.read_places(arguments.place)
    files = robot.robot_files(robot.RobotAnswers(name, about, base, places))
    path = shown_name(arguments.into / f"robots/{name}")
    then = (
        f"rbxcompose check {path}",
        f"rbxcompose up --rate 10x {path}",
        f"python -m pytest {_test(arguments, name)}",
    )
    return New(arguments.into, files, then)


def _test(arguments: argparse.Namespace, name: str) -> str:
    return shown_name(arguments.into / f"tests/test_{name}.py")


def _part(arguments: argparse.Namespace, asker: Asker) -> New:
    name = read_name(arguments.name, "the part")
    about = asker.ask(ABOUT, read_text, part.ABOUT, given=arguments.about)
    then = (f"include it in a robot, as parts/{name}.yaml shows", f"python -m pytest {_test(arguments, name)}")
    return New(arguments.into, part.part_files(name, about), then)


def _component(arguments: argparse.Namespace, asker: Asker) -> New:
    name = component.read_component_name(arguments.name)
    folder = shown_name(arguments.into / name)
    then = (f"python -m pip install -e {folder}", f"python -m pytest {folder}", f"use it in a robot: type: {name}")
    return New(arguments.into, component.component_files(name), then)


def _mission(arguments: argparse.Namespace, asker: Asker) -> New:
    home = find_home(arguments.robot)
    usual = home.usual(read_name(arguments.name, "the mission", home.robot.manifest.missions))
    answers = replace(usual, about=asker.ask(ABOUT, read_text, usual.about, given=arguments.about))
    file = shown_name(home.file)
    is_wanted = not arguments.no_add and asker.ask(f"Shall it be added to {file}?", read_yes, "yes")
    then = (
        f"rbxcompose up --rate 10x {shown_name(home.file.parent)} --set start={answers.name}",
        f"python -m pytest {shown_name(home.project / 'tests')}/test_{answers.name}.py",
    )

    def entry() -> list[str]:
        if is_wanted and home.add(answers):
            return [f"added '{answers.name}' to {file}"]
        why = f"it could not be added to {file} safely; " if is_wanted else ""
        return [f"{why}write into {file}:", "  missions:", f"    {answers.name}: {answers.entry}"]

    return New(home.project, mission.mission_files(answers), then, entry)


_MAKERS: dict[str, Callable[[argparse.Namespace, Asker], New]] = {
    "robot": _robot,
    "mission": _mission,
    "part": _part,
    "component": _component,
}
