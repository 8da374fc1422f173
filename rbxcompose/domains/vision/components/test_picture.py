"""A picture that is made, in place of a camera."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.arrays import np
from rbxcompose.domains.worlds.optics import picture_message
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs.sensor_msgs import Image
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header

_BARS = np.array(
    [(192, 192, 192), (192, 192, 0), (0, 192, 192), (0, 192, 0), (192, 0, 192), (192, 0, 0), (0, 0, 192)], np.uint8
)
_LAP = 4.0  # [s] for the square from one side to the other
_SIDE = 6  # squares beside each other


class TestPictureConfig(sdk.Config):
    """How large it is, and how often it comes."""

    width: Annotated[int, Field(ge=16, le=4096)] = 320
    """Pixels of a row."""
    height: Annotated[int, Field(ge=16, le=4096)] = 240
    """Rows."""
    rate: sdk.Frequency = Field(10.0, gt=0, le=100)
    """Pictures a second."""
    topic: TopicName = "image_raw"
    """Where they are published."""
    frame: str = "camera_link"
    """The frame of the camera."""


@sdk.component("test_picture")
class TestPicture(sdk.Component[TestPictureConfig]):
    """Publishes a picture of coloured bars with a square that moves, for trying what shows pictures without a camera.

    Example:
        camera: {type: test_picture, width: 640, height: 480, topic: camera/image_raw}
    """

    process = "world"
    simulated = True
    image = sdk.Out(Image, "image_raw", qos="bulk")

    @classmethod
    def rate_of(cls, config: TestPictureConfig) -> float:
        """Return how often a picture is made [Hz]."""
        return config.rate

    @classmethod
    def ports(cls, config: TestPictureConfig) -> dict[str, sdk.Port[Any]]:
        """Return the topic of the pictures."""
        return {"image": sdk.Out(Image, config.topic, qos="bulk", rate=config.rate).named("image")}

    def configure(self) -> None:
        """Paint the bars."""
        self.bars = bars(self.config.width, self.config.height)
        self.time = 0.0

    def step(self, dt: float) -> None:
        """Move the square for `dt` [s], and publish."""
        self.time += dt
        picture = with_square(self.bars, self.time)
        header = Header(stamp=to_time(self.stamp), frame_id=self.config.frame)
        self.image(picture_message(header, picture))


def bars(width: int, height: int) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """Return coloured bars: height x width x 3, RGB."""
    columns = np.arange(width) * len(_BARS) // width
    return np.broadcast_to(_BARS[columns], (height, width, 3)).copy()


def with_square(picture: np.ndarray[Any, np.dtype[np.uint8]], time: float) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """Return the picture with a white square in its middle row that goes to and fro by `time` [s]."""
    height, width, _ = picture.shape
    side = max(2, min(width, height) // _SIDE)
    phase = (time / _LAP) % 2
    left = round((width - side) * (phase if phase <= 1 else 2 - phase))
    top = (height - side) // 2
    made = picture.copy()
    made[top : top + side, left : left + side] = 255
    return made
