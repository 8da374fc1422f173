"""Sections about missions: what the robot can do, what it does first, and what starts missions by itself."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self, cast

from pydantic import AfterValidator, Field, model_validator

from rbxcompose.base.config import ANYTHING, MISSION, Config, Name, Refers, Secret
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Finding, Report, Span
from rbxcompose.manifest.fields import FileName, InterfaceName, TopicName
from rbxcompose.manifest.files import resolve
from rbxcompose.manifest.fill import SHOWN_SECRET
from rbxcompose.manifest.registry import section
from rbxcompose.manifest.section import OVERLAY, ROBOT, Reading, Short
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode, all_nodes
from rbxcompose.manifest.validate import salvaged, validate
from rbxcompose.manifest.yaml_nodes import is_moderate
from rbxcompose.missions.triggers.trigger import Schedule, daily, parse_cron

INPUT = "input"
"""An input of the mission that an entry names."""


Inputs = dict[Annotated[Name, Refers(INPUT, is_reported=True)], Annotated[Any, Refers(ANYTHING, is_reported=True)]]


class MissionModel(Config):
    """A mission that the robot has."""

    file: FileName
    """The mission's file, relative to this one."""
    with_: Inputs = Field({}, alias="with")
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


TRIGGER = "trigger"
CAUSES = ("at", "cron", "when", "message", "at_start", "ends")
_NEEDS = {"on": "at", "type": "message", "outcome": "ends"}


def _time(text: str) -> str:
    daily(text)
    return text


def _cron(text: str) -> str:
    parse_cron(text)
    return text


class TriggerModel(Config):
    """What starts a mission by itself: one of `at`, `cron`, `when`, `message`, `at_start` and `ends`."""

    mission: MissionName
    """The mission that it starts."""
    at: Annotated[str, AfterValidator(_time)] | None = None
    """A time of day, such as `22:00`."""
    on: tuple[Literal["mon", "tue", "wed", "thu", "fri", "sat", "sun"], ...] = Field((), min_length=1)
    """Days of the week for `at`; without it, every day."""
    cron: Annotated[str, AfterValidator(_cron)] | None = None
    """Times in the five fields of cron: minute, hour, day of the month, month, day of the week."""
    when: str | None = None
    """A condition over the robot's values; it starts the mission when it begins to hold."""
    message: TopicName | None = None
    """A topic; each message on it starts the mission."""
    type: InterfaceName | None = None
    """The type of these messages, if no component publishes them."""
    at_start: Literal[True] | None = None
    """`true`: as soon as the whole robot is active."""
    ends: MissionName | None = None
    """A mission that must have ended."""
    outcome: Name | None = None
    """How it must have ended: `success`, `failure`, `halted` or an end of its own; without it, in any way by itself."""
    priority: int = Field(0, ge=-1000, le=1000)
    """The highest one starts first, and is interrupted only by one at least as high."""
    running: Literal["skip", "queue", "interrupt"] = "skip"
    """What happens while a mission that runs needs the same part of the robot, or is the same: this one is not started,
    waits for the other's end, or cancels it.
    """
    with_: Inputs = Field({}, alias="with")
    """Values of the mission's inputs, by name; they override those under `missions`."""

    @model_validator(mode="after")
    def _one_cause(self) -> Self:
        given = [name for name in CAUSES if getattr(self, name) is not None]
        if len(given) != 1:
            found = " and ".join(f"'{name}'" for name in given) or "none"
            raise ValueError(f"needs one of {', '.join(CAUSES)}, which starts the mission: it has {found}")
        for name, needed in _NEEDS.items():
            if getattr(self, name) and needed not in given:
                raise ValueError(f"has '{name}', which belongs to '{needed}'")
        return self

    @property
    def schedule(self) -> Schedule | None:
        """Return the times at which it starts the mission."""
        return daily(self.at, self.on) if self.at else parse_cron(self.cron) if self.cron else None

    @property
    def cause(self) -> str:
        """Return what starts the mission, in words."""
        match self:
            case TriggerModel(at=str(at)):
                return f"at {at} on {', '.join(self.on)}" if self.on else f"at {at}"
            case TriggerModel(cron=str(cron)):
                return f"cron {cron}"
            case TriggerModel(when=str(when)):
                return f"when {when}"
            case TriggerModel(message=str(topic)):
                return f"message on {topic}"
            case TriggerModel(ends=str(mission)):
                return f"{mission} ended in {self.outcome}" if self.outcome else f"{mission} ended"
        return "at start"


@section(
    "triggers",
    TriggerModel,
    order=112,
    names=TRIGGER,
    entry=TRIGGER,
    files=(ROBOT, OVERLAY),
    running=frozenset({"when"}),
    details=lambda read: {name: one.cause for name, one in read.items()},
)
def triggers(reading: Reading[TriggerModel]) -> dict[str, TriggerModel]:
    """What starts missions by itself, by name.

    Example:
        triggers:
          nightly: {at: "22:00", on: [mon, fri], mission: patrol}
          empty:
            when: $battery < 15 %
            mission: patrol
            with: {rounds: 1}
            priority: 10
            running: interrupt
    """
    return reading.entries()
