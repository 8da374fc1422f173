"""Stops the whole robot by an emergency stop, and when its signal is missing."""

from __future__ import annotations

import math
from typing import Any

from pydantic import Field

from rbxcompose.base.config import Time
from rbxcompose.base.levels import Level
from rbxcompose.msgs.std_msgs import Bool
from rbxcompose.msgs.std_srvs import Trigger
from rbxcompose.sdk import Calls, Component, Config, In, Port, Reply, RobotHeld, component


class EstopConfig(Config):
    """An emergency stop."""

    topic: str = "estop"
    """The topic that says whether it is pressed."""
    deadline: Time = Field(0.5, gt=0)
    """Silence after which the robot is stopped, counted from the start."""
    relaxes: list[str] = []
    """Buses of servos whose joints lose their torque; those of others hold."""


@component("estop")
class Estop(Component[EstopConfig]):
    """Stops the robot while a button is pressed, or when its messages stay away.

    The robot stays stopped until `release`, which is refused as long as there is a reason for the stop.

    Example:
        estop: {type: estop, topic: estop, deadline: 0.5 s}
    """

    made_by = "`safety: {estop: ...}` runs it."

    @classmethod
    def ports(cls, config: EstopConfig) -> dict[str, Port[Any]]:
        """Return its input, and the service of each bus whose joints it relaxes."""
        pressed = In(Bool, config.topic, qos="command", is_open=True)
        relaxing: dict[str, Port[Any]] = {f"relax_{bus}": Calls(Trigger, f"{bus}/relax_all") for bus in config.relaxes}
        return {name: port.named(name) for name, port in ({"pressed": pressed} | relaxing).items()}

    def configure(self) -> None:
        """Know nothing yet."""
        self.received_at, self.is_pressed, self.has_input = math.inf, False, False
        self.reported: str | None = None  # the last reason, None if nothing was reported

    def start(self) -> None:
        """Wait for the first message."""
        if math.isinf(self.received_at):
            self.received_at = self.now
        self.look()

    def on_pressed(self, message: Bool) -> None:
        """Take a message of the button."""
        self.received_at, self.is_pressed, self.has_input = self.now, message.data, True
        self.look()

    def wake(self) -> None:
        """Look whether messages stay away."""
        self.look()

    def go_on(self) -> None:
        """Count the silence anew: robot time stood still."""
        self.received_at = self.now
        self.look()

    def release(self) -> None:
        """Stop again if there still is a reason."""
        if self.reason:
            self.reported = None
        self.look()

    @property
    def reason(self) -> str:
        """Return why the robot must stand still, or nothing."""
        if self.is_pressed:
            return f"'{self.config.topic}' is pressed"
        is_late = self.now - self.received_at >= self.config.deadline - 1e-9
        return f"nothing came on '{self.config.topic}' for {self.config.deadline:g} s" if is_late else ""

    def look(self) -> None:
        """Tell the supervisor whether the robot must stand still, if that has changed."""
        reason = self.reason
        if not reason:
            self.context.wake_at(self.received_at + self.config.deadline)
        if reason == self.reported or not (reason or self.has_input):
            return
        is_news = reason and not self.reported
        self.reported = reason
        self.status(Level.ERROR if reason else Level.OK, reason or "not pressed")
        self.context.notify(RobotHeld(self.name, reason))
        if is_news:
            self.warn(f"emergency stop: {reason}; everything that moves is held until 'release'")
            self.relax()

    def relax(self) -> None:
        """Let the joints lose their torque that are not to hold."""
        for bus in self.config.relaxes:
            self.bound[f"relax_{bus}"](Trigger.Request(), self.relaxed)

    def relaxed(self, reply: Reply[Trigger.Response]) -> None:
        """Tell why joints could not be relaxed."""
        if reply.response is None:
            self.warn(f"joints could not be relaxed: {reply.error}")
