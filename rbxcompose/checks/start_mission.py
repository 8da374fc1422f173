"""A start mission that does not exist."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from rbxcompose.check_runner import check
from rbxcompose.composition.robot_file import MISSION
from rbxcompose.findings import Finding, Span
from rbxcompose.manifest.files import files_named
from rbxcompose.manifest.reader import read_file
from rbxcompose.manifest.tree import MappingNode, ScalarNode
from rbxcompose.model.robot import Robot
from rbxcompose.references import MISSION as MISSIONS

_ENDING = ".yaml"


@check("RBX3009", is_fixable=True)
def start_mission(robot: Robot) -> Iterator[Finding]:
    """`start:` names a mission that the robot does not have."""
    start = robot.manifest.start
    if start is None or start in robot.manifest.missions or robot.manifest.contents.may_have(MISSIONS, start):
        return
    place = robot.value("start")
    message = f"the robot has no mission '{start}' to start"
    if files := _files((place, robot.value("name")), start):
        help_text = f"add '{start}: {files[0]}' below 'missions:'"
        yield start_mission.at(place, message, help=help_text)
        return
    yield start_mission.misspelt(place, message, start, robot.manifest.missions, "missions of this robot")


def _files(places: Iterable[Span], start: str) -> list[str]:
    """Return the project's mission files of this name, as the first existing file of `places` has to write them."""
    writer = next((path for one in places if (path := Path(one.file)).is_file()), None)  # `--set` and the library: none
    found = files_named(f"{start}{_ENDING}", writer) if writer else []
    return [one for one in found if writer and _is_mission(writer.resolve().parent / one)]


def _is_mission(file: Path) -> bool:
    root, _ = read_file(file, str(file), {})
    written = root.get("kind") if isinstance(root, MappingNode) else None
    return isinstance(written, ScalarNode) and written.text == MISSION
