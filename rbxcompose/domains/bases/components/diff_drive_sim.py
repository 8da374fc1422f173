"""The simulated differential base."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.geometry import AT_REST, Pose2, Transform3, Velocity2
from rbxcompose.base.levels import Level
from rbxcompose.domains.bases.driving import ABSURD, drives
from rbxcompose.msgs import geometry_msgs as geometry
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.poses import message_of, pose_in, transform_message, twist_message
from rbxcompose.msgs.rbxcompose_msgs import Switches, World, WorldRobots
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header, String
from rbxcompose.msgs.std_srvs import Trigger
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.sdk.ports import BULK

if TYPE_CHECKING:
    from rbxcompose.domains.worlds.world import SimulatedWorld

TRUTH = "ground_truth"
IN_WORLD: dict[str, sdk.Port[Any]] = {
    "world": sdk.In(World, "world", qos="latched", limits=BULK).named("world"),
    "others": sdk.In(WorldRobots, "world/others", is_open=True, may_be_silent=True).named("others"),
    "contact": sdk.Out(String, "contact", qos="event").named("contact"),
    "truth": sdk.Out(Odometry, TRUTH).named("truth"),
}
BY_PHYSICS: dict[str, sdk.Port[Any]] = {
    "drive": sdk.Out(geometry.Twist, "physics/cmd_vel", qos="command").named("drive"),
    "measured": sdk.In(Odometry, "physics/odom").named("measured"),
    "truth": sdk.In(Odometry, TRUTH).named("truth"),
}
WITH_WHEELS: dict[str, sdk.Port[Any]] = {
    "wheel_drop": sdk.Out(Switches, "wheel_drop").named("wheel_drop"),
    "put_back": sdk.Serves(Trigger, "put_back", skill=None).named("put_back"),
}
ODOM = "odom"
BASE = "base_footprint"
ROUNDING = 1e-12  # a smaller difference of velocities counts as none [m/s, rad/s]


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
    drift: sdk.Ratio = Field(0.0, ge=-0.5, le=0.5)
    """By which share its odometry overestimates how far it drives and turns."""
    wheel_distance: sdk.Length = Field(0.0, ge=0)
    """Between its wheels. With it, `wheel_drop` tells which hang over a hole of its `world`; then it stays there."""
    in_world: bool = False
    """Whether it stands in the robot's `world` and touches what is there; if the robot has one, that is the default."""
    by_physics: bool = False
    """Whether a physics engine moves it; with `simulator: physics`, that is the default."""


class DiffDriveCore:
    """Moves along exact arcs; while both velocities change, with their means until one has reached its target.

    So heading and distance driven never depend on how time is divided into steps, and neither does the position, except
    slightly while speed and turn rate change together. `settings` may be replaced while driving.
    """

    def __init__(self, settings: DiffDriveSimConfig, pose: Pose2 | None = None) -> None:
        self.settings = settings
        self.pose = pose or Pose2()
        self.velocity = AT_REST
        self.distance = 0.0  # distance driven so far [m]; driving backwards counts, too
        self.dropped = 0  # commands that were not finite, or absurd
        self.clamped = 0  # commands that were clamped to a limit
        self._target = AT_REST
        self._target_until = -math.inf
        self._braking = False

    @property
    def at_rest(self) -> bool:
        """Return whether the base stands still."""
        return self.velocity == AT_REST

    def command(self, velocity: Velocity2, now: float) -> None:
        """Accept the velocity to reach; it holds for `command_timeout`. While braking it is ignored."""
        speed, turn_rate = self.settings.max_speed, self.settings.max_turn_rate
        excess = max(abs(velocity.linear) / speed, abs(velocity.angular) / turn_rate)
        if not velocity.is_finite or excess > ABSURD:
            self.dropped += 1
            return
        if excess > 1.0:
            self.clamped += 1
            velocity = Velocity2(_clamp(velocity.linear, speed), _clamp(velocity.angular, turn_rate))
        if not self._braking:
            self._target = velocity
            self._target_until = now + self.settings.command_timeout

    def forget(self) -> None:
        """Brake until the next command."""
        self._target_until = -math.inf

    def brake(self) -> None:
        """Come to rest and stay there, whatever is commanded, until `release`."""
        self._braking = True
        self.forget()

    def release(self) -> None:
        """Follow commands again; the base stays at rest until the next one."""
        self._braking = False

    def step(self, now: float, dt: float) -> None:
        """Move through the `dt` [s] that end at `now`; the command holds up to its deadline, not to the step's end."""
        driven = min(max(self._target_until - (now - dt), 0.0), dt)
        self._follow(self._target, driven)
        self._follow(AT_REST, dt - driven)

    def _follow(self, target: Velocity2, duration: float) -> None:
        if duration <= 0.0 or self.velocity == target == AT_REST:
            return
        elapsed = 0.0
        for until in self._corners(target, duration):
            dt = until - elapsed
            before = self.velocity
            self.velocity = Velocity2(
                _towards(before.linear, target.linear, self.settings.acceleration * dt),
                _towards(before.angular, target.angular, self.settings.turn_acceleration * dt),
            )
            mean = Velocity2((before.linear + self.velocity.linear) / 2, (before.angular + self.velocity.angular) / 2)
            self.pose = self.pose.moved(mean, dt)
            self.distance += abs(mean.linear) * dt
            elapsed = until

    def _corners(self, target: Velocity2, duration: float) -> list[float]:
        """Return the moments up to `duration` between which both velocities are linear and keep their signs [s]."""
        now, limits = self.velocity, self.settings
        if now == target:
            return [duration]
        corners = (
            abs(now.linear) / limits.acceleration,
            abs(target.linear - now.linear) / limits.acceleration,
            abs(target.angular - now.angular) / limits.turn_acceleration,
        )
        return sorted({duration, *(corner for corner in corners if 0.0 < corner < duration)})


def _clamp(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


def _towards(value: float, target: float, most: float) -> float:
    """Return `value` moved towards `target` by at most `most`."""
    change = target - value
    return target if abs(change) <= most + ROUNDING else value + math.copysign(most, change)


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
        odom = sdk.Out(Odometry, "odom", rate=config.rate).named("odom")
        found = super().ports(config) | {"odom": odom}
        if not config.in_world:
            return found
        found |= {"world": IN_WORLD["world"], **BY_PHYSICS} if config.by_physics else IN_WORLD
        return found | (WITH_WHEELS if config.wheel_distance else {})

    @classmethod
    def capabilities(cls, config: DiffDriveSimConfig) -> tuple[sdk.Capability, ...]:
        """Declare its limits and the frame that it moves."""
        base = drives(
            config,
            "cmd_vel",
            "odom",
            stops_after=sdk.Setting(config.command_timeout, "command_timeout"),
            wheel_distance=sdk.Setting(config.wheel_distance, "wheel_distance") if config.wheel_distance else None,
        )
        return base, sdk.WritesFrame("tf", sdk.Setting(ODOM), sdk.Setting(BASE))

    def configure(self) -> None:
        """Put the base at the origin of `odom`."""
        self.core = DiffDriveCore(self.config)
        self.estimate = self.core.pose  # in `odom`, by the wheels
        self.pose, self.place = self.estimate, placed(self.estimate)  # the last one, and as a message
        self.world: SimulatedWorld | None = None
        self.hangs = False  # whether a wheel has no ground
        self.grounded = self.core.pose  # where all its wheels had ground the last time
        self.touched: frozenset[str] = frozenset()  # what it touches now
        self.contacts = 0  # how often it began to touch something

    def reconfigure(self, old: DiffDriveSimConfig) -> None:
        """Apply the new limits to later commands; the last command stays as it was clamped."""
        self.core.settings = self.config

    @property
    def is_at_rest(self) -> bool:
        """Return whether the wheels stand still."""
        return self.core.at_rest

    def on_cmd_vel(self, message: geometry.Twist) -> None:
        """Take a command; the status reports one that is absurd or too fast."""
        self.core.command(Velocity2(message.linear.x, message.angular.z), self.now)

    def on_world(self, message: World) -> None:
        """Stand where the robot is put in this world."""
        from rbxcompose.domains.worlds.world import world_of  # most bases are in none

        is_new = self.world is None
        self.world = world_of(message)
        if is_new:
            self.core.pose = self.estimate = self.grounded = self.world.start

    def on_others(self, message: WorldRobots) -> None:
        """Do not drive into other robots, where they are."""
        if self.world is not None:
            self.world = self.world.with_robots(message, self.now)

    def step(self, dt: float) -> None:
        """Move for `dt` [s] and publish where the base is."""
        before, driven = self.core.pose, self.core.distance
        self.core.step(self.now, dt)
        wanted = self.core.pose
        if self.config.by_physics:
            self.drive_wheels(before)
        elif self.world is not None:
            self.stay_outside(self.world, before)
            if self.config.wheel_distance:
                self.stay_on_ground(self.world, before, self.config.wheel_distance)
            self.report_truth()
        if self.core.pose is not wanted:
            self.core.distance = driven + before.distance(self.core.pose)
        if self.core.pose is not before and not self.config.by_physics:
            self.estimate = self.drifted(before.inverse().compose(self.core.pose))
        header = Header(stamp=to_time(self.stamp), frame_id=ODOM)
        if self.estimate is not self.pose:
            self.pose, self.place = self.estimate, placed(self.estimate)
        if self.odom.is_wanted:
            at = self.place.translation
            position = geometry.Point(at.x, at.y, at.z)
            self.odom(self.odometry(header, geometry.Pose(position=position, orientation=self.place.rotation)))
        link = geometry.TransformStamped(header=header, child_frame_id=BASE, transform=self.place)
        self.tf(TFMessage(transforms=(link,)))
        self.tell_commands()

    def drive_wheels(self, before: Pose2) -> None:
        """Let the engine turn the wheels, and be where that has moved the base; the wheels tell `odom`."""
        measured, truth = self.bound["measured"].value, self.bound["truth"].value
        self.core.pose = pose_in(truth.pose.pose) if truth is not None else before
        if self.world is not None and self.config.wheel_distance:
            self.stay_on_ground(self.world, self.core.pose, self.config.wheel_distance)
        if measured is not None:
            self.estimate = pose_in(measured.pose.pose)
        self.bound["drive"](self.wanted)

    @property
    def wanted(self) -> geometry.Twist:
        """Return how fast it drives by its commands and limits; where nothing is in its way, so fast it is."""
        return twist_message(self.core.velocity)

    def drifted(self, moved: Pose2) -> Pose2:
        """Return where the wheels believe the base to be after a motion in its own frame."""
        if not self.config.drift:
            return self.core.pose
        share = 1.0 + self.config.drift
        return self.estimate.compose(Pose2(share * moved.x, share * moved.y, share * moved.heading))

    def report_truth(self) -> None:
        """Publish where the base is in `map`, for what sees the world from it."""
        if self.bound["truth"].is_wanted:
            header = Header(stamp=to_time(self.stamp), frame_id="map")
            self.bound["truth"](self.odometry(header, message_of(self.core.pose)))

    def stay_outside(self, world: SimulatedWorld, before: Pose2) -> None:
        """Stop where the base touches something, and report what touches it when the contact begins."""
        found = world.first_contact(before, self.core.pose, self.now)
        touched = world.touched_by(self.core.pose, self.now)
        if found is not None:
            self.core.pose, self.core.velocity = found.pose, AT_REST
            touched |= {found.what}
        elif self.core.pose == before:
            touched |= self.touched - world.moving  # it still leans there
        for what in sorted(touched - self.touched):
            self.contacts += 1
            self.bound["contact"](String(data=what))
        self.touched = touched

    def stay_on_ground(self, world: SimulatedWorld, before: Pose2, wheel_distance: float) -> None:
        """Do not move while a wheel has no ground, and tell which one."""
        from rbxcompose.domains.worlds.sensors import switches  # which most bases have none of

        wheels = {"left": (0.0, wheel_distance / 2), "right": (0.0, -wheel_distance / 2)}
        if self.hangs:
            self.core.pose, self.core.velocity = before, AT_REST
        dropped = world.over_holes(self.core.pose, [*wheels.values()])
        self.hangs = bool(dropped.any())
        if not self.hangs:
            self.grounded = self.core.pose
        angles = {name: math.copysign(math.pi / 2, y) for name, (_, y) in wheels.items()}
        self.bound["wheel_drop"](switches(self.stamp, BASE, angles, dropped))

    def on_put_back(self, request: Trigger.Request) -> Trigger.Response:
        """Stand where all wheels had ground the last time, as if somebody had put the robot back."""
        if self.config.by_physics:
            return Trigger.Response(success=False, message="in the physics engine nobody lifts the robot")
        self.core.pose, self.core.velocity, self.hangs = self.grounded, AT_REST, False
        return Trigger.Response(success=True)

    def odometry(self, header: Header, pose: geometry.Pose) -> Odometry:
        """Return pose and velocity of the base as a message."""
        measured = self.bound["measured"].value if self.config.by_physics else None
        return Odometry(
            header=header,
            child_frame_id=BASE,
            pose=geometry.PoseWithCovariance(pose=pose),
            twist=measured.twist if measured is not None else geometry.TwistWithCovariance(twist=self.wanted),
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
        has_contacts = self.world is not None and not self.config.by_physics
        touched = {"contacts": str(self.contacts)} if has_contacts else {}
        return {"distance driven": f"{self.core.distance:.2f} m", **touched}


def placed(pose: Pose2) -> geometry.Transform:
    """Return a pose as a message."""
    return transform_message(Transform3.from_pose2(pose))
