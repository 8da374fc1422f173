"""A target that moves on an ellipse, for heads and arms that follow one."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.geometry import Vector3
from rbxcompose.msgs import geometry_msgs as geometry
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import ColorRGBA, Header
from rbxcompose.msgs.visualization_msgs import Marker

COLOUR, WIDE = ColorRGBA(r=1.0, g=1.0, b=0.0, a=0.8), 0.1  # of its marker; [m]


class TargetSourceConfig(sdk.Config):
    """Where the target is, and how fast it moves."""

    frame: str = "base_link"
    """The frame of its positions."""
    rate: sdk.Frequency = Field(20.0, gt=0, le=200)
    """How often it is told."""
    speed: Annotated[sdk.AngularSpeed, sdk.Live()] = Field(1.5, ge=0)
    """How fast it goes around."""
    middle: tuple[sdk.Length, sdk.Length, sdk.Length] = (0.2, 0.0, 0.7)
    """Where it is nearest and lowest: x, y and z."""
    size: tuple[sdk.Length, sdk.Length, sdk.Length] = (0.1, 0.2, 0.3)
    """How far it goes ahead, to each side, and upwards."""


@sdk.component("target_source")
class TargetSource(sdk.Component[TargetSourceConfig]):
    """Publishes a target that swings from side to side, comes nearer there, and sinks: that of the book.

    Example:
        target: {type: target_source, frame: base_link, speed: 1 rad/s}
    """

    target = sdk.Out(geometry.PoseStamped, "target_pose", qos="command")
    marker = sdk.Out(Marker, "target_marker")

    @classmethod
    def rate_of(cls, config: TargetSourceConfig) -> float:
        """Return how often it tells where it is [Hz]."""
        return config.rate

    def configure(self) -> None:
        """Begin at its middle."""
        self.angle = 0.0

    def step(self, dt: float) -> None:
        """Move on, and publish where it is."""
        self.angle = (self.angle + self.config.speed * dt) % math.tau
        header = Header(stamp=to_time(self.stamp), frame_id=self.config.frame)
        pose = geometry.Pose(geometry.Point(*on_ellipse(self.angle, self.config.middle, self.config.size)))
        self.target(geometry.PoseStamped(header, pose))
        if self.marker.is_wanted:
            scale = geometry.Vector3(WIDE, WIDE, WIDE)
            self.marker(Marker(header=header, ns="target", type=Marker.SPHERE, pose=pose, scale=scale, color=COLOUR))


def on_ellipse(angle: float, middle: Vector3, size: Vector3) -> Vector3:
    """Return where the target of the book is at an angle [rad]: x and z rise and fall with each swing of y."""
    swing = abs(math.cos(angle))
    return middle[0] + size[0] * swing, middle[1] - size[1] * math.sin(angle), middle[2] + size[2] * swing
