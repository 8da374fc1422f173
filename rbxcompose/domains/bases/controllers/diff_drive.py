"""A base on two driven wheels."""

from __future__ import annotations

import math
from types import MappingProxyType
from typing import Any, Literal

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.config import AngularJerk, Config, Jerk, JointName, LinkName
from rbxcompose.base.geometry import Velocity2
from rbxcompose.base.requests import from_data
from rbxcompose.domains.bases.driving import drives
from rbxcompose.domains.bases.wheels import (
    BaseLimits,
    OdometryKeeper,
    OdometryPolicy,
    OdometryRecord,
    WheelDrive,
    WheelGeometry,
    WheelOdometry,
    odometry_message,
    odometry_transform,
)
from rbxcompose.domains.servos.controller import Controller, ControllerConfig, controller
from rbxcompose.manifest.fields import TopicName
from rbxcompose.msgs import geometry_msgs as geometry
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage

AVERAGED = 0.1  # [s], over which velocities are averaged
JUMP = 2.0  # times the largest speed of a wheel: a servo that has started again counts from elsewhere
OVERRUN = 0.5  # [s] for which wheels turn on when their process has died: watchdogs take less
STALE = 3.0  # cycles after which nobody knows where a wheel is


class OdometryConfig(Config):
    """The odometry of the base."""

    topic: TopicName = "odom"
    """Where poses and velocities are published."""
    frame: str = "odom"
    """The frame in which the poses are."""
    child: LinkName = "base_footprint"
    """The link of the body that moves with the base."""
    tf: bool = True
    """Whether its pose is also among the frames; not, if something else places it."""
    variance_per_metre: float = Field(1e-4, gt=0)
    """How uncertain the way of a wheel becomes [m^2/m]."""


class DiffDriveConfig(ControllerConfig):
    """Leads the two wheels of a base."""

    type: Literal["diff_drive"] = "diff_drive"
    """How it leads its joints."""
    left: JointName
    """The joint of the left wheel; forwards is positive."""
    right: JointName
    """The joint of the right wheel; forwards is positive."""
    wheel_radius: sdk.Length | None = Field(None, gt=0)
    """Radius of the wheels."""
    ticks_per_metre: float | None = Field(None, gt=0)
    """Ticks of a wheel's servo for each metre of way, instead of a radius."""
    wheel_distance: sdk.Length = Field(gt=0)
    """Between the points where the wheels touch the ground."""
    commands: TopicName = "cmd_vel"
    """The topic of its commands."""
    command_timeout: sdk.Time = Field(0.5, ge=0)
    """The base brakes when no command arrives for this long; 0 is never."""
    max_speed: sdk.Speed = Field(0.5, gt=0)
    """Largest speed, forwards and backwards."""
    max_turn_rate: sdk.AngularSpeed = Field(math.pi / 2, gt=0)
    """Largest turn rate."""
    acceleration: sdk.Acceleration = Field(1.0, gt=0)
    """Acceleration when speeding up and braking."""
    turn_acceleration: sdk.AngularAcceleration = Field(3.0, gt=0)
    """Acceleration when starting and stopping to turn."""
    jerk: Jerk | None = Field(None, gt=0)
    """Largest change of the acceleration."""
    turn_jerk: AngularJerk | None = Field(None, gt=0)
    """Largest change of the acceleration of a turn."""
    odometry: OdometryConfig = OdometryConfig()
    """Its odometry."""

    @property
    def claimed(self) -> tuple[str, ...]:
        """Return the joints that it leads."""
        return self.left, self.right


@controller("diff_drive")
class DiffDriveController(Controller[DiffDriveConfig]):
    """Drives a base on two wheels by `cmd_vel`, and publishes its odometry as `odom` and as a transform.

    What is too fast is slowed down as a whole, so that the curvature is kept. Without commands, at a stop, or when a
    wheel fails, the base brakes within its limits. Its wheels have no torque before the first command.

    Example:
        wheels: {type: diff_drive, left: left_wheel, right: right_wheel, wheel_radius: 4 cm, wheel_distance: 26 cm}
    """

    interface = "velocity"
    kinds = frozenset({"continuous"})
    topics = MappingProxyType({"commands": "commands", "odometry": "odometry.topic"})

    @classmethod
    def ports(cls, name: str, config: DiffDriveConfig) -> dict[str, sdk.Port[Any]]:
        """Return its commands, and what it publishes."""
        odometry = config.odometry
        ports: dict[str, sdk.Port[Any]] = {
            "commands": sdk.In(geometry.Twist, config.commands, qos="command"),
            "odometry": sdk.Out(Odometry, odometry.topic),
        }
        return {**ports, "tf": sdk.Out(TFMessage, "/tf")} if odometry.tf else ports

    @classmethod
    def capabilities(cls, name: str, config: DiffDriveConfig) -> tuple[sdk.Capability, ...]:
        """Declare its limits, its wheels and the frame that it moves."""
        odometry, timeout = config.odometry, config.command_timeout
        base = drives(config, "commands", "odometry", stops_after=sdk.Setting(timeout or math.inf, "command_timeout"))
        radius = config.wheel_radius
        wheels = sdk.RollsOn(
            sdk.Setting(config.left, "left"),
            sdk.Setting(config.right, "right"),
            sdk.Setting(config.wheel_distance, "wheel_distance"),
            sdk.Setting(radius, "wheel_radius") if radius else None,
            sdk.Setting(odometry.child, "odometry.child"),
        )
        frame = sdk.WritesFrame(
            "tf", sdk.Setting(odometry.frame, "odometry.frame"), sdk.Setting(odometry.child, "odometry.child")
        )
        if config.start == "inactive":
            return (wheels,)  # another one drives, which may have the same commands and frames
        return (base, wheels, frame) if odometry.tf else (base, wheels)

    @classmethod
    def mistake(cls, config: DiffDriveConfig) -> tuple[str, str] | None:
        """Return what contradicts itself."""
        if config.left == config.right:
            return "right", f"'{config.right}' is its left and its right wheel"
        if config.wheel_radius is None and config.ticks_per_metre is None:
            return "type", "it needs 'wheel_radius' or 'ticks_per_metre'"
        if config.wheel_radius is not None and config.ticks_per_metre is not None:
            return "ticks_per_metre", "it has 'wheel_radius' and 'ticks_per_metre', and only one of them can be right"
        if config.odometry.frame == config.odometry.child:
            return "odometry", f"the frame '{config.odometry.frame}' cannot move in itself"
        return None

    def prepare(self) -> None:
        """Set up limits and odometry."""
        config, joints = self.config, self.site.joints
        self.wheels = joints[config.left], joints[config.right]
        tick = self.wheels[0].per_tick
        radius = config.wheel_radius or 1.0 / ((config.ticks_per_metre or math.nan) * tick)
        servo = self.wheels[0].joint.servos[0].model
        turn = servo.family.ticks * tick if servo.protocol == 1 else None  # it does not report how many it has made
        rolling = WheelGeometry(config.wheel_distance, radius, turn)
        speeds = config.max_speed, config.max_turn_rate, config.acceleration, config.turn_acceleration
        limits = BaseLimits(*speeds, config.jerk, config.turn_jerk)
        own = [wheel.rules.limits for wheel in self.wheels]
        least = min((item.acceleration for item in own if item.acceleration is not None), default=math.inf)
        self.drive = WheelDrive(
            rolling, limits.of_wheels(rolling, least), config.command_timeout, min(item.speed for item in own)
        )
        fastest = rolling.fastest(Velocity2(config.max_speed, config.max_turn_rate)) * radius
        spread = config.odometry.variance_per_metre
        policy = OdometryPolicy(spread, JUMP * fastest, radius * tick, AVERAGED, OVERRUN * fastest)
        self.odometry = WheelOdometry(rolling, policy, self.site.start)
        self.keeper = OdometryKeeper(self.odometry, is_again=self.site.is_again)
        self.seen = -math.inf  # when both wheels had been measured last [s]
        self.refused = self.trouble = ""

    @property
    def leads(self) -> bool:
        """Return whether the base moves or is about to."""
        return self.drive.is_commanded or not self.drive.at_rest

    @property
    def note(self) -> str:
        """Return why it does not follow its commands."""
        return self.trouble or self.refused

    def received(self, port: str, message: geometry.Twist) -> None:
        """Take a command; forwards and the turn count."""
        before = self.drive.clamped
        self.drive.wheel_speed = min(wheel.rules.limits.speed for wheel in self.wheels)  # servos may take less
        refusal = self.drive.command(Velocity2(message.linear.x, message.angular.z), self.site.now)
        cut = "commands are cut to its limits" if self.drive.clamped > before else ""
        self.refused = f"a command was refused: {refusal}" if refusal else cut

    def cycle(self, now: float, dt: float) -> None:
        """Measure the way, and lead the wheels."""
        self._measure()
        was_at_rest = self.drive.at_rest
        if trouble := self._trouble(now, dt):
            self.trouble = trouble
            self.drive.brake()
        elif was_at_rest:
            self.trouble = ""
            self.drive.release()
        speeds = self.drive.step(now, dt)
        if was_at_rest and self.drive.at_rest:
            return
        for wheel, speed in zip(self.wheels, (speeds.left, speeds.right), strict=True):
            if was_at_rest or wheel.has_torque:
                wheel.turn(speed)
        if not was_at_rest and not any(wheel.has_torque for wheel in self.wheels):
            self.drive.rest()  # they roll as they like

    def halt(self, now: float, reason: str) -> None:
        """Brake, until the next command."""
        self.drive.forget()

    def _trouble(self, now: float, dt: float) -> str:
        """Return why the base cannot drive; empty if it can."""
        for name, wheel in self.site.joints.items():
            if wheel.blocked:
                return f"wheel '{name}': {wheel.blocked}"
            if now - wheel.measured_at > STALE * dt:
                return f"wheel '{name}' does not report its position"
            if not self.drive.at_rest and not wheel.has_torque:
                return f"wheel '{name}' was relaxed"
        return ""

    def _measure(self) -> None:
        """Add up the way, unless a wheel is not seen: its way then counts when it is."""
        left, right = self.wheels
        seen = min(left.measured_at, right.measured_at)
        if seen > self.seen:
            self.seen = seen
            if reason := self.odometry.update(left.measured.position, right.measured.position, seen):
                self.site.warn(reason)

    def start(self) -> None:
        """Report the place soon, also if there was none to recall."""
        self.keeper.start(self.site.now)

    def recall(self, memory: Any) -> None:
        """Go on where the base was before a restart."""
        self.keeper.recall(from_data(OdometryRecord, memory))

    def publish(self) -> None:
        """Publish where the base is, and how it moves."""
        odometry, known = self.config.odometry, self.odometry
        if not self.keeper.may_report(self.site.now):
            return
        if news := self.keeper.news(is_at_rest=self.drive.at_rest):
            self.site.keep(news)
        header = Header(stamp=to_time(self.site.stamp), frame_id=odometry.frame)
        self.site.send("odometry", odometry_message(known, header, odometry.child))
        if odometry.tf:
            self.site.send("tf", odometry_transform(known, header, odometry.child))
