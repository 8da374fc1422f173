"""Twin of a chore: the base moves back and forth a little for as long as the chore takes."""

from __future__ import annotations

from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import AT_REST, Velocity2

NOTHING_LEFT = 1e-9  # [s]; anything less is rounding from many small steps, not work


@dataclass(frozen=True, slots=True)
class ChoreSettings:
    """How the base moves meanwhile."""

    speed: float = 0.0
    """Forwards in one stroke, backwards in the next [m/s]."""
    turn_rate: float = 0.0
    """To the left in all strokes [rad/s]."""
    stroke: float = 1.0
    """Duration of a stroke [s], above zero."""


class ChoreCore:
    """Work of a given duration, in strokes; each chore starts its own count."""

    def __init__(self, settings: ChoreSettings) -> None:
        self.settings = settings
        self.done = 0.0  # [s]
        self.left = 0.0  # [s]

    def start(self, duration: float) -> None:
        """Begin a chore of `duration` [s]."""
        self.done, self.left = 0.0, duration

    @property
    def is_done(self) -> bool:
        """Return whether nothing is left to do."""
        return self.left <= NOTHING_LEFT

    def step(self, dt: float) -> Velocity2:
        """Work for `dt` [s]; return the velocity of the base meanwhile."""
        if self.is_done:
            return AT_REST
        stroke = int((self.done + NOTHING_LEFT) / self.settings.stroke)
        self.done, self.left = self.done + dt, self.left - dt
        speed = self.settings.speed if stroke % 2 == 0 else -self.settings.speed
        return Velocity2(speed, self.settings.turn_rate)
