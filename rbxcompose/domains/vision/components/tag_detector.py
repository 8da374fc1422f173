"""Finds tags in the pictures of a camera."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from rbxcompose import sdk
from rbxcompose.base.arrays import Array
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3, Vector3
from rbxcompose.base.levels import Level
from rbxcompose.domains.vision.sections.tags import KnownTags
from rbxcompose.domains.vision.tags import SeenTag, TagFinder, board_pose
from rbxcompose.domains.worlds.optics import Intrinsics
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs import geometry_msgs as geometry
from rbxcompose.msgs import vision_msgs as vision
from rbxcompose.msgs.builtin_interfaces import Time
from rbxcompose.msgs.poses import pose_message, transform_message
from rbxcompose.msgs.sensor_arrays import WrongPictureError, grey
from rbxcompose.msgs.sensor_msgs import CameraInfo, Image
from rbxcompose.msgs.stamps import to_nanoseconds, to_time
from rbxcompose.msgs.std_msgs import Header, String
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.sdk.ports import BULK

THICK = 0.001  # of the box that stands for a tag [m]
SILENCE = 2.0  # [s] without a picture after which diagnostics say so
AHEAD = 0.5  # [s] a picture of a time so far in the future has a wrong clock
FRAME = "tag_"  # begins the frame of a tag with a name


class TagDetectorConfig(KnownTags):
    """Where the pictures come from, and what is known about the tags."""

    image: TopicName = "image_raw"
    """The topic of the pictures."""
    info: TopicName = "camera_info"
    """The topic of the camera's calibration."""
    frame: str = "camera_optical_frame"
    """The optical frame of the camera: z is ahead, x to the right of the picture."""
    topic: TopicName = "tags"
    """Where what is seen is published."""


@dataclass(frozen=True)
class Sight:
    """A tag or a board that was seen, with its pose in the optical frame if that is known."""

    names: tuple[str, ...]
    """First that by which it is known; a tag with a name has its number, too."""
    size: float
    pose: Transform3 | None
    covariance: Array | None
    doubt: float = 0.0

    @property
    def name(self) -> str:
        """Return the name by which it is known."""
        return self.names[0]


@sdk.component("tag_detector")
class TagDetector(sdk.Component[TagDetectorConfig]):
    """Publishes which tags and boards a camera sees, and where: as detections, and as transforms of those with a name.

    A detection has the name of the tag, or its number; one with a name has both as its results. Its score falls when
    the tag might as well be mirrored, as small ones are from afar.

    Example:
        finder: {type: tag_detector, frame: camera_optical_frame, size: 12 cm, names: {box: 7}}
    """

    process = "vision"
    rate = 1.0
    tf = sdk.Out(TFMessage, "/tf")
    nearest = sdk.Out(String, "nearest_tag")

    @classmethod
    def ports(cls, config: TagDetectorConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with the topics of its camera."""
        return super().ports(config) | {
            "image": sdk.In(Image, config.image, qos="bulk", limits=BULK).named("image"),
            "info": sdk.In(CameraInfo, config.info).named("info"),
            "seen": sdk.Out(vision.Detection3DArray, config.topic).named("seen"),
        }

    @classmethod
    def capabilities(cls, config: TagDetectorConfig) -> tuple[sdk.Capability, ...]:
        """Declare what it needs, and the frames that it places and measures in."""
        frame = sdk.Setting(config.frame, "frame")
        frames = [
            sdk.WritesFrame("tf", frame, sdk.Setting(f"{FRAME}{name}"), needs_parent=True)
            for name in (*config.names, *config.boards)
        ]
        return (sdk.NeedsExtra(sdk.Setting("cv2"), sdk.Setting("vision")), sdk.MeasuresIn("seen", frame), *frames)

    def configure(self) -> None:
        """Know no camera yet."""
        config = self.config
        self.names = {number: name for name, number in config.names.items()}
        self.sizes = {config.names[name]: size for name, size in config.sizes.items()}
        self.finder = TagFinder(config.family, config.size, self.sizes)
        self.boards = {name: board.places for name, board in config.boards.items()}
        self.camera: Intrinsics | None = None
        self.problem, self.camera_problem = "", "no camera_info has come"
        self.seen_at, self.said = self.now, ""
        self.places: dict[str, Vector3] = {}  # where tags with a name were last, before the camera

    def on_info(self, message: CameraInfo) -> None:
        """Know the camera."""
        try:
            self.camera, self.camera_problem = Intrinsics.of_message(message), ""
        except ValueError as error:
            self.camera, self.camera_problem = None, str(error)

    def on_image(self, message: Image) -> None:
        """Find the tags of a picture, and publish where they are."""
        self.seen_at = self.now
        try:
            picture = grey(message)
        except WrongPictureError as error:
            self.problem = str(error)
            return
        camera, self.problem = self.camera, self.camera_problem
        if camera is not None and (camera.height, camera.width) != picture.shape:
            size = f"{message.width} x {message.height}"
            self.problem = f"pictures are {size}, and camera_info is of {camera.width} x {camera.height}"
            camera = None
        found = self.finder.find(picture, camera)
        header = Header(stamp=self.stamp_of(message), frame_id=message.header.frame_id or self.config.frame)
        seen = [self.sight(tag) for tag in found]
        if camera is not None:
            seen += self.seen_boards(found, camera)
        self.bound["seen"](vision.Detection3DArray(header, tuple(self.detection(header, one) for one in seen)))
        placed = self.placed(seen)
        if placed and not self.is_ahead(header):
            transforms = [
                geometry.TransformStamped(header, f"{FRAME}{name}", transform_message(pose))
                for name, pose in placed.items()
            ]
            self.tf(TFMessage(transforms=tuple(transforms)))
        near = min(((math.hypot(*one.pose.translation), one.name) for one in seen if one.pose), default=(0.0, ""))
        self.nearest(String(data=near[1]))

    def stamp_of(self, message: Image) -> Time:
        """Return when a picture was taken; one that does not say it was taken now."""
        return message.header.stamp if to_nanoseconds(message.header.stamp) else to_time(self.stamp)

    def is_ahead(self, header: Header) -> bool:
        """Tell whether a picture is of the future: nobody could use transforms of that time."""
        ahead = (to_nanoseconds(header.stamp) - self.stamp) / 1e9
        if ahead > AHEAD:
            self.problem = f"pictures are stamped {ahead:.1f} s in the future: is the camera's clock right?"
        return ahead > AHEAD

    def placed(self, seen: Sequence[Sight]) -> dict[str, Transform3]:
        """Return the poses of tags and boards with names.

        Of two with one name, the one that is nearer to where that was last is meant, at first the nearer one.
        """
        found: dict[str, Transform3] = {}
        for one in seen:
            if one.pose is None or not (one.name in self.boards or one.name in self.config.names):
                continue
            if one.name in found:
                self.problem = f"the tag '{one.name}' is seen twice"
            last = self.places.get(one.name, (0.0, 0.0, 0.0))
            known = found.setdefault(one.name, one.pose)
            found[one.name] = min(known, one.pose, key=lambda pose: math.dist(pose.translation, last))
        self.places |= {name: pose.translation for name, pose in found.items()}
        return found

    def sight(self, tag: SeenTag) -> Sight:
        """Return a tag with its name and its size."""
        number, size = str(tag.number), self.size_of(tag.number) or THICK
        names = (self.names[tag.number], number) if tag.number in self.names else (number,)
        return Sight(names, size, tag.pose, tag.covariance, tag.doubt)

    def size_of(self, number: int) -> float | None:
        """Return the side of a tag [m], None if that is not known."""
        return self.sizes.get(number, self.config.size)

    def seen_boards(self, found: Sequence[SeenTag], camera: Intrinsics) -> list[Sight]:
        """Return the boards of which tags were found."""
        sizes = {tag.number: size for tag in found if (size := self.size_of(tag.number)) is not None}
        seen = []
        for name, places in self.boards.items():
            placed = board_pose([tag for tag in found if tag.number in sizes], places, sizes, camera)
            if placed is not None:
                seen.append(Sight((name,), THICK, *placed))
        return seen

    def detection(self, header: Header, one: Sight) -> vision.Detection3D:
        """Return what was seen as a message; without a pose, its score is 0."""
        pose = geometry.PoseWithCovariance()
        box = vision.BoundingBox3D()
        if one.pose is not None and one.covariance is not None:
            pose = geometry.PoseWithCovariance(pose_message(one.pose), one.covariance.ravel())
            box = vision.BoundingBox3D(pose.pose, geometry.Vector3(one.size, one.size, THICK))
        score = 0.0 if one.pose is None else 1.0 - one.doubt
        results = [
            vision.ObjectHypothesisWithPose(vision.ObjectHypothesis(class_id=name, score=score), pose)
            for name in one.names
        ]
        return vision.Detection3D(header, tuple(results), box, one.name)

    def step(self, dt: float) -> None:
        """Report whether pictures come, and whether they can be used."""
        silent = self.now - self.seen_at
        problem = f"no picture for {silent:.0f} s" if silent > SILENCE else self.problem
        kind = "no picture" if silent > SILENCE else problem  # how long it lasts is in diagnostics
        if kind and kind != self.said:
            self.warn(problem)
        self.said = kind
        self.status(Level.ERROR if problem else Level.OK, problem or "pictures come")
