"""`call`: ask a service and wait for its answer."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rbxcompose.missions.leaf import Leaf
from rbxcompose.missions.messages import Message
from rbxcompose.missions.registry import kind
from rbxcompose.missions.statuses import RUNNING
from rbxcompose.missions.task import Site
from rbxcompose.msgs import registry

if TYPE_CHECKING:
    from rbxcompose.missions.node_reader import NodeReader
    from rbxcompose.missions.program import Node


@kind("call", {"request": "The fields of the request; a single value stands for the only field."})
class Call(Leaf):
    """Call a service of the robot; an answer that says `success: false` is a failure.

    Example:
        do:
          call: set_battery_level
          request: 100
          timeout: 2 s
    """

    __slots__ = ("message",)

    def __init__(self, site: Site, options: Message) -> None:
        super().__init__(site)
        self.message = options

    @staticmethod
    def read(reader: NodeReader) -> Message:
        """Read the service and `request`."""
        return reader.message(reader.key, "request")

    @staticmethod
    def waits(node: Node) -> bool:
        """It waits for the answer."""
        return True

    def begin(self) -> int:
        """Ask."""
        return self.ask()

    def ask(self) -> int:
        """Send the request."""
        service = self.message.target.text
        request = registry.service(self.engine.robot.services[service]).Request
        fields = self.message.fields(request, self)
        self.status, self.is_asked = RUNNING, True
        try:
            self.engine.world.call(self.number, service, fields)
        except Exception:
            self.is_asked = False
            raise
        return RUNNING
