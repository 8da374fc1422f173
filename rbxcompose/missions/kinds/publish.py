"""`publish`: one message on a topic."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from rbxcompose.missions.engine.instant_actions import publish
from rbxcompose.missions.engine.task import Site, Task
from rbxcompose.missions.language.node_reader import NodeReader
from rbxcompose.missions.program.families import Deed
from rbxcompose.missions.program.messages import Message
from rbxcompose.missions.program.moments import Effects
from rbxcompose.missions.program.outcomes import ANY, Outcomes
from rbxcompose.missions.program.program import Endings, Node
from rbxcompose.missions.program.registry import kind
from rbxcompose.missions.program.statuses import SUCCESS


class PublishTask(Task):
    """Publishes once."""

    __slots__ = ("message",)

    def __init__(self, site: Site, step: Publish) -> None:
        super().__init__(site)
        self.message = step.message

    def begin(self) -> int:
        """Publish it."""
        publish(self.message, self)
        return SUCCESS


@kind("publish", PublishTask, {"message": "The fields of the message; a single value stands for the only field."})
@dataclass(frozen=True, slots=True)
class Publish(Deed):
    """Publish a message on a topic of the robot; missing fields are zero or empty.

    Example:
        do:
          publish: cmd_vel/teleop
          message:
            linear:
              x: 0.1
    """

    message: Message

    @classmethod
    def read(cls, reader: NodeReader) -> Self:
        """Read the topic and `message`."""
        return cls(reader.message(reader.key, "message"))

    def may_end(self, node: Node, endings: Endings) -> Outcomes:
        """Return that a value may be missing or may not fit."""
        return ANY

    def text(self, node: Node) -> str:
        """Return the topic."""
        return self.message.target.text

    @property
    def effects(self) -> Effects:
        """Return the message."""
        return Effects(published=self.message)
