"""What the expressions of a running mission see: its data, its inputs, the robot's values, the items of loops."""

from collections.abc import Mapping
from typing import Protocol

from rbxcompose.base.config import Place
from rbxcompose.base.expressions.types import Type
from rbxcompose.base.expressions.values import NotArrived, Value


class RobotValues(Protocol):
    """The robot's values, as the world knows them."""

    def value(self, name: str, /) -> Value | NotArrived:
        """Return the newest value in SI; raise KeyError if there is no such name."""
        ...

    def age(self, name: str, /) -> float | NotArrived:
        """Return the time since the last message [s]; raise KeyError if there is no such name."""
        ...

    def count(self, name: str, /) -> int:
        """Return how many messages have arrived so far; raise KeyError if there is no such name."""
        ...


class MissionScope(Protocol):
    """A scope of expressions that also counts messages."""

    def variable(self, name: str, /) -> Value | NotArrived:
        """Return the value of `$name`."""
        ...

    def word(self, name: str, /) -> Value:
        """Return the value that a bare word names."""
        ...

    def age(self, name: str, /) -> float | NotArrived:
        """Return the time since the last message of `$name` [s]."""
        ...

    def is_new(self, name: str, /) -> bool:
        """Return whether a message of `$name` has arrived since this node started."""
        ...

    def count(self, name: str, /) -> int:
        """Return how many messages of `$name` have arrived."""
        ...


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
