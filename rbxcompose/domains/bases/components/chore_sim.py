"""A simulated chore."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.geometry import AT_REST, Velocity2
from rbxcompose.domains.bases.twins import ChoreCore, ChoreSettings
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.nav2_msgs import Wait
from rbxcompose.msgs.stamps import to_duration, to_seconds

LONGEST = 24 * 3600.0  # [s]


class ChoreSimConfig(sdk.Config):
    """How the base moves while the chore is done."""

    speed: Annotated[sdk.Speed, sdk.Live()] = Field(0.05, ge=0)
    """Speed of the strokes: forwards in one, backwards in the next."""
    turn_rate: Annotated[sdk.AngularSpeed, sdk.Live()] = 0.0
    """How fast it turns meanwhile, always in the same direction."""
    stroke: Annotated[sdk.Time, sdk.Live()] = Field(1.0, gt=0)
    """Duration of a stroke."""


@sdk.component("chore_sim")
class ChoreSim(sdk.Component[ChoreSimConfig]):
    """A chore such as vacuuming: it takes as long as its goal says and moves the base a little.

    Its skill is called `chore` unless `connect` names it. A second goal is refused while it is busy.

    Example:
        vacuum: {type: chore_sim, speed: 5 cm/s, connect: {chore: vacuum, cmd_vel: cmd_vel/vacuum}}
    """

    rate = 20.0
    steps_for_goals = True
    simulated = True
    cmd_vel = sdk.Out(Twist, "cmd_vel", qos="command")
    chore = sdk.ServesAction(Wait, "chore", claims="base", pausable=True)

    @classmethod
    def capabilities(cls, config: ChoreSimConfig) -> tuple[sdk.Capability, ...]:
        """Declare how fast it moves the base."""
        return (
            sdk.CommandsMotion(
                "cmd_vel", sdk.Setting(config.speed, "speed"), sdk.Setting(config.turn_rate, "turn_rate")
            ),
        )

    def configure(self) -> None:
        """Do nothing."""
        self.core = ChoreCore(settings_of(self.config))
        self.doing: object = None  # the goal that the core works on
        self.moving = False

    def reconfigure(self, old: ChoreSimConfig) -> None:
        """Continue the current chore with the new settings."""
        self.core.settings = settings_of(self.config)

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
        self.cmd_vel(Twist(linear=Vector3(x=velocity.linear), angular=Vector3(z=velocity.angular)))


def settings_of(config: ChoreSimConfig) -> ChoreSettings:
    """Return the settings of the core."""
    return ChoreSettings(config.speed, config.turn_rate, config.stroke)
