"""A camera that Linux knows, such as one at USB."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.levels import Level
from rbxcompose.domains.vision.calibration import read_calibration
from rbxcompose.domains.worlds.optics import info_message, optical_frame, optical_link
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs.sensor_msgs import CameraInfo, Image
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.sdk import TaskStatus

if TYPE_CHECKING:
    import cv2

_AGAIN = 2.0  # [s] between two tries to open it
_NEXT_PICTURE = 1  # cv2.CAP_PROP_POS_FRAMES, which only films can set


class UsbCameraConfig(sdk.Config):
    """Which camera, and what it is asked for."""

    device: str = "/dev/video0"
    """Its file, better one of `/dev/v4l/by-id`; or that of a film, which is shown again and again."""
    width: Annotated[int, Field(ge=16, le=8192)] = 640
    """Pixels of a row; a camera that cannot takes the nearest it has."""
    height: Annotated[int, Field(ge=16, le=8192)] = 480
    """Rows."""
    rate: sdk.Frequency = Field(15.0, gt=0, le=200)
    """Pictures a second."""
    topic: TopicName = "image_raw"
    """Where they are published."""
    frame: str = "camera_link"
    """The frame of the camera: x is ahead, or z if its name ends in `optical_frame`, as REP 103 has it."""
    calibration: str = ""
    """The whole path of its calibration, by `rbxcompose camera calibrate`; with it, `camera_info` is published. The
    section `cameras` has it relative to the manifest."""
    info: TopicName = "camera_info"
    """Where that is."""
    exposure: sdk.Time = Field(0.0, ge=0, le=1)
    """For how long a picture is exposed; 0 leaves that to the camera."""


@sdk.component("usb_camera")
class UsbCamera(sdk.Component[UsbCameraConfig]):
    """Publishes the pictures of a camera at this machine; one that is unplugged is opened again when it is back.

    Example:
        camera: {type: usb_camera, device: /dev/video0, width: 640, height: 480, rate: 15 Hz}
    """

    blocking = True  # a picture comes when it comes
    process = "vision"
    image = sdk.Out(Image, "image_raw", qos="bulk")

    @classmethod
    def rate_of(cls, config: UsbCameraConfig) -> float:
        """Return how often a picture is taken [Hz]."""
        return config.rate

    @classmethod
    def ports(cls, config: UsbCameraConfig) -> dict[str, sdk.Port[Any]]:
        """Return the topic of the pictures."""
        found: dict[str, sdk.Port[Any]] = {
            "image": sdk.Out(Image, config.topic, qos="bulk", rate=config.rate).named("image")
        }
        if config.calibration:
            found["info"] = sdk.Out(CameraInfo, config.info, rate=config.rate).named("info")
        if optical_frame(config.frame) != config.frame:
            found["tf"] = sdk.Out(TFMessage, "/tf").named("tf")
        return found

    @classmethod
    def capabilities(cls, config: UsbCameraConfig) -> tuple[sdk.Capability, ...]:
        """Declare what it needs, and its optical frame."""
        extra, optical = sdk.NeedsExtra(sdk.Setting("cv2"), sdk.Setting("vision")), optical_frame(config.frame)
        if optical == config.frame:
            return (extra,)
        frame = sdk.Setting(config.frame, "frame")
        return extra, sdk.WritesFrame("tf", frame, sdk.Setting(optical), needs_parent=True)

    def configure(self) -> None:
        """Open the camera; if that fails, it is tried again."""
        self.camera: cv2.VideoCapture | None = None
        self.at_end.callback(self.close)
        file = self.config.calibration
        self.known = read_calibration(Path(file)) if file else None
        self.tried = -math.inf  # [s]
        self.state = TaskStatus(Level.STALE, "no picture yet")
        self.add_diagnostic("pictures", lambda now: self.state)
        self.open()

    def open(self) -> None:
        """Open the camera, at most every 2 s."""
        if self.now - self.tried < _AGAIN:
            return
        import cv2

        # What it writes would go past the log; what matters is in diagnostics.
        cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
        self.tried = self.now
        config, camera = self.config, cv2.VideoCapture(self.config.device)
        if not camera.isOpened():
            camera.release()
            self.fail(f"{config.device} cannot be opened")
            return
        wanted = {
            cv2.CAP_PROP_FRAME_WIDTH: config.width,
            cv2.CAP_PROP_FRAME_HEIGHT: config.height,
            cv2.CAP_PROP_FPS: config.rate,
            cv2.CAP_PROP_BUFFERSIZE: 1,  # the newest picture, not one that has waited
        }
        if config.exposure:
            wanted |= {cv2.CAP_PROP_AUTO_EXPOSURE: 1, cv2.CAP_PROP_EXPOSURE: config.exposure * 1e4}  # of V4L: 0.1 ms
        for what, value in wanted.items():
            camera.set(what, value)
        self.camera = camera

    def step(self, dt: float) -> None:
        """Take a picture and publish it."""
        if self.camera is None:
            self.open()
        if self.camera is None:
            return
        is_there, picture = self.camera.read()
        if not is_there and self.camera.set(_NEXT_PICTURE, 0):  # a film begins again
            is_there, picture = self.camera.read()
        if not is_there:
            self.close()
            self.fail(f"{self.config.device} gives no more pictures")
            return
        height, width, _ = picture.shape
        header = Header(stamp=to_time(self.stamp), frame_id=optical_frame(self.config.frame))
        self.image(Image(header, height, width, "bgr8", 0, 3 * width, picture.tobytes()))
        self.state = TaskStatus(Level.OK, f"{width} x {height}", {"device": self.config.device})
        if "tf" in self.bound:
            self.bound["tf"](optical_link(self.config.frame, header.stamp))
        if (known := self.known) is None:
            return
        if (known.width, known.height) == (width, height):
            self.bound["info"](info_message(header, known))
        else:
            size = f"{known.width} x {known.height}"
            self.state = TaskStatus(Level.ERROR, f"pictures are {width} x {height}, and the calibration is of {size}")

    def fail(self, why: str) -> None:
        """Report that there are no pictures."""
        if self.state.message != why:
            self.warn(why)
        self.state = TaskStatus(Level.ERROR, why)

    def close(self) -> None:
        """Close the camera."""
        if self.camera is not None:
            self.camera.release()
            self.camera = None
