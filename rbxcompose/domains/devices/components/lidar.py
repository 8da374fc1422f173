"""A laser scanner at a serial port."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.config import BitRate
from rbxcompose.base.levels import Level
from rbxcompose.domains.devices.serial_sensor import SerialConfig, SerialSensor
from rbxcompose.domains.devices.turning_lidar import LidarReader, TurnMaker, WholeTurn
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs.sensor_msgs import LaserScan
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header

_SLOWEST = 5.0  # [Hz] of turns; it is made for 10


class LidarConfig(SerialConfig):
    """Which scanner, and what of its scans counts."""

    baud: Annotated[BitRate, Field(gt=0)] = 230400
    """Bits per second."""
    frame: str = "laser_link"
    """Its frame: x is ahead, where its angle is 0."""
    rays: Annotated[int, Field(ge=90, le=450)] = 360
    """Rays of a scan; it measures some 450 times a turn."""
    nearest: sdk.Length = Field(0.02, ge=0)
    """What is nearer is not measured."""
    farthest: sdk.Length = Field(12.0, gt=0, le=50)
    """What is farther counts as no echo."""
    topic: TopicName = "scan"
    """Where scans are published."""


@sdk.component("lidar")
class Lidar(SerialSensor[LidarConfig]):
    """Publishes the scans of a laser scanner of the family LD06, LD19 and STL-19, as `laser_sim` does simulated ones.

    A ray without an echo is infinite; where a packet was lost, it is NaN. The stamp is that of the middle of a turn.

    Example:
        lidar: {type: lidar, port: /dev/ttyUSB0, frame: laser_link}
    """

    what = "the scanner"

    @classmethod
    def ports(cls, config: LidarConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with the topic of the scans."""
        return super().ports(config) | {"scan": sdk.Out(LaserScan, config.topic, rate=_SLOWEST).named("scan")}

    def configure(self) -> None:
        """Have no scan yet."""
        super().configure()
        config = self.config
        self.packets = LidarReader(self.faults)
        self.turns = TurnMaker(config.rays, config.nearest, config.farthest)
        self.duration = 0.0  # [s] of the last turn

    def begin(self) -> None:
        """Begin with the next whole turn."""
        self.packets.forget()
        self.turns.forget()

    def take(self, data: bytes) -> None:
        """Publish the turns that are whole."""
        for packet in self.packets.feed(data):
            self.understood()
            for turn in self.turns.add(packet):
                self.duration = turn.duration
                self.publish(turn)

    def publish(self, turn: WholeTurn) -> None:
        """Publish a turn."""
        config, step = self.config, math.tau / self.config.rays
        stamp = self.stamp - round(turn.duration / 2 * 1e9)
        self.bound["scan"](
            LaserScan(
                header=Header(stamp=to_time(max(stamp, 0)), frame_id=config.frame),
                angle_min=-math.pi,
                angle_max=math.pi - step,
                angle_increment=step,
                scan_time=turn.duration,
                range_min=config.nearest,
                range_max=config.farthest,
                ranges=turn.ranges,
                intensities=turn.strengths,
            )
        )

    def state(self) -> tuple[Level, str]:
        """Return how fast it turns."""
        if not self.duration:
            return Level.WARN, "no whole turn yet"
        turns = 1.0 / self.duration
        return Level.OK if turns >= _SLOWEST else Level.WARN, f"{turns:.0f} turns a second"
