"""A simulated inertial sensor."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.arrays import np
from rbxcompose.base.geometry import AT_REST, Velocity2
from rbxcompose.domains.worlds.inertial import ImuReading, imu_message, on_base
from rbxcompose.domains.worlds.sensors import SensorConfig, WorldSensor
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.poses import pose_of
from rbxcompose.msgs.sensor_msgs import Imu
from rbxcompose.msgs.stamps import to_nanoseconds, to_time
from rbxcompose.msgs.std_msgs import Header


class ImuSimConfig(SensorConfig):
    """What it measures, and how well."""

    rate: sdk.Frequency = Field(50.0, gt=0, le=500)
    """How often it measures."""
    turn_noise: sdk.AngularSpeed = Field(0.0, ge=0)
    """Standard deviation of each turn rate."""
    turn_bias: sdk.AngularSpeed = Field(0.0, ge=0)
    """The same of what is added to all turn rates of a run."""
    noise: sdk.Acceleration = Field(0.0, ge=0)
    """Standard deviation of each acceleration."""
    bias: sdk.Acceleration = Field(0.0, ge=0)
    """The same of what is added to all accelerations of a run."""
    seed: int = 1
    """Of both: the same seed gives the same noise."""
    topic: TopicName = "imu"
    """Where it publishes."""
    by_physics: bool = False
    """Whether it measures in a physics engine; with `simulator: physics`, that is the default."""


@sdk.component("imu_sim")
class ImuSim(WorldSensor[ImuSimConfig]):
    """An inertial sensor on a base in a `world`: its attitude, turn rates, and acceleration with the one of gravity.

    Example:
        imu: {type: imu_sim, frame: base_link, rate: 100 Hz, turn_noise: 0.2 deg/s, noise: 0.02 m/s^2}
    """

    @classmethod
    def ports(cls, config: ImuSimConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with its topic."""
        found = super().ports(config) | {"imu": sdk.Out(Imu, config.topic, rate=config.rate).named("imu")}
        if config.by_physics:
            found["felt"] = sdk.In(Imu, f"physics/{config.topic}/imu").named("felt")
        return found

    @classmethod
    def capabilities(cls, config: ImuSimConfig) -> tuple[sdk.Capability, ...]:
        """Declare where it is in the engine."""
        felt = sdk.SensesPhysics(sdk.Setting(config.frame, "frame"), sdk.Setting(config.topic, "topic"))
        return (felt,) if config.by_physics else ()

    def configure(self) -> None:
        """Draw the biases of this run."""
        super().configure()
        config = self.config
        self.random = np.random.default_rng(config.seed)
        self.turn_bias = self.random.normal(0.0, 1.0, 3) * config.turn_bias
        self.bias = self.random.normal(0.0, 1.0, 3) * config.bias
        self.moving, self.changing, self.moved_at = AT_REST, AT_REST, 0

    def on_truth(self, message: Odometry) -> None:
        """Note how fast the velocity changes."""
        before, then = self.moving, self.moved_at
        self.moving = Velocity2(message.twist.twist.linear.x, message.twist.twist.angular.z)
        self.moved_at = to_nanoseconds(message.header.stamp)
        passed = (self.moved_at - then) / 1e9
        if then and passed > 0:
            faster, turning = self.moving.linear - before.linear, self.moving.angular - before.angular
            self.changing = Velocity2(faster / passed, turning / passed)

    def step(self, dt: float) -> None:
        """Measure, if it is known how the sensor moves."""
        reading = self.felt() if self.config.by_physics else self.computed()
        if reading is not None:
            self.tell(self.bound["imu"], self.noisy(reading))

    def felt(self) -> ImuReading | None:
        """Return what the engine says."""
        if (found := self.bound["felt"].value) is None:
            return None
        q, w, a = found.orientation, found.angular_velocity, found.linear_acceleration
        return ImuReading((q.x, q.y, q.z, q.w), (w.x, w.y, w.z), (a.x, a.y, a.z))

    def computed(self) -> ImuReading | None:
        """Return what follows from how the base moves."""
        base = self.truth.value
        if base is None or self.bound["mounting"].now() is None:
            return None
        mounted = self.bound["mounting"].transform()
        return on_base(pose_of(base.pose.pose).rotation, mounted, self.moving, self.changing)

    def noisy(self, reading: ImuReading) -> Imu:
        """Return what the sensor makes of it."""
        config = self.config
        return imu_message(
            Header(stamp=to_time(self.stamp), frame_id=config.frame),
            reading,
            self.random.normal(0.0, 1.0, 3) * config.turn_noise + self.turn_bias,
            self.random.normal(0.0, 1.0, 3) * config.noise + self.bias,
            (config.turn_noise**2 + config.turn_bias**2, config.noise**2 + config.bias**2),
        )
