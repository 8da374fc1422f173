"""A gripper whose skills are topics: an order takes a second, its width tells how it ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rbxcompose.msgs.std_msgs import Empty, Float64, String
from rbxcompose.msgs.types import Fields, Message
from rbxcompose.sdk import Component, Config, In, Out, ServesTopic, component
from rbxcompose.sdk.ports import Qos

TAKES = 10  # steps of 0.1 s


@dataclass(frozen=True, slots=True)
class GripEnd(Message):
    """How an order ended."""

    TYPE: ClassVar[str] = "toy_msgs/msg/GripEnd"
    HASH: ClassVar[str] = f"RIHS01_{'7' * 64}"
    FIELDS: ClassVar[Fields] = {"success": "bool", "outcome": "string", "message": "string", "force": "float64"}

    success: bool = False
    outcome: str = ""
    message: str = ""
    force: float = 0.0  # [N]


ENDS = {0.0: GripEnd(outcome="empty"), 0.1: GripEnd(message="too wide"), 0.2: GripEnd(outcome="slippery")}
"""Ends by the width of the order [m]; all others succeed."""


class GripperConfig(Config):
    """What it does beside its duty."""

    tells_halts: bool = False
    """It tells an end also of an order that was given up."""


@component("toy_gripper")
class Gripper(Component[GripperConfig]):
    """Grips for a second.

    Example:
        gripper: {type: toy_gripper}
    """

    rate = 10.0
    gripped = Out(GripEnd, "grip/ended", qos=Qos.EVENT)
    let_go = In(Empty, "grip/halt", qos=Qos.EVENT)
    grip = ServesTopic(Float64, "grip", ends=gripped, halts=let_go, claims="arm", outcomes={"empty": "failure"})
    press = ServesTopic(Float64, "press", ends=gripped, restartable=False)
    beep = ServesTopic(String, "beep")

    def configure(self) -> None:
        """Hold nothing."""
        self.left, self.width = 0, 0.0
        self.heard: list[str] = []

    def on_grip(self, order: Float64) -> None:
        """Start, or start again; a width below zero breaks it."""
        if order.data < 0:
            raise ValueError("no such width")
        self.heard.append(f"{self.now:.1f} grip {order.data:g}")
        self.left, self.width = TAKES, order.data

    def on_press(self, order: Float64) -> None:
        """Begin, as if to grip."""
        self.on_grip(order)

    def on_let_go(self, message: Empty) -> None:
        """Give the order up."""
        self.heard.append(f"{self.now:.1f} halt")
        if self.left and self.config.tells_halts:
            self.gripped(GripEnd(message="halted"))
        self.left = 0

    def on_beep(self, text: String) -> None:
        """Beep."""
        self.heard.append(f"{self.now:.1f} beep {text.data}")

    def step(self, dt: float) -> None:
        """Go on, and tell the end."""
        if self.left:
            self.left -= 1
            if not self.left:
                self.gripped(ENDS.get(self.width, GripEnd(success=True, force=5.0)))

    def stop(self) -> None:
        """Let go."""
        self.left = 0
