"""The section `start`: the mission that runs first."""

from typing import Annotated

from rbxcompose.base.config import MISSION, Name, Refers
from rbxcompose.compiler.sections.missions import missions
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import OVERLAY, ROBOT, Reading
from rbxcompose.manifest.validate import validate

MissionName = Annotated[Name, Refers(MISSION, is_reported=True)]


@section("start", MissionName, order=110, files=(ROBOT, OVERLAY))
def start(reading: Reading[str]) -> str | None:
    """The mission that `up` runs.

    Example:
        start: patrol
    """
    if reading.node is None:
        return None
    name = validate(str, reading.node, ("start",), reading.report)
    if name is None:
        return None
    # A mission with mistakes is not a missing one.
    is_broken = name in missions.names_in(reading.contents.root) and name not in reading.contents.of(missions)
    return None if is_broken else name
