"""What an engine needs from outside, and the conditions that something waits for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Protocol

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.tree import Expression
from rbxcompose.base.expressions.values import Value
from rbxcompose.missions.engine.events import MissionEvent
from rbxcompose.missions.engine.scopes import RobotValues

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
        ...

    def halt(self, leaf: int, /) -> None:
        """Stop the skill or the call of a leaf; its result is no longer reported."""
        ...

    def pause(self, leaf: int, /) -> None:
        """Pause the skill of a leaf; the skill declares that it can pause."""
        ...

    def resume(self, leaf: int, /) -> None:
        """Resume the paused skill of a leaf."""
        ...

    def publish(self, topic: str, fields: Mapping[str, Value], /) -> None:
        """Publish a message with these fields, nested ones as maps; raise ValueError if one does not fit."""
        ...

    def call(self, leaf: int, service: str, fields: Mapping[str, Value], /) -> None:
        """Call a service for a leaf; its result goes to `Engine.ended`."""
        ...

    def say(self, event: MissionEvent, /) -> None:
        """Receive an event."""
        ...


class Observer(Protocol):
    """An observer of the start and end of each node; an engine without one does not track them."""

    def started(self, number: int, /) -> None:
        """Handle the start of a node."""
        ...

    def ended(self, number: int, status: int, outcome: str, /) -> None:
        """Handle the end of a node, with its own outcome if it has one; IDLE means that it was halted."""
        ...


@dataclass(frozen=True, slots=True)
class Settings:
    """How an engine is run: its random seed, and the observer of each node.

    `start_at` are the states in which machines begin the first time, by the number of the machine's node.
    """

    seed: int = 0
    start_at: Mapping[int, str] = field(default_factory=dict)
    observer: Observer | None = None


PLAIN = Settings()
