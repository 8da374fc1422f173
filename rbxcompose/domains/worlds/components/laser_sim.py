"""A simulated laser scanner."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.arrays import Array, np
from rbxcompose.domains.worlds.sensors import SensorConfig, WorldSensor
from rbxcompose.manifest.fields import Farthest, TopicName
from rbxcompose.msgs.sensor_arrays import seen_from_above
from rbxcompose.msgs.sensor_msgs import LaserScan
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header


class LaserSimConfig(SensorConfig):
    """What it sees, as a scanner with a turning mirror does."""

    frame: str = "laser_link"
    """Its frame: x is ahead."""
    rays: Annotated[int, Field(ge=1, le=10_000)] = 360
    """Rays of a scan."""
    view: sdk.Angle = Field(math.tau, gt=0, le=math.tau)
    """Between the first and the last ray; 360 deg is all around."""
    nearest: sdk.Length = Field(0.1, ge=0)
    """What is nearer is not seen."""
    farthest: Farthest = Field(10.0, gt=0, le=200, validate_default=True)
    """What is farther is not seen."""
    rate: sdk.Frequency = Field(10.0, gt=0, le=100)
    """Scans a second."""
    noise: sdk.Length = Field(0.0, ge=0, le=1)
    """Standard deviation of a distance."""
    seed: int = 1
    """Of the noise: the same seed gives the same noise."""
    topic: TopicName = "scan"
    """Where scans are published."""


@sdk.component("laser_sim")
class LaserSim(WorldSensor[LaserSimConfig]):
    """A laser scanner that sees the robot's `world`: walls, and what stands or moves at its height.

    Example:
        laser: {type: laser_sim, frame: laser_link, rays: 360, farthest: 8 m}
    """

    @classmethod
    def ports(cls, config: LaserSimConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with the topic of the scans."""
        return super().ports(config) | {"scan": sdk.Out(LaserScan, config.topic, rate=config.rate).named("scan")}

    def configure(self) -> None:
        """See nothing yet."""
        super().configure()
        config = self.config
        is_round = config.view > math.tau - 1e-6  # the last ray is not the first again
        self.step_angle = config.view / max(1, config.rays if is_round else config.rays - 1)
        self.angles: Array = -config.view / 2 + self.step_angle * np.arange(config.rays, dtype=float)
        self.random = np.random.default_rng(config.seed)

    def step(self, dt: float) -> None:
        """Scan, if it is known where the scanner is."""
        if self.seen is None or (place := self.place()) is None:
            return
        config, (pose, height) = self.config, place
        angles, shares = seen_from_above(self.bound["mounting"].transform().rotation, self.angles)
        found = self.seen.distances((pose.x, pose.y), angles + pose.heading, config.farthest, self.now, height)
        found /= np.maximum(shares, 1e-9)  # of a ray straight up, nothing
        found[found >= config.farthest] = math.inf
        if config.noise:
            found += self.random.normal(0.0, config.noise, found.shape)
        found[found < config.nearest] = -math.inf  # too near, as REP 117 says it
        header = Header(stamp=to_time(self.stamp), frame_id=config.frame)
        self.tell(
            self.bound["scan"],
            LaserScan(
                header=header,
                angle_min=float(self.angles[0]),
                angle_max=float(self.angles[-1]),
                angle_increment=self.step_angle,
                scan_time=1.0 / config.rate,
                range_min=config.nearest,
                range_max=config.farthest,
                ranges=found.astype(np.float32),
            ),
        )
