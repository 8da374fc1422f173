"""A new robot: a base with a battery, places, a mission that visits them, and a test of it all."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

from pydantic import ValidationError

from rbxcompose.config import Config, Place
from rbxcompose.dataclass import dataclass
from rbxcompose.expressions.functions import FUNCTIONS
from rbxcompose.findings import suggest
from rbxcompose.missions.modifiers.registry import modifier_keys
from rbxcompose.missions.program.registry import kinds
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.plugins import BrokenPluginError
from rbxcompose.scaffold.answers import ANSWER, AnswerError, read_place
from rbxcompose.scaffold.texts import render
from rbxcompose.sdk.capabilities import Drives
from rbxcompose.sdk.component import Component
from rbxcompose.sdk.registry import component_names, component_type, declared

ABOUT = "Goes to its places, and home to charge when the battery is low."
BASE = "diff_drive_sim"
COMMANDS = "cmd_vel"  # the mux of the template
DOCK = Place("dock", 0.0, 0.0, 0.0)
PLACES = (Place("table", 2.0, 0.0, 0.0), Place("window", 2.0, 1.5, math.pi / 2))
MOST_PLACES = 20

_SPEED = 0.3  # [m/s] of the template
_USED = ("battery", "place", "pose", "low", "go_to", "recharge")  # names used by the robot and its mission
_WORDS = ("and", "or", "not", "in", "is", "lambda", "do", "else", "then")


@dataclass(frozen=True, slots=True)
class RobotAnswers:
    """What must be known about a new robot; the dock is always at the origin."""

    name: str
    about: str = ABOUT
    base: str = BASE
    places: Sequence[Place] = PLACES


def robot_files(answers: RobotAnswers) -> dict[str, str]:
    """Return the texts of the robot's file, its mission and its test, by path."""
    places = [DOCK, *answers.places]
    longest = max(math.hypot(one.x - other.x, one.y - other.y) for one, other in combinations(places, 2)) / _SPEED
    timeout = 10 * math.ceil((2 * longest + 20) / 10)  # [s], with time to turn
    minutes = max(10, math.ceil(8 * longest / 60))  # so that the last third of the charge is enough for the way home
    names = [place.name for place in answers.places]
    said = {"name": answers.name, "timeout": f"{timeout} s"}
    return {
        f"robots/{answers.name}/robot.yaml": render(
            "robot.yaml.j2",
            **said,
            about=answers.about,
            places=places,
            base=answers.base,
            base_settings=_base_settings(answers.base),
            runtime=f"{minutes} min",
        ),
        f"missions/{answers.name}.yaml": render("robot_mission.yaml.j2", **said, places=names),
        f"tests/test_{answers.name}.py": render(
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
            raise AnswerError(ANSWER.at(None, f"the place '{place.name}' is where '{other.name}' is", help="move it"))
    if len(before) >= MOST_PLACES:
        raise AnswerError(ANSWER.at(None, f"more than {MOST_PLACES} places", help="add the others in the file"))
    return place


def read_base(name: str) -> str:
    """Return a component type that can be the base: it drives by `cmd_vel` and needs no settings.

    Raises:
        AnswerError: if there is no such type, or it cannot be the base.
    """
    if name not in component_names():
        help_text = suggest(name, component_names(), "component types")
        raise AnswerError(ANSWER.at(None, f"there is no component type '{name}'", help=help_text))
    try:
        base = component_type(name)
    except BrokenPluginError as error:
        raise AnswerError(ANSWER.at(None, str(error), help=f"take '{BASE}'")) from error
    try:
        drives = _drives(base)
    except ValidationError:
        help_text = f"take '{BASE}', and write the other one into the file"
        raise AnswerError(ANSWER.at(None, f"'{name}' needs settings of its own", help=help_text)) from None
    if drives is None:
        raise AnswerError(
            ANSWER.at(None, f"'{name}' is not a base: it does not follow 'cmd_vel'", help=f"take '{BASE}'")
        )
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
