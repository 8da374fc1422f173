"""The nearest thing in a cloud of points."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.arrays import np
from rbxcompose.base.levels import Level
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs.geometry_msgs import Point, Pose, PoseStamped
from rbxcompose.msgs.sensor_arrays import CloudError, points_of
from rbxcompose.msgs.sensor_msgs import PointCloud2
from rbxcompose.sdk.ports import BULK

AHEAD = 2  # the axis along which a camera sees


class NearestCloudConfig(sdk.Config):
    """Where it looks, in the frame of the cloud: x to the right, y down, z ahead."""

    topic: TopicName = "camera/points"
    """The cloud."""
    x: tuple[sdk.Length, sdk.Length] = (-0.3, 0.3)
    """Least and greatest x of points that count."""
    y: tuple[sdk.Length, sdk.Length] = (-0.3, 0.15)
    """Least and greatest y."""
    z: tuple[sdk.Length, sdk.Length] = (0.3, 1.0)
    """Least and greatest z."""
    deep: sdk.Length = Field(0.05, gt=0)
    """How much deeper than its nearest point the thing counts."""
    points: int = Field(20, ge=1)
    """How many points it has at least: fewer are noise."""


@sdk.component("nearest_cloud")
class NearestCloud(sdk.Component[NearestCloudConfig]):
    """Publishes the middle of what is nearest in a cloud as a target; nothing while nothing is near.

    Example:
        nearest: {type: nearest_cloud, topic: camera/points, z: [30 cm, 1 m]}
    """

    rate = 1.0
    target = sdk.Out(PoseStamped, "target_pose", qos="command")

    @classmethod
    def ports(cls, config: NearestCloudConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with the topic of the cloud."""
        cloud: sdk.Port[Any] = sdk.In(PointCloud2, config.topic, qos="bulk", limits=BULK)
        return super().ports(config) | {"cloud": cloud.named("cloud")}

    def configure(self) -> None:
        """Have seen nothing yet."""
        self.problem = ""

    def on_cloud(self, message: PointCloud2) -> None:
        """Publish the middle of what is nearest."""
        try:
            points = points_of(message)
        except CloudError as error:
            self.problem = str(error)
            return
        self.problem = ""
        for axis, (least, most) in enumerate((self.config.x, self.config.y, self.config.z)):
            points = points[(points[:, axis] >= least) & (points[:, axis] <= most)]
        if len(points) < self.config.points:
            return
        # The nearest ones but for a few, which may be noise.
        begin = float(np.partition(points[:, AHEAD], self.config.points - 1)[self.config.points - 1])
        middle = points[points[:, AHEAD] <= begin + self.config.deep].mean(0)
        self.target(PoseStamped(message.header, Pose(Point(*middle.tolist()))))

    def step(self, dt: float) -> None:
        """Report what is wrong with the cloud."""
        self.status(Level.ERROR if self.problem else Level.OK, self.problem or "clouds can be used")
