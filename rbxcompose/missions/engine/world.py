"""What an engine needs from outside, what the expressions of a running mission see, and how values are shown."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import field
from typing import Protocol

from rbxcompose.base.config import Place
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.tree import Expression
from rbxcompose.base.expressions.types import UNKNOWN, Type
from rbxcompose.base.expressions.values import NotArrived, Value, is_located, is_named_pose, is_number
from rbxcompose.base.units import format_number, format_quantity
from rbxcompose.missions.engine.events import MissionEvent

DIGITS = 3  # that people want to read of something measured


def show(type: Type | None, value: Value, *, briefly: bool = False, places: Collection[str] = ()) -> str:
    """Return a value as text: '48.8889 %', '2'; of lists and maps, each entry by its own type.

    If `briefly`, numbers have three digits, or more if there are more before the point: '48.9 %'. Names of `places`
    are written as people say them: 'living room'.
    """
    known = type or UNKNOWN

    def within(inner: Type, entry: Value) -> str:
        return show(inner, entry, briefly=briefly, places=places)

    if isinstance(value, Mapping):
        return ", ".join(f"{within(UNKNOWN, name)}: {within(known.part(name), entry)}" for name, entry in value.items())
    if isinstance(value, list | tuple):
        parts = known.parts if len(known.parts) == len(value) else {}  # else it is no more what it was
        return ", ".join(within(parts.get(str(index), known.entry), item) for index, item in enumerate(value))
    if isinstance(value, str):
        return value.replace("_", " ") if value in places else value
    if isinstance(value, bool):
        return "true" if value else "false"
    if is_number(value):
        text = format_quantity(value, known.dimension) if known.dimension else format_number(value)
        return _brief(text) if briefly else text
    if is_named_pose(value):
        return value.name.replace("_", " ")
    if is_located(value):
        return f"({format_number(value.x)} m, {format_number(value.y)} m)"
    return "nothing yet" if isinstance(value, NotArrived) else str(value)


def show_briefly(type: Type | None, value: Value) -> str:
    """Return a value as text, with numbers of three digits: '48.9 %'."""
    return show(type, value, briefly=True)


def _brief(text: str) -> str:
    number, space, unit = text.partition(" ")
    written = float(number)
    if not math.isfinite(written):  # a number may become infinite in its unit
        return text
    decimals = DIGITS - 1 - math.floor(math.log10(abs(written))) if written else 0
    return f"{format_number(round(written, max(0, decimals)))}{space}{unit}"


class RobotValues(Protocol):
    """The robot's values, as the world knows them."""

    def value(self, name: str, /) -> Value | NotArrived:
        """Return the newest value in SI; raise KeyError if there is no such name."""

    def age(self, name: str, /) -> float | NotArrived:
        """Return the time since the last message [s]; raise KeyError if there is no such name."""

    def count(self, name: str, /) -> int:
        """Return how many messages have arrived so far; raise KeyError if there is no such name."""


class MissionScope(Protocol):
    """A scope of expressions that also counts messages."""

    def variable(self, name: str, /) -> Value | NotArrived:
        """Return the value of `$name`."""

    def word(self, name: str, /) -> Value:
        """Return the value that a bare word names."""

    def age(self, name: str, /) -> float | NotArrived:
        """Return the time since the last message of `$name` [s]."""

    def is_new(self, name: str, /) -> bool:
        """Return whether a message of `$name` has arrived since this node started."""

    def count(self, name: str, /) -> int:
        """Return how many messages of `$name` have arrived."""


class RunScope:
    """The scope of a whole mission; `data` is its own, and is written by `set`."""

    def __init__(
        self, data: dict[str, Value], inputs: Mapping[str, Value], places: Mapping[str, Place], values: RobotValues
    ) -> None:
        self.data = data
        self._inputs = inputs
        self._places = places
        self._values = values

    def variable(self, name: str, /) -> Value | NotArrived:
        """Return a datum, an input or a value of the robot."""
        if name in self.data:
            return self.data[name]
        return self._inputs[name] if name in self._inputs else self._values.value(name)

    def word(self, name: str, /) -> Value:
        """Return the place of this name, else the word itself, which is then a choice."""
        return self._places.get(name, name)

    def age(self, name: str, /) -> float | NotArrived:
        """Look it up in the world."""
        return self._values.age(name)

    def is_new(self, name: str, /) -> bool:
        """Return whether any message has arrived since the mission started."""
        return self.count(name) > 0

    def count(self, name: str, /) -> int:
        """Look it up in the world; the mission's own data and inputs never arrive as messages."""
        return 0 if name in self.data or name in self._inputs else self._values.count(name)


class Inner:
    """A scope inside another one, in which it looks up everything it does not know."""

    def __init__(self, outer: MissionScope) -> None:
        self.outer = outer

    def variable(self, name: str, /) -> Value | NotArrived:
        """Look it up in the outer scope."""
        return self.outer.variable(name)

    def word(self, name: str, /) -> Value:
        """Look it up in the outer scope."""
        return self.outer.word(name)

    def age(self, name: str, /) -> float | NotArrived:
        """Look it up in the outer scope."""
        return self.outer.age(name)

    def is_new(self, name: str, /) -> bool:
        """Look it up in the outer scope."""
        return self.outer.is_new(name)

    def count(self, name: str, /) -> int:
        """Look it up in the outer scope."""
        return self.outer.count(name)


class ItemScope(Inner):
    """The scope of a loop's body, which adds the item; `type` is what is known of it before the mission runs."""

    def __init__(self, outer: MissionScope, name: str, type: Type) -> None:
        super().__init__(outer)
        self.name = name
        self.type = type
        self.item: Value = None

    def variable(self, name: str, /) -> Value | NotArrived:
        """Return the item, or look the name up in the outer scope."""
        return self.item if name == self.name else self.outer.variable(name)


def item_types(scope: MissionScope) -> dict[str, Type]:
    """Return the types of the items in a scope, by name."""
    outer = item_types(scope.outer) if isinstance(scope, Inner) else {}
    return {**outer, scope.name: scope.type} if isinstance(scope, ItemScope) else outer


class SinceScope(Inner):
    """The scope of a node that asks for events or uses `new($x)`: messages count from its start."""

    def __init__(self, outer: MissionScope, names: frozenset[str], events: Mapping[str, Value | NotArrived]) -> None:
        """Take the names in `new($x)`, and the events, each with its value until one has come."""
        super().__init__(outer)
        self._names = names | events.keys()
        self._events = events
        self.seen: dict[str, int] = {}

    def variable(self, name: str, /) -> Value | NotArrived:
        """Return a value of the outer scope; that of an event only if it has come since `mark`."""
        return self._events[name] if name in self._events and not self.is_new(name) else self.outer.variable(name)

    @property
    def is_needed(self) -> bool:
        """Return whether anything counts from the start of the node."""
        return bool(self._names)

    def mark(self) -> None:
        """Count from now on."""
        self.seen = {name: self.outer.count(name) for name in self._names}

    def is_new(self, name: str, /) -> bool:
        """Return whether a message has arrived since `mark`."""
        return self.outer.count(name) > self.seen.get(name, 0)


POSE = "pose"  # `$pose` changes all the time without a message
_UNANNOUNCED = frozenset({"age", "distance"})


@dataclass(frozen=True, slots=True)
class Watched:
    """A condition, the `$names` that it reads, and whether it may change without a message."""

    condition: Expression
    names: frozenset[str]
    is_polled: bool

    @classmethod
    def of(cls, condition: Expression) -> Watched:
        """Return a condition with its dependencies."""
        names = frozenset(reference.name for reference in condition.names)
        calls = {reference.name for reference in condition.calls}
        return cls(condition, names, POSE in names or bool(calls & _UNANNOUNCED))


class World(RobotValues, Protocol):
    """What a mission needs from outside: values, skills, topics, services and a listener for events."""

    def start(self, leaf: int, skill: str, arguments: Mapping[str, Value], /) -> None:
        """Start a skill for a leaf; its result goes to `Engine.ended`."""

    def halt(self, leaf: int, /) -> None:
        """Stop the skill or the call of a leaf; its result is no longer reported."""

    def pause(self, leaf: int, /) -> None:
        """Pause the skill of a leaf; the skill declares that it can pause."""

    def resume(self, leaf: int, /) -> None:
        """Resume the paused skill of a leaf."""

    def publish(self, topic: str, fields: Mapping[str, Value], /) -> None:
        """Publish a message with these fields, nested ones as maps; raise ValueError if one does not fit."""

    def call(self, leaf: int, service: str, fields: Mapping[str, Value], /) -> None:
        """Call a service for a leaf; its result goes to `Engine.ended`."""

    def say(self, event: MissionEvent, /) -> None:
        """Receive an event."""


class Observer(Protocol):
    """An observer of the start and end of each node; an engine without one does not track them."""

    def started(self, number: int, /) -> None:
        """Handle the start of a node."""

    def ended(self, number: int, status: int, outcome: str, /) -> None:
        """Handle the end of a node, with its own outcome if it has one; IDLE means that it was halted."""


@dataclass(frozen=True, slots=True)
class Settings:
    """How an engine is run: its random seed, and the observer of each node.

    `start_at` are the states in which machines begin the first time, by the number of the machine's node.
    """

    seed: int = 0
    start_at: Mapping[int, str] = field(default_factory=dict)
    observer: Observer | None = None


PLAIN = Settings()
