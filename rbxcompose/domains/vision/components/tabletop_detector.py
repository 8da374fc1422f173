"""Finds what stands on a table in the clouds of a camera."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from pydantic import Field, model_validator

from rbxcompose import sdk
from rbxcompose.base.geometry import Transform3, Vector3
from rbxcompose.base.levels import Level
from rbxcompose.base.printable import plain
from rbxcompose.base.units import TIME
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs import geometry_msgs as geometry
from rbxcompose.msgs import vision_msgs as vision
from rbxcompose.msgs.poses import pose_message, pose_of
from rbxcompose.msgs.rbxcompose_msgs import FindObjects
from rbxcompose.msgs.sensor_arrays import CloudError, rows_of
from rbxcompose.msgs.sensor_msgs import PointCloud2
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.sdk.ports import BULK

if TYPE_CHECKING:
    from rbxcompose.domains.vision.tabletop import NamedThing, TabletopThing

CLOUD, SEEN, TABLE, TAGS, LOOK = "cloud", "seen", "table", "tags", "look"  # ports that depend on the configuration
RECENT = 1.0  # [s] for which a tag that was seen counts
SILENCE = 2.0  # [s] without a cloud after which diagnostics say so
SOON = 1e-3  # [s]
LATE = 1.0  # [s] after which it is no longer waited until it is known where the camera was
NONE_FOUND, TOO_FEW, NOT_STEADY = "none_found", "too_few", "not_steady"
NO_TABLE, NOT_SEEN = "no_table", "not_seen"
OUTCOMES = (NONE_FOUND, TOO_FEW, NOT_STEADY, NO_TABLE, NOT_SEEN)
FindGoal = sdk.ServedGoal[FindObjects.Goal, FindObjects.Result, FindObjects.Feedback]


class WrongFrameError(LookupError):
    """Raised for a message of another camera."""


class TabletopDetectorConfig(sdk.Config):
    """Where clouds come from, where a table may be, and when things on it count."""

    points: TopicName = "camera/points"
    """The topic of the clouds."""
    frame: str = Field("camera_optical_frame", min_length=1)
    """The frame in which they are: the optical frame of the camera."""
    level: str = Field("base_footprint", min_length=1)
    """A frame whose z is up and whose origin is on the ground; things keep their names while they stay where they are
    in it: `odom` for a robot that drives meanwhile."""
    topic: TopicName = "objects"
    """Where things are published."""
    table: TopicName = "table"
    """Where the table is published."""
    tags: TopicName | None = None
    """The `topic` of a `tag_detector` with the same frame: a thing that carries a tag has its name."""
    continuous: bool = False
    """Whether it looks all the time, and not only while `find_objects` runs."""
    rate: sdk.Frequency = Field(2.0, gt=0, le=30)
    """How many clouds a second are used."""
    patience: sdk.Time = Field(5.0, gt=0)
    """How long `find_objects` looks, unless a goal says otherwise."""
    pictures: int = Field(3, ge=1, le=100)
    """In so many pictures, one after another, the same things must be seen at the same places."""
    still: sdk.Length = Field(0.01, gt=0)
    """By how much a thing may be elsewhere in these."""
    score: float = Field(0.5, ge=0, le=1)
    """How sure a thing must be, to be found."""
    near: sdk.Length = Field(0.05, gt=0)
    """What is so near to where a thing was is that thing."""
    forget: sdk.Time = Field(60.0, gt=0)
    """What was not seen for so long has another name when it is back, unless a tag tells it."""
    lowest: sdk.Length = Field(0.3, gt=0)
    """Height of a table, at least."""
    highest: sdk.Length = 1.3
    """Height of a table, at most."""
    farthest: sdk.Length = Field(1.5, gt=0)
    """How far from the camera something counts, seen from above."""
    tallest: sdk.Length = Field(0.5, gt=0)
    """What is so far above the table is no thing on it."""
    gap: sdk.Length = Field(0.02, ge=0.005)
    """What is nearer to each other is one thing."""

    @model_validator(mode="after")
    def _has_heights(self) -> TabletopDetectorConfig:
        if self.lowest >= self.highest:
            raise ValueError("no table is between 'lowest' and 'highest': that is not above")
        return self


@sdk.component("tabletop_detector")
class TabletopDetector(sdk.Component[TabletopDetectorConfig]):
    """Publishes what stands on a table, as boxes and upright cylinders in the frame of the camera, and the table.

    A detection has a name as its id, `thing_1` or that of a tag on it, and its shape as its class: `box` or `cylinder`.
    The table is a detection `table` on a topic of its own. It looks while `find_objects` runs, which succeeds when the
    same things are seen at the same places in several pictures; so it does not take the arm for a thing.

    Example:
        table: {type: tabletop_detector, points: camera/points, frame: camera_optical_frame}
    """

    process = "vision"
    rate = 20.0
    find = sdk.ServesAction(
        FindObjects, "find_objects", outcomes=dict.fromkeys(OUTCOMES, "failure"), measures={"duration": TIME}
    )

    @classmethod
    def ports(cls, config: TabletopDetectorConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports: its own, clouds, what is seen, and where the camera is."""
        rate = max(1.0, 2 * config.rate)
        cloud = sdk.In(PointCloud2, config.points, qos="bulk", max_rate=rate, limits=BULK)
        found: dict[str, sdk.Port[Any]] = {
            CLOUD: cloud.named(CLOUD),
            SEEN: sdk.Out(vision.Detection3DArray, config.topic).named(SEEN),
            TABLE: sdk.Out(vision.Detection3DArray, config.table).named(TABLE),
            LOOK: sdk.Looks(source=config.frame, target=config.level).named(LOOK),
        }
        if config.tags is not None:
            found[TAGS] = sdk.In(vision.Detection3DArray, config.tags, may_be_silent=True).named(TAGS)
        return super().ports(config) | found

    @classmethod
    def capabilities(cls, config: TabletopDetectorConfig) -> tuple[sdk.Capability, ...]:
        """Declare the frame of its clouds, what it imports, and where things stand."""
        return (
            sdk.MeasuresIn(CLOUD, sdk.Setting(config.frame, "frame")),
            sdk.PutsThings(sdk.Setting(config.level, "level")),
            sdk.NeedsExtra(sdk.Setting("scipy"), sdk.Setting("vision")),
        )

    def configure(self) -> None:
        """See nothing yet."""
        from rbxcompose.domains.vision import tabletop

        config = self.config
        self.find_things, self.nothing_flat = tabletop.find_things, tabletop.NothingFlatError
        self.settings = tabletop.TabletopSettings(
            config.lowest, config.highest, config.farthest, config.tallest, config.gap
        )
        self.names = tabletop.ThingNames(config.near, config.forget)
        self.make_look = tabletop.SteadyLook
        self.goal: FindGoal | None = None
        self.began, self.why = 0.0, ""
        self.steady = self.make_look(config.pictures, config.still)
        self.found: list[NamedThing] = []
        self.newest: PointCloud2 | None = None  # one that is to be used
        self.newest_tags: vision.Detection3DArray | None = None
        self.came_at, self.newest_at, self.used_at, self.tags_at = self.now, -math.inf, -math.inf, -math.inf
        self.problem, self.outcome, self.said = "", NOT_SEEN, ""

    @property
    def is_looking(self) -> bool:
        """Return whether clouds are used."""
        return self.config.continuous or self.goal is not None

    def on_cloud(self, message: PointCloud2) -> None:
        """Use a cloud, if it is time for one."""
        self.came_at = self.now
        is_due = self.newest is None and self.now - self.used_at >= 1 / self.config.rate - SOON
        if self.is_looking and is_due:
            self.newest, self.newest_at = message, self.now
            self.take_cloud()

    def on_tags(self, message: vision.Detection3DArray) -> None:
        """Keep what tags are seen: where the camera was then may become known later."""
        self.tags_at, self.newest_tags = self.now, message

    def tags_seen(self) -> list[tuple[str, Vector3]]:
        """Return the names of tags that have been seen of late, and where they are in the level frame."""
        message = self.newest_tags
        if message is None or self.now - self.tags_at > RECENT:
            return []
        try:
            camera = self.camera(message.header)
        except LookupError:
            return []  # the next cloud comes soon
        return [
            (plain(f"tag_{one.id}" if one.id.isdigit() else one.id), camera.apply(pose_of(one.bbox.center).translation))
            for one in message.detections
            if one.id and any(result.hypothesis.score > 0 for result in one.results)
        ]

    def camera(self, header: Header) -> Transform3:
        """Return where the camera was in the level frame.

        Raises:
            LookupError: if that is not known yet, or the message is of another camera.
        """
        if header.frame_id.lstrip("/") not in ("", self.config.frame):
            raise WrongFrameError(f"it is in '{plain(header.frame_id)}', and expected in '{self.config.frame}'")
        found: Transform3 = self.bound[LOOK].transform(at=to_nanoseconds(header.stamp) or None)
        return found

    def take_cloud(self) -> None:
        """Use a cloud, now or as soon as it is known from where it was taken."""
        if (message := self.newest) is None:
            return
        found = None
        try:
            camera = self.camera(message.header)
            found = self.find_things(rows_of(message), camera, self.settings)
            self.problem = ""
        except (LookupError, CloudError) as error:
            if not isinstance(error, (WrongFrameError, CloudError)) and self.now - self.newest_at <= LATE:
                return
            self.problem, self.outcome = f"a cloud is not used: {error}", NOT_SEEN
        except self.nothing_flat as error:
            self.problem, self.outcome = str(error), NO_TABLE
        self.newest, self.used_at, self.found = None, self.now, []
        if found is None:
            if self.goal is not None:
                self.goal.feedback(FindObjects.Feedback(message=self.problem))
            return
        self.found = self.names.take(self.now, found.things, self.tags_seen())
        to_camera = camera.inverse()
        header = Header(message.header.stamp, self.config.frame)
        detections = tuple(detection(header, one.name, one.thing, to_camera) for one in self.found)
        self.bound[SEEN](vision.Detection3DArray(header, detections))
        self.bound[TABLE](vision.Detection3DArray(header, (detection(header, TABLE, found.table, to_camera),)))
        if self.goal is not None:
            self.judge(self.goal)

    def judge(self, goal: FindGoal) -> None:
        """End a goal if one more picture shows what it wants."""
        sure = [one for one in self.found if one.thing.confidence >= self.config.score]
        is_steady, least = self.steady.take(sure), max(1, goal.request.least)
        goal.feedback(FindObjects.Feedback(count=len(sure)))
        if is_steady and len(sure) >= least:
            names = tuple(one.name for one in sure)
            tagged = tuple(one.name for one in sure if one.is_tagged)
            untagged = tuple(one.name for one in sure if not one.is_tagged)
            self.info(f"found {', '.join(names)}")
            self.goal = None
            goal.succeeded(FindObjects.Result(count=len(sure), names=names, tagged=tagged, untagged=untagged))
        elif not sure:
            unsure = f", and nothing else is as sure as {self.config.score:g}" if self.found else ""
            self.outcome, self.why = NONE_FOUND, f"nothing stands on the table{unsure}"
        elif len(sure) < least:
            self.outcome, self.why = TOO_FEW, f"{len(sure)} of {least} things stand on the table"
        else:
            came, wanted = len(self.steady), self.config.pictures
            self.outcome = NOT_STEADY
            self.why = f"only {came} of {wanted} pictures have come"
            if came == wanted:
                self.why = f"{wanted} pictures never showed the same"

    def accept_find(self, goal: FindObjects.Goal) -> str:
        """Refuse what is no time."""
        return "" if 0.0 <= goal.duration < math.inf else "its duration is not finite, or below 0"

    def step(self, dt: float) -> None:
        """Begin with a new goal, use clouds that had to wait, and end goals whose time is over."""
        goal = self.find.current
        if goal is not self.goal:
            self.goal, self.began, self.newest, self.why = goal, self.now, None, ""
            self.outcome, self.steady = NOT_SEEN, self.make_look(self.config.pictures, self.config.still)
        self.take_cloud()
        silent = self.now - self.came_at
        no_cloud = f"no cloud on '{self.config.points}' for {silent:.0f} s" if silent > SILENCE else ""
        if (goal := self.goal) is not None:
            if goal.cancel_requested:
                self.goal = None
                goal.canceled()
            elif self.now - self.began >= (goal.request.duration or self.config.patience):
                why = no_cloud or self.problem or self.why or "no cloud could be used"
                outcome = NOT_SEEN if no_cloud else self.outcome
                self.goal = None
                goal.aborted(f"{outcome}: {why}", FindObjects.Result(outcome=outcome, message=why))
        self.report(no_cloud or self.problem, "no cloud" if no_cloud else self.problem)

    def report(self, problem: str, kind: str) -> None:
        """Tell diagnostics how it stands, and the log of a problem of a new kind."""
        if problem and kind != self.said and self.is_looking:
            self.warn(problem)
        self.said = kind
        seen = ", ".join(one.name for one in self.found) or "nothing"
        self.status(Level.WARN if problem else Level.OK, problem or f"saw {seen}" + " now" * self.is_looking)


def detection(header: Header, name: str, thing: TabletopThing, to_camera: Transform3) -> vision.Detection3D:
    """Return a thing in the level frame as a message in the frame of the camera."""
    pose = pose_message(to_camera.compose(thing.pose))
    hypothesis = vision.ObjectHypothesis(class_id=thing.kind, score=thing.confidence)
    result = vision.ObjectHypothesisWithPose(hypothesis, geometry.PoseWithCovariance(pose=pose))
    return vision.Detection3D(header, (result,), vision.BoundingBox3D(pose, geometry.Vector3(*thing.size)), name)
