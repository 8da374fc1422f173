"""Driving to a pose: turn to it, drive, turn to its heading; the least time that it takes; and the limits of a base."""

from __future__ import annotations

import math
from typing import Any, TypeVar

from rbxcompose import sdk
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import AT_REST, Pose2, Velocity2, wrap_angle
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.msgs.poses import twist_message

ABSURD = 2.0  # a command above this many times a limit is a fault of its sender, not a wish to go fast
LIMITS = ("max_speed", "max_turn_rate", "acceleration", "turn_acceleration")
ALIGNED = math.radians(6)  # bearing error below which the base starts to drive [rad]
ASTRAY = math.radians(45)  # bearing error above which it stops and turns on the spot [rad]
CORRECTION = 2.0  # turn rate per bearing error while driving [1/s]
AIM = 0.5  # part of a tolerance at which the base is commanded to rest; the remainder is for coming to rest
RESTING = Velocity2(0.05, math.radians(5))  # below this the base counts as at rest [m/s, rad/s]
PROGRESS = 0.02  # moving this far counts as progress [m]
PROGRESS_TURN = math.radians(2)  # and so does turning this far [rad]
C = TypeVar("C", bound=sdk.Config)


def drives(config: Any, commands: str, odometry: str, **more: sdk.Setting[float] | None) -> sdk.Drives:
    """Return what a base does with `commands`: its settings `LIMITS` limit them, and absurd ones are dropped."""
    limits = {name: sdk.Setting(getattr(config, name), name) for name in LIMITS}
    return sdk.Drives(commands, odometry, drops_above=sdk.Setting(ABSURD), **limits, **more)


class BaseDriver(sdk.Component[C]):
    """Commands a base at `cmd_vel`, up to a speed and a turn rate of its configuration."""

    cmd_vel = sdk.Out(Twist, "cmd_vel", qos="command")

    @classmethod
    def capabilities(cls, config: Any) -> tuple[sdk.Capability, ...]:
        """Declare how fast it drives, and by which acceleration if that can be set."""
        names = "speed", "turn_rate", "acceleration"
        limits: Any = (sdk.Setting(getattr(config, name), name) if hasattr(config, name) else None for name in names)
        return (*super().capabilities(config), sdk.CommandsMotion("cmd_vel", *limits))

    def drive(self, velocity: Velocity2) -> None:
        """Publish a velocity."""
        self.cmd_vel(twist_message(velocity))


@dataclass(frozen=True, slots=True)
class GoToSettings:
    """How to drive; all above zero."""

    speed: float = 0.3
    """Largest speed forwards [m/s]."""
    turn_rate: float = math.radians(60)
    """Largest turn rate [rad/s]."""
    deceleration: float = 0.5
    """Assumed deceleration [m/s^2]; a base that can do more stops nearer to the goal."""
    turn_deceleration: float = 1.5
    """Assumed deceleration of turns [rad/s^2]."""
    distance_tolerance: float = 0.05
    """How far from the goal the base may end [m]."""
    heading_tolerance: float = math.radians(3)
    """How far from the goal's heading it may end [rad]."""
    stuck_after: float = 10.0
    """A base that has hardly moved for this long is stuck [s]."""


class ProgressWatch:
    """Sees for how long a base has hardly moved."""

    def __init__(self) -> None:
        self.idle = 0.0
        """[s]"""
        self._mark: Pose2 | None = None  # where progress was last observed

    def update(self, pose: Pose2, dt: float) -> None:
        """Take a pose, `dt` [s] after the one before."""
        mark = self._mark
        if mark and mark.distance(pose) < PROGRESS and abs(wrap_angle(pose.heading - mark.heading)) < PROGRESS_TURN:
            self.idle += dt
        else:
            self._mark, self.idle = pose, 0.0


class GoToCore:
    """Where to go and what has been seen on the way; `settings` may be replaced while driving."""

    def __init__(self, settings: GoToSettings) -> None:
        self.settings = settings
        self.distance = math.inf  # straight to the goal at the last update [m]
        self._goal: Pose2 | None = None
        self._near = False
        self._aligned = False
        self._last: Pose2 | None = None
        self._progress = ProgressWatch()

    @property
    def stuck(self) -> bool:
        """Return whether the base has made no progress for `stuck_after`."""
        return self._progress.idle > self.settings.stuck_after

    def start(self, goal: Pose2) -> None:
        """Start to drive to `goal`; it replaces an earlier one."""
        self._goal = goal
        self._near = self._aligned = False
        self._progress = ProgressWatch()
        self.distance = math.inf

    def update(self, pose: Pose2, dt: float) -> tuple[Velocity2, bool]:
        """Return the velocity to command at `pose` and whether the goal is reached: within tolerances and at rest.

        `dt` is the time since the last update [s], above zero.

        Raises:
            RuntimeError: if no goal was started.
        """
        if self._goal is None:
            raise RuntimeError("update was called before start")
        resting = self._last is None or _is_resting(self._last, pose, dt)
        self._last = pose
        self._progress.update(pose, dt)
        self.distance = pose.distance(self._goal)
        if not self._is_near(resting):
            return self._drive(pose, self._goal, dt), False
        error = wrap_angle(self._goal.heading - pose.heading)
        if resting and abs(error) <= self.settings.heading_tolerance:
            return AT_REST, True
        if abs(error) <= self.settings.heading_tolerance * AIM:
            return AT_REST, False
        return self._turn(error, dt), False

    def _is_near(self, resting: bool) -> bool:
        # A moving base is driven well into the tolerance; once it is there, or rests, only leaving it counts.
        aim = 1.0 if self._near or resting else AIM
        self._near = self.distance <= self.settings.distance_tolerance * aim
        return self._near

    def _drive(self, pose: Pose2, goal: Pose2, dt: float) -> Velocity2:
        error = pose.bearing(goal)
        self._aligned = abs(error) <= (ASTRAY if self._aligned else ALIGNED)
        if not self._aligned:
            return self._turn(error, dt)
        limits = self.settings
        speed = _braking_speed(self.distance, limits.speed, limits.deceleration, dt)
        turn_rate = max(-limits.turn_rate, min(limits.turn_rate, CORRECTION * error))
        return Velocity2(speed * math.cos(error), turn_rate)

    def _turn(self, error: float, dt: float) -> Velocity2:
        rate = _braking_speed(abs(error), self.settings.turn_rate, self.settings.turn_deceleration, dt)
        return Velocity2(0.0, math.copysign(rate, error))


def _braking_speed(left: float, most: float, deceleration: float, dt: float) -> float:
    """Return the speed that allows a stop within `left`, and covers at most half of it in one `dt`."""
    return min(most, math.sqrt(2 * deceleration * left), left / (2 * dt))


def _is_resting(before: Pose2, now: Pose2, dt: float) -> bool:
    turned = abs(wrap_angle(now.heading - before.heading))
    return before.distance(now) <= RESTING.linear * dt and turned <= RESTING.angular * dt


def least_time(
    start: Pose2,
    goal: Pose2,
    settings: GoToSettings,
    *,
    acceleration: float = math.inf,
    turn_acceleration: float = math.inf,
) -> float:
    """Return the least time from a pose to a goal [s], for a base with these accelerations [m/s^2, rad/s^2].

    The start may be anywhere within the tolerances around the pose. A drive of 20 tolerances or more takes at most a
    quarter longer, if nothing is in its way.
    """

    def turn(angle: float, until: float) -> float:
        return _glide(angle, until, settings.turn_rate, settings.turn_deceleration, turn_acceleration)

    distance, tolerance = start.distance(goal), settings.distance_tolerance
    if distance <= 2 * tolerance:
        return 0.0
    bearing = math.atan2(goal.y - start.y, goal.x - start.x)
    first = abs(wrap_angle(bearing - start.heading)) - settings.heading_tolerance - math.asin(tolerance / distance)
    last = abs(wrap_angle(goal.heading - bearing)) - math.asin(2 * tolerance / distance)
    straight = _glide(distance - tolerance, tolerance * AIM, settings.speed, settings.deceleration, acceleration)
    return turn(first, ALIGNED) + straight + turn(last, settings.heading_tolerance * AIM)


def _glide(left: float, until: float, most: float, deceleration: float, acceleration: float) -> float:
    """Return the time from rest until only `until` is left of a way: speed up, keep the speed `most`, brake."""
    if left <= until:
        return 0.0
    part = 1.0 if math.isinf(acceleration) else acceleration / (acceleration + deceleration)
    peak = min(most, math.sqrt(2 * left * deceleration * part))
    brakes_at = max(peak * peak / (2 * deceleration), until)
    speeding_up = peak * peak / (2 * acceleration)
    cruising = max(0.0, left - speeding_up - brakes_at) / peak
    braking = math.sqrt(2 * min(brakes_at, left) / deceleration) - math.sqrt(2 * until / deceleration)
    return peak / acceleration + cruising + max(0.0, braking)
