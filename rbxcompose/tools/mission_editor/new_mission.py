"""A new mission from a template: its file, and its entry in the robot's file, both or none."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path, PurePosixPath

from rbxcompose.base.files import read_regular, replace_file
from rbxcompose.base.findings import Severity
from rbxcompose.base.requests import Refused
from rbxcompose.commands.new_files import write_new
from rbxcompose.compiler.compile import Compilation
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.manifest.tree import FILE_BYTES, MappingNode, at
from rbxcompose.tools.mission_editor.yaml_places import placed
from rbxcompose.tools.robot_editor.subjects import valid_name
from rbxcompose.tools.scaffold import MissionAnswers, with_entry

TEMPLATES = Path(__file__).parent / "templates"
_NAME, _ARM, _PLACE, _MOST_PLACES = "NAME", "ARM", "PLACE_", 2


def templates() -> list[dict[str, str]]:
    """Return the names of the templates, each with what it does."""
    found = []
    for file in sorted(TEMPLATES.glob("*.yaml")):
        root = placed(file.read_text(encoding="utf-8"))
        about = root.get("about") if root is not None else None
        found.append({"name": file.stem, "about": about.text if about is not None else ""})
    return found


def filled(template: str, name: str, robot: Robot) -> str:
    """Return the text of a mission: a template with a name, and with places and an arm of the robot.

    Raises:
        Refused: if there is no such template, or the robot has no arm for it.
    """
    if template not in {one["name"] for one in templates()}:
        raise Refused(f"there is no template '{template[:60]}'")
    text = (TEMPLATES / f"{template}.yaml").read_text(encoding="utf-8")
    places = [*robot.manifest.places]
    for number in range(_MOST_PLACES):
        if places:
            text = text.replace(f"{_PLACE}{number + 1}", places[number % len(places)])
    for word, found in _of_arm(robot).items() if _ARM in text else ():
        text = text.replace(word, found)
    return text.replace(f"name: {_NAME}", f"name: {name}")


def _of_arm(robot: Robot) -> dict[str, str]:
    """Return an arm that picks, with an object, and a spot and a pose of this arm.

    Raises:
        Refused: if there is none, with what is missing.
    """
    root = robot.manifest.root
    arms = [arm for arm in _names(root, "arms") if f"pick_{arm}" in robot.names.skills]
    if not arms:
        raise Refused("this robot has no arm that picks: that is an entry of 'arms' with a 'gripper'")
    wanted = {"OBJECT": ("scene", "objects"), "SPOT": ("arms", arms[0], "spots"), "POSE": ("arms", arms[0], "poses")}
    found = {word: _names(root, *path) for word, path in wanted.items()}
    if missing := next((word for word, names in found.items() if not names), None):
        raise Refused(f"this needs an entry of '{'.'.join(wanted[missing])}' in the robot's file")
    return {**{word: names[-1] for word, names in found.items()}, _ARM: arms[0]}


def _names(root: MappingNode, *path: str) -> list[str]:
    found = at(root, path)
    return [*found.entries] if isinstance(found, MappingNode) else []


def make_mission(
    robot: Robot,
    file: Path,
    project: Path,
    name: str,
    template: str,
    compiled: Callable[[Mapping[Path, str]], Compilation],
) -> Path:
    """Write a new mission of a robot, and return its file.

    Raises:
        Refused: if the name is taken, or the robot cannot do what the template does; nothing is written then.
    """
    if not file.is_relative_to(project):
        raise Refused("the robot belongs to the library: make one of your own with 'rbxcompose new robot NAME'")
    valid_name(name, "a mission", robot.manifest.missions)
    answers = MissionAnswers(name, PurePosixPath(file.relative_to(project)))
    try:
        before = read_regular(file, FILE_BYTES)
        with_it = with_entry(before.decode("utf-8"), answers)
    except (OSError, UnicodeDecodeError) as error:
        raise Refused("the robot's file cannot be read") from error
    if with_it is None:
        raise Refused(f"there is no safe place for it in the robot's file: write '{name}: {answers.entry}' there")
    path = project / f"missions/{name}.yaml"
    text = filled(template, name, robot)
    if (finding := write_new(project, {f"missions/{name}.yaml": text})) is not None:
        raise Refused(finding.message)
    try:
        made = compiled({file: with_it.removeprefix("\ufeff").replace("\r\n", "\n")})
        known = {(one.code, one.message) for one in compiled({}).report}
        errors = [one for one in made.report if one.severity is Severity.ERROR and (one.code, one.message) not in known]
        if errors or made.robot is None or name not in made.robot.missions:
            why = errors[0].message if errors else "its file cannot be read"
            raise Refused(f"this robot cannot do that: {why}")
        if read_regular(file, FILE_BYTES) != before:
            raise Refused("the robot's file has changed meanwhile: try again")
        replace_file(file, with_it.encode("utf-8"))
    except (Refused, OSError) as error:
        with suppress(OSError):
            path.unlink()
        raise error if isinstance(error, Refused) else Refused(f"it was not written: {error.strerror}") from error
    return path
