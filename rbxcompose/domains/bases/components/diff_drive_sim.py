"""The simulated differential base."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.geometry import Pose2, Transform3, Velocity2
from rbxcompose.base.levels import Level
from rbxcompose.domains.bases.twins import ABSURD, DiffDriveCore, DiffDriveSettings
from rbxcompose.msgs import geometry_msgs as geometry
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage

ODOM = "odom"
BASE = "base_footprint"


class DiffDriveSimConfig(sdk.Config):
    """Limits of the base."""

    max_speed: Annotated[sdk.Speed, sdk.Live()] = Field(0.5, gt=0)
    """Largest speed, forwards and backwards."""
    max_turn_rate: Annotated[sdk.AngularSpeed, sdk.Live()] = Field(math.pi / 2, gt=0)
    """Largest turn rate."""
    acceleration: Annotated[sdk.Acceleration, sdk.Live()] = Field(1.0, gt=0)
    """Acceleration when speeding up and braking."""
    turn_acceleration: Annotated[sdk.AngularAcceleration, sdk.Live()] = Field(3.0, gt=0)
    """Acceleration when starting and stopping to turn."""
    command_timeout: Annotated[sdk.Time, sdk.Live()] = Field(0.5, gt=0)
    """The base brakes when no command arrives for this long."""
    rate: sdk.Frequency = Field(50.0, ge=1, le=1000)
    """How often it moves and publishes; a low rate lets more robots run on a machine."""


@sdk.component("diff_drive_sim")
class DiffDriveSim(sdk.Component[DiffDriveSimConfig]):
    """A base with two driven wheels that follows `cmd_vel` within its limits and publishes its odometry.

    Example:
        base: {type: diff_drive_sim, max_speed: 0.5 m/s, max_turn_rate: 90 deg/s}
    """

    process = "world"
    simulated = True
    cmd_vel = sdk.In(geometry.Twist, "cmd_vel", qos="command")
    odom = sdk.Out(Odometry, "odom")
    tf = sdk.Out(TFMessage, "/tf")

    @classmethod
    def rate_of(cls, config: DiffDriveSimConfig) -> float:
        """Return how often it moves [Hz]."""
        return config.rate

    @classmethod
    def ports(cls, config: DiffDriveSimConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports, with the rate of the odometry."""
        return super().ports(config) | {"odom": sdk.Out(Odometry, "odom", rate=config.rate).named("odom")}

    @classmethod
    def capabilities(cls, config: DiffDriveSimConfig) -> tuple[sdk.Capability, ...]:
        """Declare its limits and the frame that it moves."""
        base = sdk.Drives(
            "cmd_vel",
            "odom",
            max_speed=sdk.Setting(config.max_speed, "max_speed"),
            max_turn_rate=sdk.Setting(config.max_turn_rate, "max_turn_rate"),
            drops_above=sdk.Setting(ABSURD),
            stops_after=sdk.Setting(config.command_timeout, "command_timeout"),
            acceleration=sdk.Setting(config.acceleration, "acceleration"),
            turn_acceleration=sdk.Setting(config.turn_acceleration, "turn_acceleration"),
        )
        return base, sdk.WritesFrame("tf", sdk.Setting(ODOM), sdk.Setting(BASE))

    def configure(self) -> None:
        """Put the base at the origin of `odom`."""
        self.core = DiffDriveCore(settings_of(self.config))
        self.pose, self.place = self.core.pose, placed(self.core.pose)  # the last one, and as a message

    def reconfigure(self, old: DiffDriveSimConfig) -> None:
        """Apply the new limits to later commands; the last command stays as it was clamped."""
        self.core.settings = settings_of(self.config)

    @property
    def is_at_rest(self) -> bool:
        """Return whether the wheels stand still."""
        return self.core.at_rest

    def on_cmd_vel(self, message: geometry.Twist) -> None:
        """Take a command; the status reports one that is absurd or too fast."""
        self.core.command(Velocity2(message.linear.x, message.angular.z), self.now)

    def step(self, dt: float) -> None:
        """Move for `dt` [s] and publish where the base is."""
        self.core.step(self.now, dt)
        header = Header(stamp=to_time(self.stamp), frame_id=ODOM)
        if self.core.pose is not self.pose:
            self.pose, self.place = self.core.pose, placed(self.core.pose)
        if self.odom.is_wanted:
            at = self.place.translation
            position = geometry.Point(at.x, at.y, at.z)
            self.odom(self.odometry(header, geometry.Pose(position=position, orientation=self.place.rotation)))
        link = geometry.TransformStamped(header=header, child_frame_id=BASE, transform=self.place)
        self.tf(TFMessage(transforms=(link,)))
        self.tell_commands()

    def odometry(self, header: Header, pose: geometry.Pose) -> Odometry:
        """Return pose and velocity of the base as a message."""
        velocity = self.core.velocity
        twist = geometry.Twist(linear=geometry.Vector3(x=velocity.linear), angular=geometry.Vector3(z=velocity.angular))
        return Odometry(
            header=header,
            child_frame_id=BASE,
            pose=geometry.PoseWithCovariance(pose=pose),
            twist=geometry.TwistWithCovariance(twist=twist),
        )

    def tell_commands(self) -> None:
        """Report in the status the commands that were not followed exactly."""
        dropped, clamped = self.core.dropped, self.core.clamped
        if dropped or clamped:
            counts = ((dropped, "dropped as absurd"), (clamped, "cut to the limits"))
            message = ", ".join(f"{count} {what}" for count, what in counts if count)
            self.status(Level.WARN, f"commands: {message}", dropped=dropped, clamped=clamped)

    def stop(self) -> None:
        """Brake and ignore commands until `release`."""
        self.core.brake()

    def release(self) -> None:
        """Accept commands again."""
        self.core.release()

    def go_on(self) -> None:
        """Brake until the next command: robot time stood still, or has jumped."""
        self.core.forget()

    def brake(self) -> None:
        """Come to rest for good."""
        self.core.brake()

    def summary(self) -> dict[str, str]:
        """Report how far it went."""
        return {"distance driven": f"{self.core.distance:.2f} m"}


def placed(pose: Pose2) -> geometry.Transform:
    """Return a pose as a message."""
    at = Transform3.from_pose2(pose)
    return geometry.Transform(translation=geometry.Vector3(*at.translation), rotation=geometry.Quaternion(*at.rotation))


def settings_of(config: DiffDriveSimConfig) -> DiffDriveSettings:
    """Return the settings of the core."""
    return DiffDriveSettings(
        max_speed=config.max_speed,
        max_turn_rate=config.max_turn_rate,
        acceleration=config.acceleration,
        turn_acceleration=config.turn_acceleration,
        command_timeout=config.command_timeout,
    )
