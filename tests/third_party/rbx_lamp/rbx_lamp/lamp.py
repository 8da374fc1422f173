"""A lamp that blinks as often as it is asked to."""

from __future__ import annotations

from pydantic import Field

from rbxcompose.msgs.std_msgs import Bool
from rbxcompose.sdk import Component, Config, Level, Out, ServesAction, Time, component

from .msgs import Blink


class LampConfig(Config):
    """How to blink."""

    period: Time = Field(1.0, gt=0)
    """From one flash to the next."""
    brightness: float = Field(1.0, gt=0, le=1)
    """Of the lamp when it is on, as a part of what it can do."""


@component("lamp")
class Lamp(Component[LampConfig]):
    """Blinks: its action `blink` is a skill, whose goal is the number of flashes.

    Example:
        lamp: {type: lamp, period: 500 ms}
    """

    rate = 20.0
    light = Out(Bool, "lamp/light")
    blink = ServesAction(Blink, "blink")

    def configure(self) -> None:
        """Begin in the dark."""
        self.elapsed = 0.0  # [s] since the goal came
        self.goal: object = None

    def accept_blink(self, goal: Blink.Goal) -> str:
        """Refuse what cannot be counted."""
        return "" if goal.flashes > 0 else "a lamp flashes at least once"

    def step(self, dt: float) -> None:
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
