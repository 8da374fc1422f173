"""Driving to a pose without a map of obstacles."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Annotated

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.geometry import AT_REST, Pose2
from rbxcompose.domains.bases.driving import BaseDriver, GoToCore, GoToSettings, least_time
from rbxcompose.msgs.geometry_msgs import PoseStamped
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.msgs.poses import message_of, pose_in
from rbxcompose.msgs.stamps import LONGEST, to_duration, to_time
from rbxcompose.msgs.std_msgs import Header

MAP = "map"
UNKNOWN = 2.0  # [s] without a position, as after a restart of the base; if there is none at all, a goal ends
LEAPS = 0.2, 0.5  # [m], [rad] by which odometry may be off what the base can have driven since its last change
ORIGIN = 0.05  # [m] from the origin of odometry: there a driver that has started again is, and hardly another
FARTHEST = 100_000.0  # [m] from the origin; no map is as large
ServedPose = sdk.ServedGoal[NavigateToPose.Goal, NavigateToPose.Result, NavigateToPose.Feedback]


class GoToConfig(sdk.Config):
    """How to drive."""

    speed: Annotated[sdk.Speed, sdk.Live()] = Field(0.3, gt=0)
    """Largest speed forwards."""
    turn_rate: Annotated[sdk.AngularSpeed, sdk.Live()] = Field(math.radians(60), gt=0)
    """Largest turn rate."""
    tolerance: Annotated[sdk.Length, sdk.Live()] = Field(0.05, gt=0)
    """How far from the goal the base may end."""
    heading_tolerance: Annotated[sdk.Angle, sdk.Live()] = Field(math.radians(3), gt=0)
    """How far from the goal's heading it may end."""


@sdk.component("go_to")
class GoTo(BaseDriver[GoToConfig]):
    """Drives to a pose in `map`: turns to it, drives straight, turns to its heading.

    Example:
        go_to: {type: go_to, speed: 0.3 m/s}
    """

    rate = 20.0
    steps_for_goals = True
    pose = sdk.Looks(source="base_footprint", target=MAP)
    odometry = sdk.Looks(source="base_footprint", target="odom")
    go_to = sdk.ServesAction(NavigateToPose, "go_to", claims="base")

    @classmethod
    def capabilities(cls, config: GoToConfig) -> tuple[sdk.Capability, ...]:
        """Declare how fast it drives and how near it comes."""
        tolerance = sdk.Setting(config.tolerance, "tolerance")
        goes = sdk.Navigates("go_to", tolerance, least_time=partial(fastest, settings_of(config)))
        return (*super().capabilities(config), goes)

    def configure(self) -> None:
        """Build the core."""
        self.core = GoToCore(settings_of(self.config))
        self.driving: object = None  # the goal that the core drives to
        self.began = 0.0  # [s], when it began to
        self.blind_since = math.inf  # [s]
        self.seen: tuple[Pose2, float] | None = None  # the newest odometry during this goal, and since when [s]

    def reconfigure(self, old: GoToConfig) -> None:
        """Continue to the current goal with the new settings."""
        self.core.settings = settings_of(self.config)

    def accept_go_to(self, goal: NavigateToPose.Goal) -> str:
        """Refuse a goal in another frame, or one that is no valid pose."""
        frame, at = goal.pose.header.frame_id, pose_in(goal.pose.pose)
        if frame not in ("", MAP):
            return f"a goal must be given in '{MAP}', not in '{frame}'"
        if not all(map(math.isfinite, (at.x, at.y, at.heading))):
            return "the goal is not a finite pose"
        return "" if math.hypot(at.x, at.y) <= FARTHEST else f"the goal is farther than {FARTHEST / 1000:g} km away"

    def step(self, dt: float) -> None:
        """Continue towards the goal."""
        goal = self.go_to.current
        if goal is None:
            self.driving, self.blind_since = None, math.inf
            return
        pose = self.pose.now(within=UNKNOWN)
        known = pose or self.pose.now()
        if pose is None and known is not None and math.isinf(self.blind_since):
            self.warn(f"no position of the base in '{MAP}' has come for {UNKNOWN:g} s: waits for the next")
        self.blind_since = min(self.blind_since, self.now) if pose is None else math.inf
        if goal.cancel_requested:
            self.drive(AT_REST)
            goal.canceled()
        elif pose is None:
            self.drive(AT_REST)
            if known is None and self.now - self.blind_since > UNKNOWN:
                self.fail(goal, f"the position of the base is unknown in '{MAP}'")
        else:
            self.follow(goal, pose, dt)

    def fail(self, goal: ServedPose, why: str) -> None:
        """End a goal that cannot be reached."""
        self.drive(AT_REST)
        goal.aborted(why, NavigateToPose.Result(error_code=1, error_msg=why))

    def follow(self, goal: ServedPose, pose: Pose2, dt: float) -> None:
        """Command the base for one cycle and report where it is and what remains."""
        wanted = pose_in(goal.request.pose.pose)
        if goal is not self.driving:
            self.driving, self.began, self.seen = goal, self.now, None
            self.core.start(wanted)
        if self.has_leapt():
            self.fail(goal, "the odometry of the base has jumped, so its position is not known any more")
            return
        velocity, done = self.core.update(pose, dt)
        self.drive(velocity)
        if done:
            goal.succeeded()
        elif self.core.stuck:
            self.fail(goal, "the base gets no closer")
        else:
            left = least_time(pose, wanted, self.core.settings)
            told = NavigateToPose.Feedback(
                current_pose=PoseStamped(Header(stamp=to_time(self.stamp), frame_id=MAP), message_of(pose)),
                navigation_time=to_duration(self.now - self.began),
                estimated_time_remaining=to_duration(min(LONGEST, left)),
                distance_remaining=self.core.distance,
            )
            goal.feedback(told)

    def has_leapt(self) -> bool:
        """Return whether odometry is where the base cannot have driven, as after a driver has begun again at zero."""
        before, pose = self.seen, self.odometry.now()
        if pose is None or (before is not None and pose == before[0]):
            return False
        self.seen = pose, self.now
        if before is None:
            return False
        step = before[0].inverse().compose(pose)
        duration = 0.0 if math.hypot(pose.x, pose.y) < ORIGIN else self.now - before[1]
        limits = LEAPS[0] + self.config.speed * duration, LEAPS[1] + self.config.turn_rate * duration
        return math.hypot(step.x, step.y) > limits[0] or abs(step.heading) > limits[1]

    def hold(self) -> None:
        """Command a halt: no step follows while robot time stands still."""
        if self.driving is not None:
            self.drive(AT_REST)


def fastest(settings: GoToSettings, start: Pose2, goal: Pose2, base: sdk.Drives | None) -> float:
    """Return the least time of a drive on a base [s]."""
    limits = (base.max_speed, base.max_turn_rate, base.acceleration, base.turn_acceleration) if base else (None,) * 4
    speed, turn_rate, acceleration, turn_acceleration = (limit.value if limit else math.inf for limit in limits)
    settings = replace(settings, speed=min(speed, settings.speed), turn_rate=min(turn_rate, settings.turn_rate))
    return least_time(start, goal, settings, acceleration=acceleration, turn_acceleration=turn_acceleration)


def settings_of(config: GoToConfig) -> GoToSettings:
    """Return the settings of the core."""
    return GoToSettings(
        speed=config.speed,
        turn_rate=config.turn_rate,
        distance_tolerance=config.tolerance,
        heading_tolerance=config.heading_tolerance,
    )
