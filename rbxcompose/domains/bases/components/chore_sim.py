"""A simulated chore."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.geometry import AT_REST, Velocity2
from rbxcompose.domains.bases.driving import BaseDriver
from rbxcompose.msgs.nav2_msgs import Wait
from rbxcompose.msgs.stamps import to_duration, to_seconds

LONGEST = 24 * 3600.0  # [s]
NOTHING_LEFT = 1e-9  # [s]; anything less is rounding from many small steps, not work


class ChoreSimConfig(sdk.Config):
    """How the base moves while the chore is done."""

    speed: Annotated[sdk.Speed, sdk.Live()] = Field(0.05, ge=0)
    """Speed of the strokes: forwards in one, backwards in the next."""
    turn_rate: Annotated[sdk.AngularSpeed, sdk.Live()] = 0.0
    """How fast it turns meanwhile, always in the same direction."""
    stroke: Annotated[sdk.Time, sdk.Live()] = Field(1.0, gt=0)
    """Duration of a stroke."""


class ChoreCore:
    """Work of a given duration, in strokes; each chore starts its own count."""

    def __init__(self, settings: ChoreSimConfig) -> None:
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


@sdk.component("chore_sim")
class ChoreSim(BaseDriver[ChoreSimConfig]):
    """A chore such as vacuuming: it takes as long as its goal says and moves the base a little.

    Its skill is called `chore` unless `connect` names it. A second goal is refused while it is busy.

    Example:
        vacuum: {type: chore_sim, speed: 5 cm/s, connect: {chore: vacuum, cmd_vel: cmd_vel/vacuum}}
    """

    rate = 20.0
    steps_for_goals = True
    simulated = True
    chore = sdk.ServesAction(Wait, "chore", claims="base", pausable=True)

    def configure(self) -> None:
        """Do nothing."""
        self.core = ChoreCore(self.config)
        self.doing: object = None  # the goal that the core works on
        self.moving = False

    def reconfigure(self, old: ChoreSimConfig) -> None:
        """Continue the current chore with the new settings."""
        self.core.settings = self.config

    def accept_chore(self, goal: Wait.Goal) -> str:
        """Refuse a goal while another one is carried out, or one with an invalid time."""
        current, time = self.chore.current, to_seconds(goal.time)
        if current is not None and not current.cancel_requested:
            return f"{self.name} is busy for {self.core.left:.1f} s more"
        return "" if 0.0 <= time <= LONGEST else f"it cannot take {time:g} s"

    def step(self, dt: float) -> None:
        """Continue the goal, or hold it."""
        goal = self.chore.current
        if goal is None:
            self.rest()
        elif goal.cancel_requested:
            self.rest()
            goal.canceled(Wait.Result(total_elapsed_time=to_duration(self.core.done)))
        elif goal.is_paused:
            self.rest()
        else:
            self.work(goal, dt)

    def work(self, goal: sdk.ServedGoal[Wait.Goal, Wait.Result, Wait.Feedback], dt: float) -> None:
        """Work for one cycle and report how much is left."""
        if goal is not self.doing:
            self.doing = goal
            self.core.start(to_seconds(goal.request.time))
        if self.core.is_done:
            self.rest()
            goal.succeeded(Wait.Result(total_elapsed_time=to_duration(self.core.done)))
            return
        self.drive(self.core.step(dt))
        goal.feedback(Wait.Feedback(time_left=to_duration(max(self.core.left, 0.0))))

    def hold(self) -> None:
        """Command a halt: no step follows while robot time stands still."""
        self.rest()

    def rest(self) -> None:
        """Command a halt, once."""
        if self.moving:
            self.drive(AT_REST)

    def drive(self, velocity: Velocity2) -> None:
        """Publish a velocity."""
        self.moving = velocity != AT_REST
        super().drive(velocity)
