"""Finds things in the pictures of a camera with a network that the user brings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.levels import Level
from rbxcompose.domains.vision.detection import FoundThing, Network, NetworkError, fitted, things_of
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs.images import WrongPictureError, pixels
from rbxcompose.msgs.sensor_msgs import Image
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.vision_msgs import (
    BoundingBox2D,
    Detection2D,
    Detection2DArray,
    ObjectHypothesis,
    ObjectHypothesisWithPose,
    Point2D,
    Pose2D,
)
from rbxcompose.sdk.ports import BULK

SILENCE = 2.0  # [s] without a picture after which diagnostics say so


class DetectorConfig(sdk.Config):
    """The network, the camera, and what counts."""

    model: str = Field(min_length=1)
    """The whole path of the network, a file in ONNX."""
    image: TopicName = "camera/image_raw"
    """The topic of the pictures."""
    labels: list[str] = []
    """Names of its classes in their order; without any, those that the file has, or their numbers."""
    only: list[str] = []
    """The classes that count; without any, all do."""
    confidence: Annotated[sdk.Ratio, sdk.Live()] = Field(0.4, gt=0, le=1)
    """What is less sure does not count."""
    overlap: Annotated[sdk.Ratio, sdk.Live()] = Field(0.5, gt=0, le=1)
    """Of two boxes of one class that overlap by more, the surer one counts."""
    rate: sdk.Frequency = Field(5.0, gt=0, le=100)
    """How often it looks at most: at the newest picture."""
    topic: TopicName = "detections"
    """Where it tells what it finds."""


@sdk.component("detector")
class Detector(sdk.Component[DetectorConfig]):
    """Finds things in pictures by a network in ONNX, such as one of the YOLO family, and publishes their boxes.

    Example:
        detector: {type: detector, model: /opt/models/yolo.onnx, image: camera/image_raw, only: [cup, bottle]}
    """

    process = "vision"

    @classmethod
    def rate_of(cls, config: DetectorConfig) -> float:
        """Return how often it looks [Hz]."""
        return config.rate

    @classmethod
    def ports(cls, config: DetectorConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with the topic of the camera."""
        image: sdk.Port[Any] = sdk.In(Image, config.image, qos="bulk", limits=BULK)
        return super().ports(config) | {
            "image": image.named("image"),
            "found": sdk.Out(Detection2DArray, config.topic).named("found"),
        }

    @classmethod
    def capabilities(cls, config: DetectorConfig) -> tuple[sdk.Capability, ...]:
        """Declare what it needs."""
        needed = (("cv2", "vision"), ("onnxruntime", "detector"))
        return tuple(sdk.NeedsExtra(sdk.Setting(module), sdk.Setting(extra)) for module, extra in needed)

    def configure(self) -> None:
        """Load the network; if it is none, that is reported."""
        self.newest: Image | None = None  # that is not looked at yet
        self.seen_at, self.problem = self.now, ""
        self.network: Network | None = None
        try:
            self.network = Network(Path(self.config.model))
        except NetworkError as error:
            self.fail(str(error))

    def on_image(self, message: Image) -> None:
        """Keep the newest picture."""
        self.newest, self.seen_at = message, self.now

    def step(self, dt: float) -> None:
        """Look at the newest picture."""
        silent = self.now - self.seen_at
        if self.network is None:
            self.status(Level.ERROR, self.problem)
            return
        if (message := self.newest) is not None:
            self.newest, self.problem = None, self.look(self.network, message)
        problem = f"no picture for {silent:.0f} s" if silent > SILENCE else self.problem
        self.status(Level.ERROR if problem else Level.OK, problem or "looks")

    def look(self, network: Network, message: Image) -> str:
        """Publish what is in a picture; return what is wrong, or nothing."""
        try:
            picture = pixels(message)
            if picture.ndim != 3:
                return f"pictures of the encoding '{message.encoding[:40]}' have no colours"
            planes, box = fitted(picture, network.width, network.height)
            config, names = self.config, self.config.labels or network.names
            size = message.width, message.height
            found = things_of(network.answers(planes), box, names, config.confidence, config.overlap, size)
        except (WrongPictureError, NetworkError) as error:
            return str(error)
        chosen = [thing for thing in found if thing.name in config.only or not config.only]
        boxes = tuple(detection(message.header, thing) for thing in chosen)
        self.bound["found"](Detection2DArray(message.header, boxes))
        return ""

    def fail(self, why: str) -> None:
        """Report that there is no network."""
        self.problem = why
        self.warn(why)


def detection(header: Header, thing: FoundThing) -> Detection2D:
    """Return what was found as a message."""
    result = ObjectHypothesisWithPose(ObjectHypothesis(thing.name, thing.score))
    box = BoundingBox2D(Pose2D(Point2D(thing.x, thing.y)), thing.width, thing.height)
    return Detection2D(header, (result,), box, thing.name)
