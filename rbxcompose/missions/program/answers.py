"""Types in which kinds of nodes and modifiers answer questions about themselves before a mission runs."""

from collections.abc import Hashable, Mapping
from dataclasses import field
from enum import Enum, StrEnum, auto
from typing import NamedTuple, TypeAlias

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.text import Template
from rbxcompose.base.expressions.tree import Expression
from rbxcompose.base.findings import Span
from rbxcompose.manifest.tree import ScalarNode
from rbxcompose.missions.language.asked import Assignment
from rbxcompose.missions.program.machines import MessageTemplate

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
        return frozenset[str]().union(*(entry.message.names for entry in self.deeds.values() if entry.message))


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


StateKey: TypeAlias = tuple[Hashable, ...]


class Possibility(NamedTuple):
    """Something that a node may do: its span, its description, and its key."""

    span: Span
    text: str
    key: StateKey


def started(number: int) -> StateKey:
    """Return the key of the start of a node."""
    return ("node", number)


def skipped(number: int) -> StateKey:
    """Return the key of a node that ends skipped."""
    return ("skipped", number)


def ended(leaf: int, outcome: str) -> StateKey:
    """Return the key of a skill that ends with an outcome."""
    return ("skill", leaf, outcome)


def led(machine: int, state: str, to: str, outcome: str = "") -> StateKey:
    """Return the key of a transition; without an outcome, of one on any outcome."""
    return ("transition", machine, state, to, *([outcome] if outcome else []))


def cut(interrupt: str) -> StateKey:
    """Return the key of an interrupt that acts."""
    return ("interrupt", interrupt)


class Form(StrEnum):
    """How the children of a node are arranged: one after the other, side by side, or as states with transitions.

    `STATE` is for a state itself.
    """

    AFTER = "after"
    BESIDE = "beside"
    MACHINE = "machine"
    STATE = "state"


@dataclass(frozen=True, slots=True)
class NodeLook:
    """The sign before the title, the form, and whether the keys of the children are worth showing."""

    sign: str = ""
    form: Form = Form.AFTER
    has_roles: bool = False


PLAIN = NodeLook()


class Advice(NamedTuple):
    """What is wrong, and what to do about it."""

    message: str
    help: str


class Counted(NamedTuple):
    """A number in a node: what it is called, its expression, the least value that makes sense, what less does."""

    what: str
    expression: Expression | None
    least: float
    effect: str = ""


class NodeFlow(Enum):
    """How a node goes through its children when all goes well."""

    IN_TURN = auto()
    PER_ITEM = auto()  # once for each item of a list
    FIRST = auto()  # through the first; the others are for its failures
    ONE_OF = auto()  # through one of them
    OPEN = auto()  # the text does not say which of them run, and when


class Skipped(Enum):
    """When a node does nothing, and counts as skipped itself."""

    NEVER = auto()
    WITH_ALL_INSIDE = auto()  # if everything inside is skipped
    PERHAPS = auto()


class ModifierScope(Enum):
    """The nodes that a modifier is meant for."""

    ALL = auto()
    FAILING = auto()  # those that may fail
    REPEATED = auto()  # those that run more than once
