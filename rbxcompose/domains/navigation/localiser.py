"""What every localiser shares: it places `odom` in `map`, tells the pose as AMCL does, and knows it over restarts."""

from __future__ import annotations

import math
from typing import ClassVar, Self, TypeVar

from rbxcompose import sdk
from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Pose2, Transform3
from rbxcompose.base.requests import Command
from rbxcompose.domains.worlds.world import MAP_FRAME
from rbxcompose.msgs import geometry_msgs as geometry
from rbxcompose.msgs.builtin_interfaces import Time
from rbxcompose.msgs.poses import message_of, pose_in, transform_message
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage

ODOM, BASE = "odom", "base_footprint"
AHEAD = 200_000_000  # [ns] for which a transform holds in advance, so that scans of now have one, as in AMCL
GIVEN = 0.5, math.radians(15)  # standard deviations of a pose that comes without any [m], [rad]
STALE = 1.0  # [s] after which a place that is not told any more cannot be driven by
NEWS = 0.2, 0.3  # [m], [rad] of motion after which the supervisor is told of the place again
RESTED = 0.3, 0.5  # [m], [rad] within which odometry is where it was
FASTEST = 2.0, 4.0  # [m/s], [rad/s] of a base
LONGEST = 5.0  # [s] for which it may have moved so
STOPPED = 0.7, math.pi  # [m], [rad] that it may have moved over a restart: it comes to rest
SLIP = 0.1  # error of odometry meanwhile [m/m], [rad/m], [rad/rad]
BEGAN_AGAIN = "the odometry of the base has begun again"
RESTARTED = "it has restarted and does not know where the robot is"
PLANAR = np.ix_((0, 1, 5), (0, 1, 5))  # x, y and heading in a covariance of six
C = TypeVar("C", bound=sdk.Config)


@dataclass(frozen=True, slots=True)
class RecallPlace(Command):
    """Where the robot was known to be in `map` and in `odom`, for a localiser that starts again."""

    about: ClassVar[str] = "localisation"
    pose: Pose2
    odometry: Pose2
    spread: float
    """Standard deviation of both coordinates [m]."""
    turn_spread: float
    """Standard deviation of the heading [rad]."""
    at: float
    """When that was, in robot time [s]."""

    def follows(self, odometry: Pose2, now: float) -> bool:
        """Return whether odometry has gone on until `now` [s]: so fast a base may be."""
        duration = min(max(0.0, now - self.at), LONGEST)
        way, turn = (rest + rate * duration for rest, rate in zip(RESTED, FASTEST, strict=True))
        return _is_within(self.odometry.inverse().compose(odometry), way, turn)

    def outlives(self, odometry: Pose2) -> bool:
        """Return whether odometry has gone on over a restart: what drove has stopped, and it is at no origin."""
        moved = self.odometry.inverse().compose(odometry)
        return _is_within(moved, *RESTED) or (_is_within(moved, *STOPPED) and not _is_within(odometry, *RESTED))

    def moved(self, odometry: Pose2, now: float) -> RecallPlace:
        """Return the place at `now` [s], by odometry that has gone on."""
        step = self.odometry.inverse().compose(odometry)
        way = math.hypot(step.x, step.y)
        spread = math.hypot(self.spread, SLIP * way, self.turn_spread * way)
        turn_spread = math.hypot(self.turn_spread, SLIP * way, SLIP * step.heading)
        return RecallPlace(self.pose.compose(step), odometry, spread, turn_spread, now)

    def is_news(self, before: RecallPlace) -> bool:
        """Return whether the robot is elsewhere, or odometry has it elsewhere."""
        pairs = (before.pose, self.pose), (before.odometry, self.odometry)
        return not all(_is_within(one.inverse().compose(other), *NEWS) for one, other in pairs)


def _is_within(step: Pose2, way: float, turn: float) -> bool:
    return math.hypot(step.x, step.y) <= way and abs(step.heading) <= turn


class Localiser(sdk.Component[C]):
    """Publishes where `odom` is in `map`, and where the robot is."""

    tf = sdk.Out(TFMessage, "/tf")
    estimate = sdk.Out(geometry.PoseWithCovarianceStamped, "amcl_pose", qos="latched")

    @classmethod
    def capabilities(cls, config: C) -> tuple[sdk.Capability, ...]:
        """Declare the frame that it places."""
        return (*super().capabilities(config), sdk.WritesFrame("tf", sdk.Setting(MAP_FRAME), sdk.Setting(ODOM)))

    def configure(self) -> None:
        """Know no place yet; who starts again is told of the last one."""
        super().configure()
        self.known: RecallPlace | None = None  # where the robot was last, without doubt
        self.seen: RecallPlace | None = None  # that, moved since, though odometry may have begun again
        self.told: RecallPlace | None = None  # what the supervisor keeps of that
        self.recalled: RecallPlace | None = None  # what is known from before a restart, until odometry is
        self.is_new = not self.context.is_again  # the start of the configuration counts
        self.doubt = "" if self.is_new else RESTARTED  # why it does not say where the robot is

    def take_over(self, old: Self) -> None:
        """Go on from what another localiser has known, which had other settings."""
        if old.known is not None or old.doubt:
            self.is_new, self.doubt, self.told = False, RESTARTED, old.told
            self.recalled = None if old.doubt else old.known

    @sdk.answers(RecallPlace)
    def recall(self, request: RecallPlace) -> str:
        """Begin where the robot was before the restart, unless that is known by now."""
        if self.doubt:
            self.recalled = self.told = request
        return "the place is known from before the restart"

    def look_back(self, odometry: Pose2) -> None:
        """Go on from what was known, if this component or the odometry has started again."""
        is_again, known, before = self.recalled is not None, self.recalled or self.known, self.recalled or self.seen
        self.recalled = None
        if known is None or before is None:
            return
        goes_on = before.outlives(odometry) if is_again else before.follows(odometry, self.now)
        if is_again or not goes_on:
            self.doubt = self.go_on_from(known.moved(odometry, self.now), None if goes_on else known.pose)
        seen = before.moved(odometry, self.now)
        if not self.doubt:
            self.keep(seen)
        else:  # it may jump once more: what was known before still counts, but not after a restart
            self.keep(None)
            self.known, self.seen = known, seen

    def go_on_from(self, since: RecallPlace, stayed: Pose2 | None) -> str:
        """Begin where the robot was, moved since; return why that is in doubt.

        If odometry has begun again, the robot may have `stayed` at a pose, or be where odometry says.
        """
        raise NotImplementedError

    def remember(self, pose: Pose2, odometry: Pose2, covariance: Array, at: float) -> None:
        """Know where the robot was in `map` and in `odom` at a time [s], with the covariance of its pose (3, 3)."""
        spread, turn_spread = np.sqrt((covariance[[0, 1], [0, 1]].max(), covariance[2, 2])).tolist()
        self.keep(RecallPlace(pose, odometry, spread, turn_spread, at))

    def keep(self, known: RecallPlace | None) -> None:
        """Know a place, or none; let the supervisor know it, too, if that is news."""
        self.known = self.seen = known
        if (self.told is None) != (known is None) or (known and self.told and known.is_news(self.told)):
            self.told = known
            self.context.repeat([known] if known else [])

    def place(self, correction: Pose2) -> None:
        """Publish where `odom` is in `map`, for now and a little later."""
        transform = transform_message(Transform3.from_pose2(correction))
        header = Header(stamp=to_time(self.stamp + AHEAD), frame_id=MAP_FRAME)
        self.tf(TFMessage(transforms=(geometry.TransformStamped(header, ODOM, transform),)))

    def publish_pose(self, pose: Pose2, covariance: Array, stamp: Time) -> None:
        """Publish where the robot was at a stamp, with the covariance of x, y [m^2] and heading [rad^2] (3, 3)."""
        spread = np.zeros((6, 6))
        spread[PLANAR] = covariance
        known = geometry.PoseWithCovariance(message_of(pose), spread.ravel())
        self.estimate(geometry.PoseWithCovarianceStamped(Header(stamp, MAP_FRAME), known))

    def given(self, message: geometry.PoseWithCovarianceStamped) -> tuple[Pose2, float, float] | None:
        """Return a pose that somebody pointed at in a viewer, and its standard deviations [m, rad].

        None if it is in another frame than `map` or not finite, with a warning.
        """
        frame, pose = message.header.frame_id, pose_in(message.pose.pose)
        is_finite = math.isfinite(pose.x + pose.y + pose.heading)
        if frame not in ("", MAP_FRAME) or not is_finite:
            wrong = f"must be given in '{MAP_FRAME}', not in '{frame}'" if is_finite else "is not finite"
            self.warn(f"an initial pose {wrong}")
            return None
        covariance = np.asarray(message.pose.covariance, float).reshape(6, 6)
        spread, turn_spread = math.sqrt(max(0.0, covariance[0, 0])), math.sqrt(max(0.0, covariance[5, 5]))
        return pose, spread or GIVEN[0], turn_spread or GIVEN[1]
