"""`publish`: one message on a topic."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbxcompose.missions.messages import Message
from rbxcompose.missions.moments import publish
from rbxcompose.missions.registry import kind
from rbxcompose.missions.statuses import SUCCESS
from rbxcompose.missions.task import Site, Task

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader


@kind("publish", {"message": "The fields of the message; a single value stands for the only field."})
class Publish(Task):
    """Publish a message on a topic of the robot; fields that are left out are zero or empty.

    Example:
        do:
          publish: cmd_vel/teleop
          message:
            linear:
              x: 0.1
    """

    __slots__ = ("message",)

    def __init__(self, site: Site, options: Message) -> None:
        super().__init__(site)
        self.message = options

    @staticmethod
    def read(reader: NodeReader) -> Message:
        """Read the topic and `message`."""
        return reader.message(reader.key, "message")

    def begin(self) -> int:
        """Publish it."""
        publish(self.message, self)
        return SUCCESS
