"""`publish`: one message on a topic."""

from __future__ import annotations

from rbxcompose.base.config import PUBLISHED
from rbxcompose.missions import sdk
from rbxcompose.missions.engine.instant_actions import publish


class PublishTask(sdk.Task):
    """Publishes once."""

    __slots__ = ("message",)

    def __init__(self, site: sdk.Site, step: PublishStep) -> None:
        super().__init__(site)
        self.message = step.message

    def begin(self) -> int:
        """Publish it."""
        publish(self.message, self)
        return sdk.SUCCESS


@sdk.kind("publish", PublishTask)
@sdk.dataclass(frozen=True, slots=True)
class PublishStep(sdk.Deed):
    """Publish a message on a topic of the robot; missing fields are zero or empty.

    Example:
        do:
          publish: cmd_vel/teleop
          message:
            linear:
              x: 0.1
    """

    message: sdk.MessageTemplate = sdk.message("message", PUBLISHED)
    body = sdk.contents("The fields of the message; a single value stands for the only field.", "message")

    may_end = sdk.ends(sdk.ANY)

    def sentence(self, node: sdk.MissionNode, robot: sdk.RobotNames) -> str:
        """Say the topic."""
        return f"Publish on {self.message.target.text}"

    def text(self, node: sdk.MissionNode) -> str:
        """Return the topic."""
        return self.message.target.text

    @property
    def effects(self) -> sdk.NodeEffects:
        """Return the message."""
        return sdk.NodeEffects(published=self.message)
