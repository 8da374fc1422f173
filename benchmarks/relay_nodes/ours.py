"""Relays as components."""

from __future__ import annotations

from benchmarks.relay_nodes.mark import mark
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.sdk import Component, Config, In, Out, component


class RelayConfig(Config):
    """Which relay it is."""

    number: int
    """Its place in the row."""
    folder: str
    """Where it tells of its first message."""


class _Relay(Component[RelayConfig]):
    told = Out(Twist, "told", qos="command")

    def configure(self) -> None:
        self.is_marked = False

    def on_heard(self, message: Twist) -> None:
        self.told(message)
        if not self.is_marked:
            self.is_marked = True
            mark(self.config.folder, self.config.number)


@component("relay")
class Relay(_Relay):
    """Passes a message on."""

    heard = In(Twist, "heard", qos="command")


@component("relay_source")
class Source(_Relay):
    """Is the first in the row."""

    rate = 100.0

    def step(self, dt: float) -> None:
        """Send the next message."""
        self.on_heard(Twist())
