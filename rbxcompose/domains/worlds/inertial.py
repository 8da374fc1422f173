"""What inertial sensors measure."""

from __future__ import annotations

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Quaternion, Transform3, Vector3, Velocity2, conjugate, multiply, rotate
from rbxcompose.msgs import geometry_msgs as geometry
from rbxcompose.msgs.sensor_msgs import Imu
from rbxcompose.msgs.std_msgs import Header

GRAVITY = 9.81  # [m/s^2]
EXACT = np.zeros(3)


@dataclass(frozen=True, slots=True)
class ImuReading:
    """What an inertial sensor in some frame measures."""

    orientation: Quaternion
    """Of the frame in `map`."""
    angular_velocity: Vector3
    """In the frame [rad/s]."""
    acceleration: Vector3
    """In the frame, with the reaction to gravity: upwards at rest [m/s^2]."""


def on_base(
    orientation: Quaternion, mounted: Transform3, velocity: Velocity2, changing: Velocity2, gravity: float = GRAVITY
) -> ImuReading:
    """Return what a sensor measures that is `mounted` in the frame of a base on level ground.

    `orientation` is that of the base in `map`, `velocity` how it drives and turns [m/s, rad/s], and `changing` how fast
    that changes [m/s^2, rad/s^2]. A point r of a base that turns at w accelerates by dv/dt + w v + dw/dt x r - w^2 r.
    """
    x, y, _ = mounted.translation
    speed, turning, faster = velocity.linear, velocity.angular, changing.angular
    ahead = changing.linear - faster * y - turning * turning * x
    aside = turning * speed + faster * x - turning * turning * y
    back = conjugate(mounted.rotation)
    return ImuReading(
        multiply(orientation, mounted.rotation),
        rotate(back, (0.0, 0.0, turning)),
        rotate(back, (ahead, aside, gravity)),
    )


def imu_message(
    header: Header,
    reading: ImuReading,
    turn_error: Array = EXACT,
    error: Array = EXACT,
    variances: tuple[float, float] = (0.0, 0.0),
) -> Imu:
    """Return a reading with errors as a message; a covariance of zeros is one that is not known."""

    def with_error(exact: Vector3, wrong: Array) -> geometry.Vector3:
        return geometry.Vector3(*(np.array(exact) + wrong).tolist())

    return Imu(
        header,
        geometry.Quaternion(*reading.orientation),
        np.zeros(9),
        with_error(reading.angular_velocity, turn_error),
        (np.eye(3) * variances[0]).ravel(),
        with_error(reading.acceleration, error),
        (np.eye(3) * variances[1]).ravel(),
    )
