"""A lamp that blinks, and gets as bright, as it is asked to."""

from __future__ import annotations

from pydantic import Field

from rbxcompose.msgs.std_msgs import Bool, Empty, Float64
from rbxcompose.sdk import Component, Config, In, Level, Out, ServesAction, ServesTopic, Time, component
from rbxcompose.sdk.ports import Qos

from .msgs import Blink, Dimmed

FADES = 0.5  # [1/s] how fast the brightness changes


class LampConfig(Config):
    """How to blink."""

    period: Time = Field(1.0, gt=0)
    """From one flash to the next."""
    brightness: float = Field(1.0, gt=0, le=1)
    """Of the lamp when it is on, as a part of what it can do."""


@component("lamp")
class Lamp(Component[LampConfig]):
    """Blinks: its action `blink` is a skill, whose goal is the number of flashes. So is `dim`, to a brightness.

    Example:
        lamp: {type: lamp, period: 500 ms}
    """

    rate = 20.0
    light = Out(Bool, "lamp/light")
    blink = ServesAction(Blink, "blink")
    dimmed = Out(Dimmed, "dim/ended", qos=Qos.EVENT)
    stay = In(Empty, "dim/halt", qos=Qos.EVENT)
    dim = ServesTopic(Float64, "dim", ends=dimmed, halts=stay)

    def configure(self) -> None:
        """Begin in the dark."""
        self.elapsed = 0.0  # [s] since the goal came
        self.goal: object = None
        self.brightness = self.config.brightness
        self.wanted: float | None = None  # while the brightness changes

    def accept_blink(self, goal: Blink.Goal) -> str:
        """Refuse what cannot be counted."""
        return "" if goal.flashes > 0 else "a lamp flashes at least once"

    def on_dim(self, order: Float64) -> None:
        """Begin to change the brightness, or refuse with the reason."""
        if 0 < order.data <= 1:
            self.wanted = order.data
        else:
            self.wanted = None
            self.dimmed(Dimmed(message=f"no lamp is {order.data:g} bright", brightness=self.brightness))

    def on_stay(self, message: Empty) -> None:
        """Stay as bright as it is: who is halted reports no end."""
        self.wanted = None

    def stop(self) -> None:
        """Do so, too."""
        self.wanted = None

    def step(self, dt: float) -> None:
        """Go on with both."""
        self.fade(dt)
        self.flash(dt)

    def fade(self, dt: float) -> None:
        """Come nearer to the brightness that is wanted, and report when it is there."""
        if self.wanted is None:
            return
        left = self.wanted - self.brightness
        self.brightness += min(max(left, -FADES * dt), FADES * dt)
        if abs(left) <= FADES * dt:
            self.brightness, self.wanted = self.wanted, None
            self.dimmed(Dimmed(success=True, brightness=self.brightness))

    def flash(self, dt: float) -> None:
        """Be on for the first half of each period."""
        goal = self.blink.current
        if goal is not self.goal:
            self.goal, self.elapsed = goal, 0.0
        if goal is None:
            return
        self.elapsed += dt
        flashes, phase = divmod(self.elapsed, self.config.period)
        is_over = flashes >= goal.request.flashes or goal.cancel_requested
        self.light(Bool(data=not is_over and phase < self.config.period / 2))
        if goal.cancel_requested:
            goal.canceled()
        elif is_over:
            self.status(Level.OK, "has blinked", flashes=goal.request.flashes)
            goal.succeeded(Blink.Result(flashes=goal.request.flashes))
