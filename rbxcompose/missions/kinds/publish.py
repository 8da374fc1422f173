"""`publish`: one message on a topic."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbxcompose.missions.deed_checks import check_published
from rbxcompose.missions.messages import Message
from rbxcompose.missions.moments import publish
from rbxcompose.missions.registry import kind
from rbxcompose.missions.statuses import SUCCESS
from rbxcompose.missions.task import Site, Task

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rbxcompose.findings import Finding
    from rbxcompose.missions.node_reader import NodeReader
    from rbxcompose.missions.views import View


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

    @staticmethod
    def check(view: View) -> Iterator[Finding]:
        """The topic exists, and the message fits its type."""
        if isinstance(view.node.options, Message):
            yield from check_published(view, view.node.options)

    def begin(self) -> int:
        """Publish it."""
        publish(self.message, self)
        return SUCCESS
