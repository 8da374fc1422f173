"""A simulated camera, with depth if it has that."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, ValidationInfo, field_validator

from rbxcompose import sdk
from rbxcompose.base.arrays import Bytes, Singles, np
from rbxcompose.base.levels import Level
from rbxcompose.domains.worlds.optics import (
    LEAST_VIEW,
    MOST_VIEW,
    TO_OPTICAL,
    Intrinsics,
    cloud_message,
    depth_message,
    info_message,
    optical_frame,
    optical_link,
    picture_message,
)
from rbxcompose.domains.worlds.sensors import SensorConfig, WorldSensor
from rbxcompose.domains.worlds.shapes import WorldShape
from rbxcompose.manifest.fields import Farthest, TopicName
from rbxcompose.msgs.sensor_arrays import pixels
from rbxcompose.msgs.sensor_msgs import CameraInfo, Image, PointCloud2
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Empty, Header
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.sdk.ports import BULK

if TYPE_CHECKING:
    from rbxcompose.domains.worlds.view import WorldView

PICTURES = ("image", "depth", "points")
SILENCE = 5.0  # [s] without a picture of the engine after which that is reported
SIGHT = 50.0  # how far pictures show something, at least [m]
Side = Annotated[int, Field(ge=16, le=2048)]


class CameraSimConfig(SensorConfig):
    """What it sees, and how well."""

    frame: str = "camera_link"
    """Its frame: x is ahead, or z if its name ends in `optical_frame`, as REP 103 has it."""
    size: tuple[Side, Side] = (320, 240)
    """Width and height of its pictures in pixels."""
    view: sdk.Angle = Field(math.radians(60), gt=LEAST_VIEW, lt=MOST_VIEW)
    """From its left to its right edge."""
    pinhole: list[float] = Field([], max_length=4)
    """In place of the `view`, as a calibration has it: focal lengths fx and fy, and the middle cx and cy [px]."""
    distortion: list[float] = Field([], max_length=8, validate_default=True)
    """Of its lens: k1, k2, p1, p2 and k3 of the model `plumb_bob`; with k4, k5 and k6, `rational_polynomial`."""
    rate: sdk.Frequency = Field(10.0, gt=0, le=100)
    """Pictures a second, as long as somebody wants them."""
    depth: bool = False
    """Whether it measures depth."""
    cloud: bool = True
    """Whether one that measures depth also publishes it as a cloud of points."""
    nearest: sdk.Length = Field(0.3, ge=0)
    """What is nearer has no depth."""
    farthest: Farthest = Field(10.0, gt=0, le=200, validate_default=True)
    """What is farther has no depth; a physics engine draws nothing beyond 50 m."""
    noise: sdk.Length = Field(0.0, ge=0, le=1)
    """Standard deviation of a depth at 1 m; it grows with the square of the depth, as with stereo."""
    grain: Annotated[float, Field(ge=0, le=100)] = 0.0
    """Standard deviation of a colour, of 255."""
    seed: int = 1
    """Of both: the same seed gives the same noise."""
    topic: TopicName = "camera"
    """What begins its topics: `image_raw`, `camera_info`, `depth/image_raw` and `points` below it."""
    by_physics: bool = False
    """Whether a physics engine draws its pictures; with `simulator: physics`, that is the default."""

    @field_validator("pinhole")
    @classmethod
    def _has_focal_lengths(cls, pinhole: list[float]) -> list[float]:
        if pinhole and (len(pinhole) < 4 or min(pinhole[:2]) <= 0):
            raise ValueError("it is fx, fy, cx and cy, and the focal lengths are above 0")
        return pinhole

    @field_validator("distortion")
    @classmethod
    def _is_lens(cls, distortion: list[float], info: ValidationInfo) -> list[float]:
        if len(distortion) not in (0, 4, 5, 8):
            raise ValueError("a distortion has four, five or eight coefficients")
        known = {name: info.data[name] for name in ("size", "view", "pinhole") if name in info.data}
        is_known = len(known) == 3 and (distortion or known["pinhole"])
        if is_known and not _intrinsics(**known, distortion=distortion).is_lens:
            why = "the distortion is too strong for its view, or its middle is too far aside"
            raise ValueError(f"no lens bends a picture like this: {why}")
        return distortion

    @property
    def optical_frame(self) -> str:
        """Return the frame of its pictures, where z is ahead."""
        return optical_frame(self.frame)

    @property
    def intrinsics(self) -> Intrinsics:
        """Return how it maps directions to pixels."""
        return _intrinsics(self.size, self.view, self.pinhole, self.distortion)


def _intrinsics(
    size: tuple[int, int], view: float, pinhole: Sequence[float], distortion: Sequence[float]
) -> Intrinsics:
    bent = tuple(distortion)
    if not pinhole:
        return Intrinsics.of_view(*size, view, bent)
    fx, fy, cx, cy = pinhole
    return Intrinsics(*size, fx, fy, cx, cy, bent)


@sdk.component("camera_sim")
class CameraSim(WorldSensor[CameraSimConfig]):
    """A camera that sees the robot's `world`, with depth if `depth` is true.

    Topics are those of ROS's cameras: `camera/image_raw`, `camera/camera_info`, `camera/depth/image_raw` in metres,
    and `camera/points`. Pictures are made only while somebody wants them.

    Example:
        camera: {type: camera_sim, frame: camera_link, size: [320, 240], view: 60 deg, depth: true}
    """

    @classmethod
    def ports(cls, config: CameraSimConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with the topics of its pictures."""
        topic, rate = config.topic, config.rate
        found = super().ports(config) | {
            "image": sdk.Out(Image, f"{topic}/image_raw", qos="bulk", rate=rate).named("image"),
            "info": sdk.Out(CameraInfo, f"{topic}/camera_info", rate=rate).named("info"),
        }
        if config.depth:
            found["depth"] = sdk.Out(Image, f"{topic}/depth/image_raw", qos="bulk", rate=rate).named("depth")
        if config.depth and config.cloud:
            found["points"] = sdk.Out(PointCloud2, f"{topic}/points", qos="bulk", rate=rate).named("points")
        if config.by_physics:
            found["shoot"] = sdk.Out(Empty, f"physics/{topic}/shoot", qos="event").named("shoot")
            for name in ("colour", "distance"):
                drawn: sdk.Port[Any] = sdk.In(Image, f"physics/{topic}/{name}", qos="bulk", limits=BULK)
                found[name] = drawn.named(name)
        if config.optical_frame != config.frame:
            found["tf"] = sdk.Out(TFMessage, "/tf").named("tf")
        return found

    @classmethod
    def capabilities(cls, config: CameraSimConfig) -> tuple[sdk.Capability, ...]:
        """Declare what it needs, and its optical frame."""
        found: list[sdk.Capability] = [sdk.NeedsExtra(sdk.Setting("cv2"), sdk.Setting("vision"))]
        frame, optical = sdk.Setting(config.frame, "frame"), config.optical_frame
        if config.depth and config.cloud:
            found.append(sdk.MeasuresIn("points", sdk.Setting(optical)))
        if optical != config.frame:
            found.append(sdk.WritesFrame("tf", frame, sdk.Setting(optical), needs_parent=True))
        if config.by_physics:
            camera = config.intrinsics.unbent
            view = sdk.Setting((camera.width, camera.height, camera.view))
            found.append(sdk.SensesPhysics(frame, sdk.Setting(config.topic, "topic"), view))
        return tuple(found)

    def configure(self) -> None:
        """See nothing yet."""
        from rbxcompose.domains.worlds.view import Lens, WorldView

        super().configure()
        self.camera = self.config.intrinsics
        self.lens, self.make_view = Lens(self.camera), WorldView
        self.random = np.random.default_rng(self.config.seed)
        self.view: WorldView | None = None
        self.viewed: tuple[WorldShape, ...] = ()  # of which that is
        self.asked_at: float | None = None  # since when the engine is asked for pictures [s]
        self.is_blind = False
        self.wanted: set[str] = set()

    def step(self, dt: float) -> None:
        """Take a picture, if somebody wants one and it is known where the camera is."""
        config = self.config
        header = Header(stamp=to_time(self.stamp), frame_id=config.optical_frame)
        if "tf" in self.bound:
            self.bound["tf"](optical_link(config.frame, header.stamp))
        self.tell(self.bound["info"], info_message(header, self.camera))
        # Asked once for each picture: diagnostics count what nobody wants, too.
        self.wanted = {name for name in PICTURES if name in self.bound and self.bound[name].is_wanted}
        if config.by_physics:
            self.shoot()
        if not self.wanted or config.by_physics or self.seen is None or (pose := self.pose()) is None:
            return
        if self.view is None or self.viewed is not self.seen.shapes:
            self.view, self.viewed = self.make_view(self.seen), self.seen.shapes
        optical = pose if config.frame == header.frame_id else pose.compose(TO_OPTICAL)
        sight, robots = max(SIGHT, config.farthest), self.seen.robots_standing(self.now)
        seen = self.view.seen(optical, self.camera.unbent, self.now, sight, robots)
        self.show(header, seen.colours, seen.depths)

    def shoot(self) -> None:
        """Ask the engine for a picture, if somebody wants one, and report if it has drawn none for long."""
        if not self.wanted:
            self.asked_at = None
            return
        self.asked_at = self.now if self.asked_at is None else self.asked_at
        self.bound["shoot"](Empty())
        if min(self.bound["distance"].age, self.now - self.asked_at) > SILENCE:
            self.is_blind = True
            self.status(Level.WARN, f"the engine draws nothing: is '{self.config.frame}' a link of the body?")
        elif self.is_blind and self.bound["distance"].age <= SILENCE:
            self.is_blind = False
            self.status(Level.OK, "the engine draws again")

    def on_distance(self, message: Image) -> None:
        """Show what the engine has drawn: its colours have come before."""
        if (colour := self.bound["colour"].value) is None:
            return
        header = Header(stamp=message.header.stamp, frame_id=self.config.optical_frame)
        depths = np.frombuffer(message.data, "<f4").reshape(message.height, message.width)
        self.show(header, pixels(colour), depths)

    def show(self, header: Header, colours: Bytes, depths: Singles) -> None:
        """Publish what was seen without distortion as this camera shows it."""
        wanted = self.wanted
        colours, depths = self.lens.bent(colours, depths)
        if "image" in wanted:
            self.tell(self.bound["image"], picture_message(header, self.grainy(colours)))
        if wanted & {"depth", "points"}:
            depths = self.measured(depths)
            if "depth" in wanted:
                self.tell(self.bound["depth"], depth_message(header, depths))
            if "points" in wanted:
                self.tell(self.bound["points"], cloud_message(header, self.camera.rays, depths, colours))

    def grainy(self, colours: Bytes) -> Bytes:
        """Return colours with the grain of the camera."""
        if not self.config.grain:
            return colours
        noise = self.random.normal(0.0, self.config.grain, colours.shape)
        return np.clip(np.rint(colours + noise), 0, 255).astype(np.uint8)

    def measured(self, depths: Singles) -> Singles:
        """Return depths with noise; -inf is too near, and inf too far, as REP 117 says it."""
        config = self.config
        if config.noise:
            spread = np.where(np.isfinite(depths), depths, 0) ** 2  # noise of what is nowhere would be nan
            depths = depths + self.random.normal(0.0, config.noise, depths.shape).astype(np.float32) * spread
        found = np.where(depths > config.farthest, np.float32(math.inf), depths)
        return np.where(found < config.nearest, np.float32(-math.inf), found)
