"""The section `missions`: what the robot can do."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, cast

from pydantic import Field

from rbxcompose.base.config import ANYTHING, MISSION, Config, Name, Refers, Secret
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Report, Span
from rbxcompose.manifest.fields import FileName
from rbxcompose.manifest.files import resolve
from rbxcompose.manifest.fill import SHOWN_SECRET
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.salvage import salvaged
from rbxcompose.manifest.section import Reading, Short
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode, all_nodes
from rbxcompose.manifest.yaml_nodes import is_moderate

INPUT = "input"
"""An input of the mission that an entry names."""


class MissionModel(Config):
    """A mission that the robot has."""

    file: FileName
    """The mission's file, relative to this one."""
    with_: dict[
        Annotated[Name, Refers(INPUT, is_reported=True)], Annotated[Any, Refers(ANYTHING, is_reported=True)]
    ] = Field({}, alias="with")
    """Values of its inputs, by name."""
    after_crash: Literal["restart", "ask", "continue"] = "restart"
    """After a crash of its process or a loss of power it starts again, waits for `mission resume`, or continues."""


@dataclass(frozen=True, slots=True)
class MissionEntry:
    """A mission of the robot: its file, and the values for its inputs as nodes; not all of them, if it is not sound."""

    name: str
    path: Path
    with_: MappingNode
    span: Span
    is_sound: bool = True
    after_crash: str = "restart"


def _details(read: Mapping[str, MissionEntry]) -> dict[str, str]:
    return dict.fromkeys(read, "mission")


@section("missions", MissionModel, order=90, names=MISSION, entry="mission", short=Short("file"), details=_details)
def missions(reading: Reading[MissionModel]) -> dict[str, MissionEntry]:
    """Missions that the robot has, by name: their files, and the values of their inputs.

    Example:
        missions:
          patrol:
            file: ../../missions/patrol.yaml
            with:
              rounds: 3
    """
    brought = cast("dict[str, MissionEntry]", reading.contents.brought(MISSION))
    found = ((name, _mission(reading, name, entry)) for name, entry in reading.named())
    return brought | {name: mission_entry for name, mission_entry in found if mission_entry is not None}


def _mission(reading: Reading[MissionModel], name: str, entry: Entry) -> MissionEntry | None:
    node = entry.value
    sound = reading.valid(MissionModel, name, node)
    read = sound or salvaged(MissionModel, node)
    written = node.get("file") if isinstance(node, MappingNode) else None
    if read is None or not isinstance(node, MappingNode) or not isinstance(written, ScalarNode):
        return None
    if sound is None and written.text != read.file:
        return None
    _refuse_secrets(node, reading.report)
    inputs = node.get("with")
    if not is_moderate(inputs, "input", reading.report):
        return None
    path = resolve(read.file, reading.writer(written), written.span)
    if isinstance(path, Finding):
        reading.report.add(path)
        return None
    given = inputs if isinstance(inputs, MappingNode) else MappingNode()
    return MissionEntry(name, path, given, entry.key.span, is_sound=sound is not None, after_crash=read.after_crash)


def _refuse_secrets(node: TreeNode, report: Report) -> None:
    """Add a finding for each secret that would go into a mission, where it would be shown."""
    for found in all_nodes(node):
        if isinstance(found, ScalarNode) and isinstance(found.filled, Secret):
            report.add(SHOWN_SECRET.at(found.span, "a mission cannot hold a secret: what it does is logged"))
