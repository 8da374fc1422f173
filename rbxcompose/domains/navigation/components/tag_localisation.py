"""Where the robot is in its map, by tags of known places."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.geometry import Pose2, Transform3, rotate
from rbxcompose.base.levels import Level
from rbxcompose.domains.navigation.localiser import Localiser, given_pose
from rbxcompose.domains.navigation.tag_filter import PlacedTag, TagFilter
from rbxcompose.domains.vision.tag_watcher import SQUARE, TagWatcher, TagWatcherConfig, WatchedTag
from rbxcompose.domains.worlds.physics.solids import rotation_matrix
from rbxcompose.msgs import geometry_msgs as geometry
from rbxcompose.msgs.rbxcompose_msgs import Localise
from rbxcompose.msgs.stamps import to_time

NOT_SEEN = "not_seen"
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
        if not config.anywhere:
            self.filter.start(Pose2(*config.start), config.spread, config.turn_spread)

    def on_initialpose(self, message: geometry.PoseWithCovarianceStamped) -> None:
        """Begin again at a pose that somebody pointed at in a viewer."""
        pose, spread, turn_spread = given_pose(message)
        if math.isfinite(pose.x + pose.y + pose.heading):
            self.filter.start(pose, spread, turn_spread)
        else:
            self.warn("an initial pose is not finite")

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
        self.take_tags()
        if (base := self.bound["base"].now()) is not None:
            self.filter.move(base)
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
            return Level.WARN, trouble or "no tag of a known place has been seen yet"
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
