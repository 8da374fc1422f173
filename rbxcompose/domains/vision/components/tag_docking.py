"""Docking at a tag."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.geometry import AT_REST, Pose2, Transform3, Velocity2, rotate
from rbxcompose.base.levels import Level
from rbxcompose.base.units import LENGTH, TIME
from rbxcompose.domains.bases.driving import commands_motion
from rbxcompose.domains.vision.docking import OVER, Docking, DockingSettings, DockingState
from rbxcompose.domains.vision.tag_watcher import SQUARE, TagWatcher, TagWatcherConfig, WatchedTag
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.msgs.poses import twist_message
from rbxcompose.msgs.rbxcompose_msgs import DockAt

SILENCE = 1.0  # [s] without anything from the camera, after which it stands
ENDS = {str(state): "failure" for state in OVER if state is not DockingState.DOCKED}
ServedDock = sdk.ServedGoal[DockAt.Goal, DockAt.Result, DockAt.Feedback]


class TagDockingConfig(TagWatcherConfig):
    """How it docks."""

    distance: Annotated[sdk.Length, sdk.Live()] = Field(0.4, gt=0)
    """From the middle of the robot to the tag in the end, unless a goal says otherwise."""
    room: Annotated[sdk.Length, sdk.Live()] = Field(0.5, gt=0)
    """Before that, from which it drives straight in."""
    speed: Annotated[sdk.Speed, sdk.Live()] = Field(0.3, gt=0)
    """Largest speed to that point."""
    slow: Annotated[sdk.Speed, sdk.Live()] = Field(0.1, gt=0)
    """Largest speed straight in."""
    turn_rate: Annotated[sdk.AngularSpeed, sdk.Live()] = Field(math.radians(60), gt=0)
    """Largest turn rate."""
    tolerance: Annotated[sdk.Length, sdk.Live()] = Field(0.02, gt=0)
    """By which its place may be off in the end."""
    turn_tolerance: Annotated[sdk.Angle, sdk.Live()] = Field(math.radians(2), gt=0)
    """By which its heading may be off."""
    patience: Annotated[sdk.Time, sdk.Live()] = Field(5.0, gt=0)
    """Without the tag, unless a goal says otherwise."""


@sdk.component("tag_docking")
class TagDocking(TagWatcher[TagDockingConfig]):
    """Drives in front of a tag or a board, and faces it squarely.

    It turns around if it does not see the tag, drives to a point on its normal, and straight in. Between pictures it
    goes by odometry. It sees no obstacles.

    Example:
        dock_at: {type: tag_docking, frame: camera_optical_frame, connect: {cmd_vel: cmd_vel/docking}}
    """

    rate = 20.0
    steps_for_goals = True
    cmd_vel = sdk.Out(Twist, "cmd_vel", qos="command")
    dock = sdk.ServesAction(
        DockAt, "dock_at", claims="base", outcomes=ENDS, measures={"distance": LENGTH, "patience": TIME}
    )

    @classmethod
    def capabilities(cls, config: TagDockingConfig) -> tuple[sdk.Capability, ...]:
        """Declare how fast it drives."""
        return (commands_motion(config),)

    def configure(self) -> None:
        """Dock at nothing yet."""
        super().configure()
        self.goal: ServedDock | None = None
        self.docking: Docking | None = None
        self.chosen: Transform3 | None = None  # where the tag was seen last: of two with one name, that one is meant

    def accept_dock(self, goal: DockAt.Goal) -> str:
        """Refuse what names no tag, or is no distance or time."""
        fine = all(0.0 <= number < math.inf for number in (goal.distance, goal.patience))
        return "" if fine and goal.tag else "it names no tag, or its distance or patience is not finite, or below 0"

    def see(self, tags: list[WatchedTag]) -> None:
        """Note where the tag is."""
        if self.goal is None or self.docking is None:
            return
        mine = [tag for tag in tags if self.goal.request.tag in tag.names]
        last = self.chosen
        if mine:
            tag = min(mine, key=lambda one: math.dist(one.pose.translation, last.translation) if last else one.away)
            self.chosen = tag.pose
            x, y, up = rotate(tag.pose.rotation, (0.0, 0.0, 1.0))
            is_square = tag.score >= SQUARE and abs(up) < math.sin(math.radians(60))  # one that lies has no normal
            if not is_square and (base := self.bound["base"].now()) is not None:
                x, y = base.x - tag.pose.translation[0], base.y - tag.pose.translation[1]
            place = Pose2(*tag.pose.translation[:2], math.atan2(y, x))
            self.docking.see(place, tag.away, self.now, is_square=is_square)

    def step(self, dt: float) -> None:
        """Drive for one cycle, and end the goal if it is over."""
        goal, config = self.dock.current, self.config
        if goal is not self.goal:
            if goal is None:
                self.drive(AT_REST)
            self.goal, self.docking, self.chosen = goal, None, None
        if goal is None:
            return
        if goal.cancel_requested:
            self.drive(AT_REST)
            goal.canceled()
            return
        if self.docking is None:
            request = goal.request
            settings = DockingSettings(
                request.distance or config.distance,
                config.room,
                config.speed,
                config.slow,
                config.turn_rate,
                tolerance=config.tolerance,
                heading_tolerance=config.turn_tolerance,
                patience=request.patience or config.patience,
            )
            self.docking = Docking(settings, self.now)
        self.take_tags()
        trouble = self.trouble(SILENCE)
        self.status(Level.WARN if trouble else Level.OK, trouble or str(self.docking.state))
        if (base := self.bound["base"].now()) is None:
            self.drive(AT_REST)
            return
        velocity = self.docking.update(base, self.now, dt)
        self.drive(AT_REST if self.silent > SILENCE else velocity)
        self.judge(goal, self.docking, base, trouble)

    def judge(self, goal: ServedDock, docking: Docking, base: Pose2, trouble: str) -> None:
        """End a goal that is over, or tell how far it is."""
        state = docking.state
        distance, aside, angle = docking.error(base) if docking.goal else (math.nan,) * 3
        if state is DockingState.DOCKED:
            goal.succeeded(DockAt.Result(distance=distance, aside=aside, angle=angle))
        elif state in OVER:
            words = {
                DockingState.NOT_SEEN: f"'{goal.request.tag}' was seen nowhere around",
                DockingState.LOST: f"'{goal.request.tag}' was lost on the way in",
                DockingState.STUCK: "the base does not move",
                DockingState.MISSED: f"{docking.settings.tries} times it came in beside the tag",
            }
            why = f"{words[state]}: {trouble}" if trouble else words[state]
            goal.aborted(f"{state}: {why}", DockAt.Result(str(state), why, distance, aside, angle))
        else:
            left = base.distance(docking.goal) if docking.goal else math.nan
            goal.feedback(DockAt.Feedback(str(state), left))
            return
        self.drive(AT_REST)

    def hold(self) -> None:
        """Command a halt: no step follows while robot time stands still."""
        if self.goal is not None:
            self.drive(AT_REST)

    def stop(self) -> None:
        """Command a halt."""
        self.drive(AT_REST)

    def drive(self, velocity: Velocity2) -> None:
        """Publish a velocity."""
        self.cmd_vel(twist_message(velocity))
