"""Where the robot is in its map, by tags of known places and odometry: an extended Kalman filter.

As S. Thrun, W. Burgard and D. Fox, Probabilistic Robotics (2005), section 7.4, with the place of a tag and its
direction in place of the range and the bearing of a landmark. The innovation gate is that of section 7.5.
"""

from __future__ import annotations

import math
from typing import Annotated, Self

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Pose2, Transform3, rotate, wrap_angle
from rbxcompose.base.levels import Level
from rbxcompose.domains.navigation.localiser import BEGAN_AGAIN, Localiser, RecallPlace
from rbxcompose.domains.vision.tag_watcher import SQUARE, TagWatcher, TagWatcherConfig, WatchedTag
from rbxcompose.domains.worlds.physics.solids import rotation_matrix
from rbxcompose.msgs import geometry_msgs as geometry
from rbxcompose.msgs.rbxcompose_msgs import Localise
from rbxcompose.msgs.stamps import to_time

NOT_SEEN = "not_seen"
WAY, WAY_TURN, TURN = 0.05, 0.05, 0.05  # errors of odometry [m/m], [rad/m], [rad/rad]
ERROR, TURN_ERROR = 0.01, math.radians(1.5)  # [m], [rad] that a tag is elsewhere than its place says
GATE = {2: 13.8, 3: 16.3}  # squared Mahalanobis distances that 999 of 1000 keep, by the number of values
SURE = 5  # pictures that agree on another place, after which the robot is there
AGREE, TURN_AGREE = 0.3, 0.3  # [m], [rad] between places that agree
UNKNOWN = 1e3  # variance of what is not known
ENOUGH, AROUND, PAUSE = 5, 1.15 * math.tau, 0.5  # tags that agree; [rad] that it turns; [s] that it looks at a tag
ODD = 3  # tags, one after the other, that are not where they should be, from which on diagnostics warn
UNSURE = 0.5  # [m] of error from which on diagnostics warn
ServedLocalise = sdk.ServedGoal[Localise.Goal, Localise.Result, Localise.Feedback]
LYING = math.sin(math.radians(60))  # upwards part of the direction out of a tag, from which on it shows no heading


class TagLocalisationConfig(TagWatcherConfig):
    """Where tags are, and what it starts from."""

    tags: dict[str, tuple[float, float, float]]
    """Places of tags and boards by name: x, y [m] and the direction [rad] in which each faces, in `map`."""
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where the robot probably is at first: x, y [m] and heading [rad] in `map`."""
    spread: sdk.Length = Field(0.2, ge=0)
    """Standard deviation of both coordinates of the start."""
    turn_spread: sdk.Angle = Field(math.radians(10), ge=0)
    """Standard deviation of its heading."""
    anywhere: bool = False
    """Whether it may be anywhere at first: then it is nowhere until a tag is seen."""
    turn_rate: Annotated[sdk.AngularSpeed, sdk.Live()] = Field(math.radians(40), gt=0)
    """How fast it turns to see tags."""


@dataclass(frozen=True, slots=True, eq=False)
class PlacedTag:
    """A tag as it was seen."""

    name: str
    pose: Pose2
    """Its place in the frame of the robot, and the direction out of it."""
    covariance: Array
    """Of x, y [m^2] and direction [rad^2] (3, 3)."""
    is_square: bool = True
    """Whether it is known how it is turned."""


class TagFilter:
    """The pose of a robot in `map`; unknown until a tag was seen squarely, unless it starts somewhere."""

    def __init__(self, tags: dict[str, Pose2]) -> None:
        """Know where tags are in `map`, with the direction out of each."""
        self.tags = tags
        self.pose: Pose2 | None = None
        self.covariance: Array = np.eye(3) * UNKNOWN
        self.rejected = 0
        """Tags that were not where they should be, one after the other."""
        self._odometry: Pose2 | None = None
        self._elsewhere: Pose2 | None = None  # where those have the robot

    @property
    def correction(self) -> Pose2 | None:
        """Return where `odom` is in `map`."""
        if self.pose is None or self._odometry is None:
            return None
        return self.pose.compose(self._odometry.inverse())

    @property
    def error(self) -> float:
        """Return the standard deviation of the place [m]."""
        return math.sqrt(float(np.linalg.eigvalsh(self.covariance[:2, :2])[-1]))

    def start(self, pose: Pose2, spread: float, turn_spread: float) -> None:
        """Begin around a pose, with standard deviations [m, rad]."""
        self.pose, self.covariance = pose, np.diag((spread**2, spread**2, turn_spread**2))
        self.rejected, self._elsewhere = 0, None

    def move(self, odometry: Pose2) -> None:
        """Take where odometry has the robot."""
        before, self._odometry = self._odometry, odometry
        if before is None:
            return
        step = before.inverse().compose(odometry)
        if self._elsewhere is not None:
            self._elsewhere = self._elsewhere.compose(step)
        if self.pose is None:
            return
        way = math.hypot(step.x, step.y)
        cos, sin = math.cos(self.pose.heading), math.sin(self.pose.heading)
        slope = np.eye(3)
        slope[0, 2], slope[1, 2] = -sin * step.x - cos * step.y, cos * step.x - sin * step.y
        spread = (WAY * way) ** 2
        turned = (WAY_TURN * way) ** 2 + (TURN * step.heading) ** 2
        self.covariance = slope @ self.covariance @ slope.T + np.diag((spread, spread, turned))
        self.pose = self.pose.compose(step)

    def see(self, seen: PlacedTag) -> bool:
        """Take a tag that is seen from where odometry has the robot; return whether it is where it should be."""
        if (tag := self.tags.get(seen.name)) is None:
            return False
        noise = seen.covariance + np.diag((ERROR**2, ERROR**2, TURN_ERROR**2))
        if self.pose is None:
            if seen.is_square:
                self._begin(tag, seen, noise)
            return seen.is_square
        cos, sin = math.cos(self.pose.heading), math.sin(self.pose.heading)
        dx, dy = tag.x - self.pose.x, tag.y - self.pose.y
        expected = np.array((cos * dx + sin * dy, cos * dy - sin * dx, tag.heading - self.pose.heading))
        slope = np.array(((-cos, -sin, expected[1]), (sin, -cos, -expected[0]), (0.0, 0.0, -1.0)))
        error = np.array((seen.pose.x, seen.pose.y, seen.pose.heading)) - expected
        error[2] = wrap_angle(error[2])
        known = 3 if seen.is_square else 2
        error, slope, noise = error[:known], slope[:known], noise[:known, :known]
        spread = slope @ self.covariance @ slope.T + noise
        if float(error @ np.linalg.solve(spread, error)) > GATE[known]:
            self._doubt(tag, seen, noise)
            return False
        gain = self.covariance @ slope.T @ np.linalg.inv(spread)
        x, y, heading = (gain @ error).tolist()
        self.pose = Pose2(self.pose.x + x, self.pose.y + y, wrap_angle(self.pose.heading + heading))
        self.covariance = (np.eye(3) - gain @ slope) @ self.covariance
        self.covariance = (self.covariance + self.covariance.T) / 2
        self.rejected, self._elsewhere = 0, None
        return True

    def _begin(self, tag: Pose2, seen: PlacedTag, noise: Array) -> None:
        """Be where a tag has the robot: what is not known of the tag, is not known of the robot."""
        pose = tag.compose(seen.pose.inverse())
        cos, sin = math.cos(pose.heading), math.sin(pose.heading)
        x, y = seen.pose.x, seen.pose.y
        # The robot is at the tag, less its place turned by a heading that is as wrong as the direction of the tag.
        slope = np.array(((-cos, sin, -sin * x - cos * y), (-sin, -cos, cos * x - sin * y), (0.0, 0.0, -1.0)))
        self.pose, self.covariance = pose, slope @ noise @ slope.T
        self.rejected, self._elsewhere = 0, None

    def _doubt(self, tag: Pose2, seen: PlacedTag, noise: Array) -> None:
        """Count tags that have the robot at one place which is another than believed, and go there after a few."""
        self.rejected += 1
        if not seen.is_square:
            return
        there, last = tag.compose(seen.pose.inverse()), self._elsewhere
        self._elsewhere = there
        if last is None or last.distance(there) > AGREE or abs(wrap_angle(last.heading - there.heading)) > TURN_AGREE:
            self.rejected = 1
        elif self.rejected >= SURE:
            self._begin(tag, seen, noise)


@sdk.component("tag_localisation")
class TagLocalisation(Localiser[TagLocalisationConfig], TagWatcher[TagLocalisationConfig]):
    """Finds the robot in its map by tags of known places, and publishes where `odom` is in `map`.

    Between tags it goes by odometry. Who has carried it elsewhere need not say so: after a few pictures it knows. The
    skill `localise` turns on the spot until the place is known.

    Example:
        localisation: {type: tag_localisation, tags: {dock: [1.0, 0.0, 1.57]}}
    """

    made_by = "The section `navigation` runs it."
    rate = 10.0
    initialpose = sdk.In(
        geometry.PoseWithCovarianceStamped, "initialpose", qos="event", is_open=True, may_be_silent=True
    )

    cmd_vel = sdk.Out(geometry.Twist, "cmd_vel", qos="command")
    localise = sdk.ServesAction(Localise, "localise", claims="base", outcomes={NOT_SEEN: "failure"})

    @classmethod
    def capabilities(cls, config: TagLocalisationConfig) -> tuple[sdk.Capability, ...]:
        """Declare the frame that it places, and how fast it turns."""
        turns = sdk.CommandsMotion("cmd_vel", None, sdk.Setting(config.turn_rate, "turn_rate"))
        return (*super().capabilities(config), turns)

    def configure(self) -> None:
        """Begin at the start, if there is one."""
        super().configure()
        config = self.config
        self.filter = TagFilter({name: Pose2(*place) for name, place in config.tags.items()})
        self.recognised = -math.inf  # when a tag was where it should be last [s]
        self.agreed = 0  # tags that were, since a goal began
        self.goal: ServedLocalise | None = None
        self.turned = 0.0  # since then [rad]
        if self.is_new and not config.anywhere:
            self.filter.start(Pose2(*config.start), config.spread, config.turn_spread)

    def take_over(self, old: Self) -> None:
        """Go on from where the one before knew the robot to be."""
        super().take_over(old)
        if not self.is_new:
            self.filter.pose = None

    def go_on_from(self, since: RecallPlace, stayed: Pose2 | None) -> str:
        """Begin where the robot was, moved since; where it may have stayed, it is nowhere until a tag is seen."""
        self.filter.move(since.odometry)
        if stayed is None:
            self.filter.start(since.pose, since.spread, since.turn_spread)
            return ""
        self.filter.pose = None
        return BEGAN_AGAIN

    def on_initialpose(self, message: geometry.PoseWithCovarianceStamped) -> None:
        """Begin again at a pose that somebody pointed at in a viewer."""
        if (given := self.given(message)) is not None:
            self.filter.start(*given)
            self.recalled = None

    def see(self, tags: list[WatchedTag]) -> None:
        """Take the tags of a picture, from where the robot was when it was taken."""
        if not tags:
            return
        self.filter.move(self.base_then)
        for tag in tags:
            if tag.name in self.filter.tags and self.filter.see(placed(tag, self.base_then)):
                self.recognised = self.now
                self.agreed += 1
        if (pose := self.filter.pose) is not None:
            self.publish_pose(pose, self.filter.covariance, to_time(self.stamp))

    def step(self, dt: float) -> None:
        """Publish where `odom` is in `map`, and report how well that is known."""
        if (base := self.bound["base"].now()) is not None:
            self.look_back(base)
        self.take_tags()
        if base is not None:
            self.filter.move(base)
            if self.filter.pose is not None:
                self.doubt = ""
                self.remember(self.filter.pose, base, self.filter.covariance, self.now)
        if (correction := self.filter.correction) is not None:
            self.place(correction)
        self.status(*self.state())
        self.look_around(dt)

    def look_around(self, dt: float) -> None:
        """Turn on the spot until tags agree on where the robot is, if that is wanted."""
        goal = self.localise.current
        if goal is not self.goal:
            self.goal, self.agreed, self.turned = goal, 0, 0.0
            self.turn(0.0)
        if goal is None:
            return
        if goal.cancel_requested:
            self.turn(0.0)
            goal.canceled()
        elif self.agreed >= ENOUGH:
            self.turn(0.0)
            goal.succeeded()
        elif self.turned > AROUND:
            self.turn(0.0)
            trouble = self.trouble(UNSURE * 4)
            why = f"no tag of a known place was seen around{f': {trouble}' if trouble else ''}"
            goal.aborted(f"{NOT_SEEN}: {why}", Localise.Result(outcome=NOT_SEEN, message=why))
        else:
            rate = goal.request.turn_rate or self.config.turn_rate
            self.turned += abs(rate) * dt
            self.turn(rate if self.now - self.recognised > PAUSE else 0.0)  # a tag in view is looked at
            goal.feedback(Localise.Feedback(turned=self.turned))

    def accept_localise(self, goal: Localise.Goal) -> str:
        """Refuse what is no turn rate."""
        return "" if math.isfinite(goal.turn_rate) else "its turn rate is not finite"

    def hold(self) -> None:
        """Command a halt: no step follows while robot time stands still."""
        if self.goal is not None:
            self.turn(0.0)

    def stop(self) -> None:
        """Command a halt."""
        self.turn(0.0)

    def turn(self, rate: float) -> None:
        """Publish a turn rate [rad/s]."""
        self.cmd_vel(geometry.Twist(angular=geometry.Vector3(z=rate)))

    def state(self) -> tuple[Level, str]:
        """Return how well it is known where the robot is."""
        trouble = self.trouble(UNSURE * 4)
        if self.filter.pose is None:
            unseen = trouble or "no tag of a known place has been seen yet"
            return Level.WARN, f"{self.doubt}: {unseen}" if self.doubt else unseen
        seen = self.now - self.recognised
        last = f"a tag was seen {seen:.0f} s ago" if seen < math.inf else "no tag has been seen yet"
        words = f"{last}, known to {self.filter.error:.2f} m"
        is_odd = self.filter.rejected >= ODD
        if is_odd:
            words = f"{self.filter.rejected} tags, one after the other, are not where they should be; {words}"
        is_well = self.filter.error < UNSURE and not is_odd and not trouble
        return (Level.OK if is_well else Level.WARN), f"{trouble}; {words}" if trouble else words


def placed(tag: WatchedTag, base: Pose2) -> PlacedTag:
    """Return a tag as it is seen from the robot at a pose in `odom`, from above."""
    at = Transform3.from_pose2(base).inverse().compose(tag.pose)
    x, y, up = rotate(at.rotation, (0.0, 0.0, 1.0))
    # Position and small turns are about the axes of the camera; of the latter, that about the vertical counts.
    turned = rotation_matrix(Transform3.from_pose2(base).inverse().compose(tag.camera).rotation)
    into = np.zeros((3, 6))
    into[:2, :3], into[2, 3:] = turned[:2], turned[2]
    covariance = into @ tag.covariance @ into.T
    pose = Pose2(at.translation[0], at.translation[1], math.atan2(y, x))
    return PlacedTag(tag.name, pose, covariance, tag.score >= SQUARE and abs(up) < LYING)
