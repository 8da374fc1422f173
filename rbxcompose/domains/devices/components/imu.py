"""A board with inertial sensors."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.config import BitRate
from rbxcompose.domains.devices.inertial_boards import BoardDecoder, VectornavDecoder, WitmotionDecoder
from rbxcompose.domains.devices.serial_sensor import SerialConfig, SerialSensor
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs.geometry_msgs import Quaternion, Vector3
from rbxcompose.msgs.sensor_msgs import Imu
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header


class ImuConfig(SerialConfig):
    """Which board."""

    protocol: Literal["witmotion", "vectornav"] = "witmotion"
    """What it speaks: packets as WT901 and its kin send them, or the sentence `$VNYMR` of VN-100 and its kin."""
    baud: Annotated[BitRate, Field(gt=0)] = 9600
    """Bits per second; 115200 for a new `vectornav`."""
    frame: str = "imu_link"
    """The frame of the board, as its axes are printed on it; for `vectornav` turned to x ahead and z up."""
    topic: TopicName = "imu"
    """Where it publishes."""


@sdk.component("imu")
class InertialBoard(SerialSensor[ImuConfig]):
    """Publishes what a board with inertial sensors measures: attitude, turn rates, acceleration with that of gravity.

    Example:
        imu: {type: imu, port: /dev/ttyUSB1, protocol: witmotion, baud: 115200, frame: imu_link}
    """

    what = "the board"
    rate = 100.0

    @classmethod
    def ports(cls, config: ImuConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with its topic."""
        return super().ports(config) | {"imu": sdk.Out(Imu, config.topic).named("imu")}

    def configure(self) -> None:
        """Build the decoder."""
        super().configure()
        is_witmotion = self.config.protocol == "witmotion"
        self.decoder: BoardDecoder = (WitmotionDecoder if is_witmotion else VectornavDecoder)(self.faults)

    def begin(self) -> None:
        """Forget half of what came before."""
        self.decoder.forget()

    def take(self, data: bytes) -> None:
        """Publish what is whole."""
        for reading in self.decoder.feed(data):
            self.understood()
            self.bound["imu"](
                Imu(
                    Header(stamp=to_time(self.stamp), frame_id=self.config.frame),
                    Quaternion(*reading.orientation),
                    np.zeros(9),  # of all zeros: not known
                    Vector3(*reading.angular_velocity),
                    np.zeros(9),
                    Vector3(*reading.acceleration),
                    np.zeros(9),
                )
            )
