"""`publish`: one message on a topic."""

from __future__ import annotations

from rbxcompose.base.dataclass import dataclass
from rbxcompose.missions.engine.instant_actions import publish
from rbxcompose.missions.engine.task import Site, Task
from rbxcompose.missions.language.fields import contents, message
from rbxcompose.missions.program.answers import NodeEffects
from rbxcompose.missions.program.families import Deed, ends
from rbxcompose.missions.program.machines import MessageTemplate
from rbxcompose.missions.program.outcomes import ANY, SUCCESS
from rbxcompose.missions.program.program import MissionNode
from rbxcompose.missions.program.registry import kind


class PublishTask(Task):
    """Publishes once."""

    __slots__ = ("message",)

    def __init__(self, site: Site, step: PublishStep) -> None:
        super().__init__(site)
        self.message = step.message

    def begin(self) -> int:
        """Publish it."""
        publish(self.message, self)
        return SUCCESS


@kind("publish", PublishTask)
@dataclass(frozen=True, slots=True)
class PublishStep(Deed):
    """Publish a message on a topic of the robot; missing fields are zero or empty.

    Example:
        do:
          publish: cmd_vel/teleop
          message:
            linear:
              x: 0.1
    """

    message: MessageTemplate = message("message")
    body = contents("The fields of the message; a single value stands for the only field.", "message")

    may_end = ends(ANY)

    def text(self, node: MissionNode) -> str:
        """Return the topic."""
        return self.message.target.text

    @property
    def effects(self) -> NodeEffects:
        """Return the message."""
        return NodeEffects(published=self.message)
