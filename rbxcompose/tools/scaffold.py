"""New robots, parts, missions, worlds and components from templates."""

import importlib.util
import keyword
import math
import os
import re
import sys
from collections.abc import Sequence
from itertools import combinations
from pathlib import PurePosixPath

from pydantic import ValidationError

from rbxcompose.base.config import Config, Place
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.values import FUNCTIONS
from rbxcompose.base.findings import suggest
from rbxcompose.base.plugins import BrokenPluginError
from rbxcompose.commands.new_files import NAME, AnswerError, class_name, read_name, read_place, render, wrong_answer
from rbxcompose.missions.program.registry import kinds, modifier_keys
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.sdk.capabilities import Drives
from rbxcompose.sdk.component import Component
from rbxcompose.sdk.registry import component_names, component_type, declared

PART_ABOUT = "A simulated battery, and the group of its status."
WORLD_ABOUT = "A room with walls, a table, a bin and a visitor."
ROOM = (60, 40)  # cells of 10 cm
ROBOT_ABOUT = "Goes to its places, and home to charge when the battery is low."
BASE = "diff_drive_sim"
COMMANDS = "cmd_vel"  # the mux of the template
DOCK = Place("dock", 0.0, 0.0, 0.0)
PLACES = (Place("table", 2.0, 0.0, 0.0), Place("window", 2.0, 1.5, math.pi / 2))
MOST_PLACES = 20
_SPEED = 0.3  # [m/s] of the template
_USED = ("battery", "place", "pose", "low", "go_to", "recharge")  # names used by the robot and its mission
_WORDS = ("and", "or", "not", "in", "is", "lambda", "do", "else", "then")
MISSION_MOST_PLACES = 2  # places that it visits
_SECTION = re.compile(r"^missions:[ \t]*(#[^\n]*)?\r?\n", re.MULTILINE)
_INDENT = re.compile(r"(?:[ \t]*(?:#[^\n]*)?\r?\n)*( +)\S")
_CLASSES = frozenset({"Component", "Config", "Field", "Float32", "In", "Level", "Out", "Path", "Ratio"})


def part_files(name: str, about: str = PART_ABOUT) -> dict[str, str]:
    """Return the texts of the part's file and its test, by path."""
    return {
        f"parts/{name}.yaml": render("part.yaml.j2", name=name, about=about),
        f"tests/test_{name}.py": render("part_test.py.j2", name=name),
    }


def world_files(name: str, about: str = WORLD_ABOUT) -> dict[str, str]:
    """Return the texts of the world's file and of its map, by path; its picture is a PGM in digits."""
    columns, rows = ROOM
    inner = ["0", *["254"] * (columns - 2), "0"]
    lines = [" ".join(line) for line in (["0"] * columns, *[inner] * (rows - 2), ["0"] * columns)]
    return {
        f"worlds/{name}.yaml": render("world.yaml.j2", name=name, about=about),
        f"worlds/{name}_map.yaml": render("world_map.yaml.j2", name=name),
        f"worlds/{name}_map.pgm": "\n".join((f"P2\n{columns} {rows}\n255", *lines, "")),
    }


def robot_files(
    name: str, about: str = ROBOT_ABOUT, base: str = BASE, goals: Sequence[Place] = PLACES
) -> dict[str, str]:
    """Return the texts of the robot's file, its mission and its test, by path; the dock is always at the origin."""
    places = [DOCK, *goals]
    longest = max(math.hypot(place.x - other.x, place.y - other.y) for place, other in combinations(places, 2)) / _SPEED
    timeout = 10 * math.ceil((2 * longest + 20) / 10)  # [s], with time to turn
    minutes = max(10, math.ceil(8 * longest / 60))  # so that the last third of the charge is enough for the way home
    names = [place.name for place in goals]
    said = {"name": name, "timeout": f"{timeout} s"}
    whole = {**said, "about": about, "places": places, "base": base, "base_settings": _base_settings(base)}
    return {
        f"robots/{name}/robot.yaml": render("robot.yaml.j2", **whole, runtime=f"{minutes} min"),
        f"missions/{name}.yaml": render("robot_mission.yaml.j2", **said, places=names),
        f"tests/test_{name}.py": render(
            "robot_test.py.j2",
            **said,
            tour=", ".join(f'"{name}"' for name in (*names, DOCK.name)),
            longest=f"{timeout * (len(names) + 3):.1f}",
        ),
    }


def read_places(texts: Sequence[str]) -> tuple[Place, ...]:
    """Return the places that are written as `NAME=X,Y` or `NAME=X,Y,HEADING`.

    Raises:
        AnswerError: if one has another form, an invalid name, or the position of another one; if there are too many.
    """
    found: list[Place] = []
    for text in texts:
        found.append(read_next_place(text, found))
    return tuple(found)


def read_next_place(text: str, before: Sequence[Place]) -> Place:
    """Return the place that follows those before it, as `read_places` does."""
    taken = {DOCK.name, *_USED, *_WORDS, *modifier_keys(), *kinds(), *FUNCTIONS, *(place.name for place in before)}
    place = read_place(text, taken)
    for other in (DOCK, *before):
        if math.hypot(place.x - other.x, place.y - other.y) < 0.1:  # [m], twice the tolerance of `go_to`
            raise wrong_answer(f"the place '{place.name}' is where '{other.name}' is", "move it")
    if len(before) >= MOST_PLACES:
        raise wrong_answer(f"more than {MOST_PLACES} places", "add the others in the file")
    return place


def read_base(name: str) -> str:
    """Return a component type that can be the base: it drives by `cmd_vel` and needs no settings.

    Raises:
        AnswerError: if there is no such type, or it cannot be the base.
    """
    if name not in component_names():
        hint = suggest(name, component_names(), "component types")
        raise wrong_answer(f"there is no component type '{name}'", hint)
    try:
        base = component_type(name)
    except BrokenPluginError as error:
        raise wrong_answer(str(error), f"take '{BASE}'") from error
    try:
        drives = _drives(base)
    except ValidationError:
        help_text = f"take '{BASE}', and write the other one into the file"
        raise wrong_answer(f"'{name}' needs settings of its own", help_text) from None
    if drives is None:
        raise wrong_answer(f"'{name}' is not a base: it does not follow 'cmd_vel'", f"take '{BASE}'")
    return name


def _drives(base: type[Component[Config]]) -> Drives | None:
    """Return how a component drives by `cmd_vel` with its default settings; None if it does not.

    Raises:
        ValidationError: if it needs settings.
    """
    config = base.config_type().model_validate({})
    ports = base.ports(config)
    for one in declared(base.type_name, config, Drives):
        if ports[one.commands].topic == COMMANDS and ports[one.commands].interface is Twist:
            return one
    return None


def _base_settings(base: str) -> dict[str, str]:
    """Return the usual settings of a base, as far as it has them."""
    drives = _drives(component_type(base))
    if drives is None:
        return {}
    usual = ((drives.max_speed, "0.5 m/s"), (drives.max_turn_rate, "90 deg/s"), (drives.stops_after, "0.5 s"))
    return {setting.field: text for setting, text in usual if setting and setting.field}


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
        return self.places[:MISSION_MOST_PLACES] if self.skill else ()

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
    ways = [math.hypot(place.x - other.x, place.y - other.y) for place, other in combinations(answers.places, 2)]
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


def read_component_name(text: str) -> str:
    """Return the name of a new component type, which is also the name of a Python module.

    Raises:
        AnswerError: if it is no valid name, or already has a meaning in Python or rbxcompose.
    """
    name = read_name(text, "a component type", component_names())
    if keyword.iskeyword(name) or keyword.issoftkeyword(name):
        raise _taken(name, "it is a reserved word of Python")
    if name in sys.stdlib_module_names or _is_module(name):
        raise _taken(name, "there is a Python module of that name")
    if not class_name(name).isidentifier() or class_name(name) in _CLASSES:
        raise _taken(name, f"its class would be called '{class_name(name)}'")
    return name


def _is_module(name: str) -> bool:
    spec = importlib.util.find_spec(name)
    return spec is not None and spec.origin is not None  # a plain folder has none


def _taken(name: str, why: str) -> AnswerError:
    finding = NAME.at(None, f"'{name}' cannot be the name of a component type: {why}", help=f"such as 'my_{name}'")
    return AnswerError(finding)


def component_files(name: str) -> dict[str, str]:
    """Return the texts of the distribution by path."""
    said = {"name": name, "distribution": "rbxcompose-" + name.strip("_").replace("_", "-")}
    made = {
        "pyproject.toml": "pyproject.toml",
        "README.md": "README.md",
        f"{name}.py": "component.py",
        f"tests/test_{name}.py": "test.py",
    }
    return {f"{name}/{path}": render(f"component/{template}.j2", **said) for path, template in made.items()}
