"""Driving after a tag, so that it stays ahead at a distance.

The law and its figures are those of the follower in P. Goebel, ROS By Example, volume 2 (2015), chapter 10, with an
angle in place of a distance to the side, and with accelerations that a base can do.
"""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.geometry import AT_REST, Vector3, Velocity2
from rbxcompose.base.levels import Level
from rbxcompose.base.units import LENGTH, TIME
from rbxcompose.domains.bases.driving import BaseDriver
from rbxcompose.domains.vision.tag_watcher import TagWatcher, TagWatcherConfig, WatchedTag
from rbxcompose.msgs.rbxcompose_msgs import FollowTag

LOST, NOT_SEEN = "lost", "not_seen"
SOON = 0.5  # [s] without the tag, up to which it counts as seen
ASIDE = math.radians(60)  # beyond this bearing it only turns
SLOWS, EACH = 1.5, 0.1  # by which speeds are divided in each such time [s] without a target
RESTS = 0.01  # [m/s, rad/s] below which it stands
BACK = 1.5  # times as much gain backwards: what comes up is urgent
TURN_ACCELERATION = 3.0  # [rad/s^2]
ServedTag = sdk.ServedGoal[FollowTag.Goal, FollowTag.Result, FollowTag.Feedback]


class TagFollowerConfig(TagWatcherConfig):
    """What it follows, and how."""

    tag: Annotated[str, sdk.Live()] = ""
    """The name or the number of the tag that it follows unless a goal says otherwise; empty for the nearest."""
    always: Annotated[bool, sdk.Live()] = False
    """Whether it follows without a goal, too."""
    distance: Annotated[sdk.Length, sdk.Live()] = Field(0.7, gt=0)
    """From the robot's middle to the tag, unless a goal says otherwise."""
    tolerance: Annotated[sdk.Length, sdk.Live()] = Field(0.1, ge=0)
    """By which the distance may be off."""
    bearing: Annotated[sdk.Angle, sdk.Live()] = Field(math.radians(4), ge=0)
    """To either side, at which it does not turn."""
    gain: Annotated[float, Field(gt=0), sdk.Live()] = 1.0
    """Speed in m/s for each metre that the distance is off; half as much again backwards."""
    turn_gain: Annotated[float, Field(gt=0), sdk.Live()] = 2.5
    """Turn rate in rad/s for each radian of the bearing."""
    slowest: Annotated[sdk.Speed, sdk.Live()] = Field(0.05, ge=0)
    """If it moves at all."""
    speed: Annotated[sdk.Speed, sdk.Live()] = Field(0.5, gt=0)
    """Largest speed ahead."""
    back_speed: Annotated[sdk.Speed, sdk.Live()] = Field(0.3, ge=0)
    """Largest speed backwards, where it sees nothing."""
    turn_rate: Annotated[sdk.AngularSpeed, sdk.Live()] = Field(math.radians(85), gt=0)
    """Largest turn rate."""
    acceleration: Annotated[sdk.Acceleration, sdk.Live()] = Field(0.5, gt=0)
    """Acceleration, also for braking."""
    patience: Annotated[sdk.Time, sdk.Live()] = Field(3.0, gt=0)
    """Without the tag, after which a goal has failed."""
    silence: sdk.Time = Field(0.5, gt=0)
    """Without anything from the camera, after which the robot stops at once."""


def wanted(config: TagFollowerConfig, keep: float, distance: float, bearing: float) -> Velocity2:
    """Return the velocity that keeps a distance [m] to a target at another one and at a bearing [rad, to the left]."""
    turn = 0.0
    if abs(bearing) > config.bearing:
        turn = math.copysign(min(abs(bearing) * config.turn_gain, config.turn_rate), bearing)
    off = distance - keep
    if abs(off) <= config.tolerance or abs(bearing) > ASIDE:
        return Velocity2(0.0, turn)
    gain, most = (config.gain, config.speed) if off > 0 else (config.gain * BACK, config.back_speed)
    return Velocity2(math.copysign(min(max(abs(off) * gain, min(config.slowest, most)), most), off), turn)


class Following:
    """What it commands, from cycle to cycle."""

    def __init__(self) -> None:
        self.velocity = AT_REST

    def towards(self, config: TagFollowerConfig, keep: float, distance: float, bearing: float, dt: float) -> Velocity2:
        """Return the velocity `dt` [s] after the last one that keeps a distance [m] to a target at another one and at a
        bearing [rad]."""
        goal, last = wanted(config, keep, distance, bearing), self.velocity
        self.velocity = Velocity2(
            _nearer(last.linear, goal.linear, config.acceleration * dt),
            _nearer(last.angular, goal.angular, TURN_ACCELERATION * dt),
        )
        return self.velocity

    def without(self, dt: float) -> Velocity2:
        """Return the velocity `dt` [s] after the last one, without a target: slower and slower."""
        share = SLOWS ** (-dt / EACH)
        linear, angular = self.velocity.linear * share, self.velocity.angular * share
        self.velocity = Velocity2(linear, angular) if max(abs(linear), abs(angular)) > RESTS else AT_REST
        return self.velocity

    def halt(self) -> Velocity2:
        """Return that it stands, at once."""
        self.velocity = AT_REST
        return AT_REST


def _nearer(last: float, goal: float, most: float) -> float:
    return last + min(max(goal - last, -most), most)


@sdk.component("tag_follower")
class TagFollower(BaseDriver[TagFollowerConfig], TagWatcher[TagFollowerConfig]):
    """Drives so that a tag stays ahead at a distance: the book's figures, with angles for distances to the side.

    Without the tag it slows down; it stops at once if the camera is silent. It sees no obstacles: give it a mux with
    something that brakes, or follow by `navigation: {people: {tags: ...}}`, which plans ways.

    Example:
        follow_tag: {type: tag_follower, frame: camera_optical_frame, tag: box, connect: {cmd_vel: cmd_vel/tag}}
    """

    rate = 20.0
    follow = sdk.ServesAction(
        FollowTag,
        "follow_tag",
        claims="base",
        outcomes={LOST: "failure", NOT_SEEN: "failure"},
        measures={"distance": LENGTH, "patience": TIME, "duration": TIME},
    )

    def configure(self) -> None:
        """Follow nothing yet."""
        super().configure()
        self.following = Following()
        self.goal: ServedTag | None = None
        self.began = self.seen = -math.inf  # [s]
        self.target = ""  # the name of what it follows now
        self.place: Vector3 | None = None  # where that was last, in `odom` [m]
        self.drives = False

    def see(self, tags: list[WatchedTag]) -> None:
        """Note where the tag is that is meant; of several, the one that is nearest to where it was."""
        meant, last = self.meant(), self.place
        found = [
            (tag.away if last is None else math.dist(tag.pose.translation, last), tag.name, tag.pose.translation)
            for tag in tags
            if meant in tag.names or not meant
        ]
        if found:
            _, self.target, self.place = min(found)
            self.seen = self.now

    def meant(self) -> str:
        """Return the name of the tag that is to be followed; once one of several has been chosen, that one."""
        asked = self.goal.request.tag if self.goal is not None else ""
        return asked or self.config.tag or (self.target if self.now - self.seen <= self.config.patience else "")

    def step(self, dt: float) -> None:
        """Drive after the tag."""
        goal, config = self.follow.current, self.config
        if goal is not self.goal:
            self.goal, self.began, self.place, self.target, self.seen = goal, self.now, None, "", -math.inf
        self.take_tags()
        if goal is not None and goal.cancel_requested:
            self.rest()
            goal.canceled()
            self.goal = goal = None
        problem = self.trouble(config.silence)
        if goal is None and not config.always:
            if self.drives:
                self.rest()
            self.status(Level.OK, "follows nothing")
            return
        self.drives = True
        aim = self.aim()
        if self.silent > config.silence:
            self.drive(self.following.halt())
        elif aim is None or self.now - self.seen > SOON:
            self.drive(self.following.without(dt))
        else:
            asked = goal.request.distance if goal is not None else 0.0
            self.drive(self.following.towards(config, asked or config.distance, *aim, dt))
        gone = self.now - max(self.seen, self.began)
        self.status(Level.WARN if problem else Level.OK, problem or ("follows" if gone <= SOON else "has lost the tag"))
        if goal is not None:
            self.judge(goal, aim, gone, problem)

    def judge(self, goal: ServedTag, aim: tuple[float, float] | None, gone: float, problem: str) -> None:
        """End a goal that is over, or tell how far it is; the tag has been `gone` for a time [s]."""
        request = goal.request
        if gone > (request.patience or self.config.patience):
            self.rest()
            outcome = LOST if self.seen > -math.inf else NOT_SEEN
            tag = self.target or self.meant() or "a tag"
            why = problem or f"'{tag}' was not seen for {gone:.1f} s"
            goal.aborted(f"{outcome}: {why}", FollowTag.Result(outcome=outcome, message=why))
            self.goal = None
        elif request.duration and self.now - self.began >= request.duration:
            self.rest()
            goal.succeeded()
            self.goal = None
        elif aim is not None:
            goal.feedback(FollowTag.Feedback(self.target, *aim))

    def accept_follow(self, goal: FollowTag.Goal) -> str:
        """Refuse what is no distance or time."""
        fine = all(0.0 <= number < math.inf for number in (goal.distance, goal.patience, goal.duration))
        return "" if fine else "its distance, patience or duration is not finite, or below 0"

    def aim(self) -> tuple[float, float] | None:
        """Return the distance [m] and the bearing [rad, to the left] of the tag from where the robot is now."""
        if self.place is None or (base := self.bound["base"].now()) is None:
            return None
        dx, dy = self.place[0] - base.x, self.place[1] - base.y
        turned = math.remainder(math.atan2(dy, dx) - base.heading, math.tau)
        return math.hypot(dx, dy), turned

    def hold(self) -> None:
        """Command a halt: no step follows while robot time stands still."""
        if self.drives:
            self.rest()

    def stop(self) -> None:
        """Command a halt."""
        self.rest()

    def rest(self) -> None:
        """Command a halt."""
        self.drives = False
        self.drive(self.following.halt())
