"""What an engine needs from outside, and how it is run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from rbxcompose.expressions.values import Value
from rbxcompose.missions.engine.events import MissionEvent
from rbxcompose.missions.engine.scopes import RobotValues


class World(RobotValues, Protocol):
    """What a mission needs from outside: values, skills, topics and services, someone who listens."""

    def start(self, leaf: int, skill: str, arguments: Mapping[str, Value], /) -> None:
        """Start a skill for a leaf; `Engine.ended` tells how it ended."""
        ...

    def halt(self, leaf: int, /) -> None:
        """Stop the skill or the call of a leaf; it is not reported any more."""
        ...

    def pause(self, leaf: int, /) -> None:
        """Hold the skill of a leaf, which declares that it can pause."""
        ...

    def resume(self, leaf: int, /) -> None:
        """Let the skill of a leaf continue that was held."""
        ...

    def publish(self, topic: str, fields: Mapping[str, Value], /) -> None:
        """Publish a message with these fields, nested ones as maps; raise ValueError if one does not fit."""
        ...

    def call(self, leaf: int, service: str, fields: Mapping[str, Value], /) -> None:
        """Call a service for a leaf; `Engine.ended` tells how it ended."""
        ...

    def say(self, event: MissionEvent, /) -> None:
        """Hear what happens."""
        ...


class Observer(Protocol):
    """Who wants to know of each node as it starts and ends; an engine without one does not look."""

    def started(self, number: int, /) -> None:
        """Hear that a node starts."""
        ...

    def ended(self, number: int, status: int, outcome: str, /) -> None:
        """Hear that a node ended, with an outcome of its own if it has one; IDLE if it was halted."""
        ...


@dataclass(frozen=True, slots=True)
class Settings:
    """How an engine is run: where its chances come from, and who observes each node.

    `start_at` are the states in which machines begin the first time, by the number of the machine's node.
    """

    seed: int = 0
    start_at: Mapping[int, str] = field(default_factory=dict)
    observer: Observer | None = None


PLAIN = Settings()
