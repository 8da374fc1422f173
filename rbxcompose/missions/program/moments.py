"""What nodes and their hooks do: set data, log, publish."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from rbxcompose.dataclass import dataclass
from rbxcompose.expressions.text import Template
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.language.asked import Assignment
from rbxcompose.missions.program.messages import MessageTemplate

LEVELS = ("info", "warn", "error")  # of a log
DEEDS = ("set", "log", "publish")
OPTIONS = {"level": "log", "message": "publish"}  # each with the action that it belongs to


@dataclass(frozen=True, slots=True)
class Deeds:
    """The actions at one moment; all right-hand sides are evaluated before anything is set."""

    assignments: tuple[Assignment, ...] = ()
    text: Template | None = None
    level: str = "info"
    message: MessageTemplate | None = None


@dataclass(frozen=True, slots=True)
class Moments:
    """Actions by the key of their moment."""

    deeds: Mapping[str, Deeds] = field(default_factory=dict)

    @property
    def names(self) -> frozenset[str]:
        """Return all `$names` that their messages read."""
        return frozenset[str]().union(*(one.message.names for one in self.deeds.values() if one.message))


@dataclass(frozen=True, slots=True)
class WrittenSetting:
    """A setting of a component that is changed, as written."""

    component: ScalarNode
    parameter: ScalarNode

    @property
    def path(self) -> str:
        """Return its name: `battery.runtime`."""
        return f"{self.component.text}.{self.parameter.text}"

    @property
    def service(self) -> str:
        """Return the service of the component that changes it."""
        return f"{self.component.text}/change_parameters"


@dataclass(frozen=True, slots=True)
class NodeEffects:
    """What a node does to the mission and the robot by itself: what it sets, publishes and calls.

    `shortened` is the name of the data that it removes items from: empty if it should but names none, None if it does
    not.
    """

    assignments: tuple[Assignment, ...] = ()
    published: MessageTemplate | None = None
    called: MessageTemplate | None = None
    setting: WrittenSetting | None = None
    shortened: str | None = None


NO_EFFECTS = NodeEffects()
