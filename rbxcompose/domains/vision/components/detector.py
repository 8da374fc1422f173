"""Finds things in the pictures of a camera with a network that the user brings.

Networks in ONNX of three forms are understood, which are told apart by the shapes of their answers (C classes, N
candidates): (1, N, 5 + C) with the score of a candidate before those of its classes, as YOLOv5 has it; (1, 4 + C, N),
as YOLOv8 has it; and (1, N, 6), a final answer of corners, score and class, as YOLOv10 has it.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.arrays import Bytes, Singles, np
from rbxcompose.base.config import LocalFiles
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.levels import Level
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs import vision_msgs as vision
from rbxcompose.msgs.sensor_arrays import WrongPictureError, pixels
from rbxcompose.msgs.sensor_msgs import Image
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.sdk.ports import BULK

SILENCE = 2.0  # [s] without a picture after which diagnostics say so
GREY = 114  # of what is beside a picture that is not as long as the network wants it
LARGEST = 4096  # sides of a picture that a network may want [px]


class DetectorConfig(sdk.Config):
    """The network, the camera, and what counts."""

    model: LocalFiles = Field(min_length=1)
    """The network, a file in ONNX: relative to the robot's file, or a whole path on the robot's computer."""
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


class NetworkError(ValueError):
    """Raised for a file that is no network for pictures, or whose answers are not understood."""


class AnswerForm(StrEnum):
    """What the answers of a network look like."""

    SCORED = "scored"
    """(N, 5 + C)."""
    PLAIN = "plain"
    """(4 + C, N)."""
    FINAL = "final"
    """(N, 6)."""


@dataclass(frozen=True, slots=True)
class FoundThing:
    """Something in a picture; its box is in pixels."""

    name: str
    score: float
    x: float
    """Of its middle."""
    y: float
    width: float
    height: float


@dataclass(frozen=True, slots=True)
class Letterbox:
    """How a picture is fitted into the square that a network wants."""

    scale: float
    left: int
    top: int


def fitted(picture: Bytes, width: int, height: int) -> tuple[Singles, Letterbox]:
    """Return a picture (h, w, 3) as a network wants it (1, 3, height, width), from 0 to 1, and how it was fitted."""
    import cv2

    scale = min(width / picture.shape[1], height / picture.shape[0])
    wide, high = (max(1, round(side * scale)) for side in (picture.shape[1], picture.shape[0]))
    left, top = (width - wide) // 2, (height - high) // 2
    whole = np.full((height, width, 3), GREY, np.uint8)
    whole[top : top + high, left : left + wide] = cv2.resize(picture, (wide, high), interpolation=cv2.INTER_LINEAR)
    planes = np.ascontiguousarray(whole.transpose(2, 0, 1)[None], np.float32) / np.float32(255)
    return planes, Letterbox(scale, left, top)


def form_of(shape: Sequence[int], classes: int | None) -> AnswerForm:
    """Return what answers of a shape look like, of a network with so many classes, or with an unknown number.

    Raises:
        NetworkError: if it is none of the three.
    """
    if len(shape) == 3 and shape[0] == 1:
        _, rows, columns = shape
        if columns == 6 and classes != 1:
            return AnswerForm.FINAL
        if columns > 5 and (classes is None or columns == 5 + classes) and columns < rows:
            return AnswerForm.SCORED
        if rows > 4 and (classes is None or rows == 4 + classes) and rows < columns:
            return AnswerForm.PLAIN
    told, wanted = "x".join(map(str, shape)), f" with {classes} classes" if classes else ""
    known = "1xNx(5+C), 1x(4+C)xN or 1xNx6"
    raise NetworkError(f"its answers have the shape {told}, and are understood as {known}{wanted}")


def things_of(
    answers: Singles, box: Letterbox, names: Sequence[str], confidence: float, overlap: float, size: tuple[int, int]
) -> list[FoundThing]:
    """Return what answers of a network say of a picture of a size (width, height), by their score.

    Of things of one class whose boxes overlap by more than `overlap` (intersection over union), the surest is left.

    Raises:
        NetworkError: if the answers are not understood.
    """
    import cv2

    form = form_of(answers.shape, len(names) or None)
    table = np.asarray(answers[0], np.float64)
    if form is AnswerForm.FINAL:
        corners, scores, classes = table[:, :4], table[:, 4], table[:, 5].astype(int)
        boxes = np.column_stack(((corners[:, :2] + corners[:, 2:]) / 2, corners[:, 2:] - corners[:, :2]))
    else:
        rows = table.T if form is AnswerForm.PLAIN else table
        likely = rows[:, 4:] if form is AnswerForm.PLAIN else rows[:, 5:] * rows[:, 4:5]
        boxes, classes, scores = rows[:, :4], likely.argmax(1), likely.max(1)
    with np.errstate(invalid="ignore"):
        chosen = (scores >= confidence) & np.isfinite(boxes).all(1) & (boxes[:, 2:] > 0).all(1)
    boxes, scores, classes = boxes[chosen], scores[chosen], classes[chosen]
    if not len(boxes):
        return []
    boxes = boxes - (box.left, box.top, 0, 0)
    boxes /= box.scale
    lefts = np.column_stack((boxes[:, :2] - boxes[:, 2:] / 2, boxes[:, 2:]))
    kept = cv2.dnn.NMSBoxesBatched(lefts.tolist(), scores.tolist(), classes.tolist(), confidence, overlap)
    found = []
    for index in np.ravel(np.asarray(kept, int)).tolist():
        (left, top, wide, high), number = lefts[index].tolist(), int(classes[index])
        right, bottom = min(left + wide, size[0]), min(top + high, size[1])
        left, top = max(left, 0.0), max(top, 0.0)
        if right > left and bottom > top:
            name = names[number] if 0 <= number < len(names) else str(number)
            middle = (left + right) / 2, (top + bottom) / 2
            found.append(FoundThing(name, min(float(scores[index]), 1.0), *middle, right - left, bottom - top))
    return sorted(found, key=lambda thing: -thing.score)


class Network:
    """A network of a file, with the size of the pictures that it wants."""

    def __init__(self, path: Path, threads: int = 1) -> None:
        """Load it.

        Raises:
            NetworkError: if the file is no network for pictures.
        """
        if not path.is_file():
            raise NetworkError(f"there is no file '{path}'")
        import onnxruntime

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads, options.inter_op_num_threads = threads, 1
        options.log_severity_level = 4  # what goes wrong is raised
        try:
            self._session: Any = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
        except Exception as error:  # its errors have no common class
            raise NetworkError(f"'{path.name}' is no network in ONNX: {str(error).splitlines()[0][:120]}") from error
        inputs = self._session.get_inputs()
        shape = inputs[0].shape if inputs else []
        sides = [side if isinstance(side, int) else 640 for side in shape[2:]]
        if len(inputs) != 1 or len(shape) != 4 or shape[1] != 3 or inputs[0].type != "tensor(float)":
            told = ", ".join(f"{one.name} {one.type} {one.shape}" for one in inputs)
            raise NetworkError(f"it wants {told}, and not one picture as float 1x3xHxW")
        if not all(1 <= side <= LARGEST for side in sides):
            raise NetworkError(f"it wants pictures of {sides[1]} x {sides[0]} pixels")
        self._input = inputs[0].name
        self.height, self.width = sides
        written: Mapping[str, str] = self._session.get_modelmeta().custom_metadata_map
        self.names = names_in(written.get("names", ""))
        """Of its classes, if the file has them."""

    def answers(self, planes: Singles) -> Singles:
        """Return the first answer of the network to a picture (1, 3, height, width).

        Raises:
            NetworkError: if it cannot be computed.
        """
        try:
            return np.asarray(self._session.run(None, {self._input: planes})[0], np.float32)
        except Exception as error:  # its errors have no common class
            raise NetworkError(f"the network fails: {str(error).splitlines()[0][:120]}") from error


def names_in(text: str) -> list[str]:
    """Return the names of classes as exporters write them into a file: `{0: 'cat', 1: 'dog'}`; none if it has none."""
    try:
        read = ast.literal_eval(text)
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return []
    if isinstance(read, dict) and sorted(read) == list(range(len(read))):
        read = [read[number] for number in range(len(read))]
    return [str(name) for name in read] if isinstance(read, list) else []


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
            "found": sdk.Out(vision.Detection2DArray, config.topic).named("found"),
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
            self.problem = str(error)
            self.warn(self.problem)

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
        self.bound["found"](vision.Detection2DArray(message.header, boxes))
        return ""


def detection(header: Header, thing: FoundThing) -> vision.Detection2D:
    """Return what was found as a message."""
    result = vision.ObjectHypothesisWithPose(vision.ObjectHypothesis(thing.name, thing.score))
    box = vision.BoundingBox2D(vision.Pose2D(vision.Point2D(thing.x, thing.y)), thing.width, thing.height)
    return vision.Detection2D(header, (result,), box, thing.name)
