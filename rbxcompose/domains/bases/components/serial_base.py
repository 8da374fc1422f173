"""A base whose motors are driven by a board at a serial port."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Self

from pydantic import Field

from rbxcompose import sdk
from rbxcompose.base.config import BitRate
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import AT_REST, Velocity2
from rbxcompose.base.levels import Level
from rbxcompose.base.requests import Command
from rbxcompose.domains.bases import wheel_board
from rbxcompose.domains.bases.driving import drives
from rbxcompose.domains.bases.wheel_watch import WheelWatch
from rbxcompose.domains.bases.wheels import (
    BaseLimits,
    OdometryKeeper,
    OdometryPolicy,
    OdometryRecord,
    WheelDrive,
    WheelGeometry,
    WheelOdometry,
    WheelSpeeds,
    odometry_message,
    odometry_transform,
)
from rbxcompose.domains.devices.serial_ports import PortError
from rbxcompose.domains.devices.serial_sensor import SILENT, SerialConfig, SerialSensor
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.sensor_msgs import BatteryState
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header
from rbxcompose.msgs.tf2_msgs import TFMessage

ODOM, BASE = "odom", "base_footprint"
AVERAGED = 0.1  # [s], over which velocities are averaged
JUMP = 2.0  # times the largest speed of a wheel
PAUSE = 1.0  # [s] without a command to move, after which the next one is tried in spite of a failure


class SerialBaseConfig(SerialConfig):
    """Which board, and what it moves."""

    baud: Annotated[BitRate, Field(gt=0)] = 115200
    """Bits per second."""
    ticks_per_metre: float = Field(gt=0)
    """Ticks of an encoder for each metre of way of its wheel."""
    wheel_distance: sdk.Length = Field(gt=0)
    """Between the points where the wheels touch the ground."""
    max_speed: sdk.Speed = Field(0.5, gt=0)
    """Largest speed, forwards and backwards."""
    max_turn_rate: sdk.AngularSpeed = Field(math.pi / 2, gt=0)
    """Largest turn rate."""
    acceleration: sdk.Acceleration = Field(1.0, gt=0)
    """Acceleration when speeding up and braking."""
    turn_acceleration: sdk.AngularAcceleration = Field(3.0, gt=0)
    """Acceleration when starting and stopping to turn."""
    command_timeout: sdk.Time = Field(0.5, gt=0)
    """The base brakes when no command arrives for this long."""
    rate: sdk.Frequency = Field(50.0, ge=10, le=100)
    """How often it tells the board how fast to drive."""


@dataclass(frozen=True, slots=True)
class RecallOdometry(Command):
    """Where the base and its wheels were, for a base that starts again."""

    about: ClassVar[str] = "serial_base"
    record: OdometryRecord


@sdk.component("serial_base")
class SerialBase(SerialSensor[SerialBaseConfig]):
    """Drives a base on two wheels by a board at a serial port, such as an Arduino, and publishes its odometry.

    The board has the sketch `wheel_board`, or another one of its protocol. It stops its motors by itself when nothing
    comes from here for 0.2 s. While nothing comes from it for as long, the base rests, and begins again from rest.
    It also rests when a motor has failed or a wheel does not do what it is commanded, until commands pause for 1 s.
    Odometry goes on over a restart of the process, by what the wheels have turned meanwhile, and over one of the board.

    Example:
        base: {type: serial_base, port: /dev/ttyACM0, ticks_per_metre: 4200, wheel_distance: 24 cm}
    """

    what = "the board"
    cmd_vel = sdk.In(Twist, "cmd_vel", qos="command")
    odom = sdk.Out(Odometry, "odom")
    tf = sdk.Out(TFMessage, "/tf")
    battery = sdk.Out(BatteryState, "battery")

    @classmethod
    def rate_of(cls, config: SerialBaseConfig) -> float:
        """Return how often it commands the board [Hz]."""
        return config.rate

    @classmethod
    def capabilities(cls, config: SerialBaseConfig) -> tuple[sdk.Capability, ...]:
        """Declare its limits, the frame that it moves, and its port."""
        base = drives(
            config,
            "cmd_vel",
            "odom",
            stops_after=sdk.Setting(config.command_timeout, "command_timeout"),
            wheel_distance=sdk.Setting(config.wheel_distance, "wheel_distance"),
        )
        return *super().capabilities(config), base, sdk.WritesFrame("tf", sdk.Setting(ODOM), sdk.Setting(BASE))

    def configure(self) -> None:
        """Begin at the origin of `odom`, without a board."""
        super().configure()
        self.patience = 0.0  # commands wait for nothing
        config = self.config
        self.geometry = WheelGeometry(config.wheel_distance, 1.0 / config.ticks_per_metre, wheel_board.COUNTS)
        limits = BaseLimits(config.max_speed, config.max_turn_rate, config.acceleration, config.turn_acceleration)
        self.drive = WheelDrive(self.geometry, limits, config.command_timeout, wheel_board.MOST_TICKS)
        self.link = wheel_board.BoardLink(self.faults)
        tick = 1.0 / config.ticks_per_metre
        fastest = self.geometry.fastest(Velocity2(config.max_speed, config.max_turn_rate)) * tick
        policy = OdometryPolicy(greatest_speed=JUMP * fastest, resolution=tick, window=AVERAGED)
        self.odometry = WheelOdometry(self.geometry, policy)
        self.keeper = OdometryKeeper(self.odometry, is_again=self.context.is_again)
        self.has_begun = False  # the board has started since this component has
        self.last: wheel_board.BoardState | None = None
        self.was_alive = False
        self.refused = self.failure = ""
        self.moved_at = -math.inf  # the last command to move
        self.said = WheelSpeeds()
        self.watches = {"left": WheelWatch(), "right": WheelWatch()}
        self.at_end.callback(self.stand)

    def start(self) -> None:
        """Report the place soon, also if there was none to recall."""
        self.keeper.start(self.now)

    def take_over(self, old: Self) -> None:
        """Go on where a base with other settings was."""
        if record := old.odometry.record or old.keeper.kept:
            self.recall(RecallOdometry(record))

    @sdk.answers(RecallOdometry)
    def recall(self, request: RecallOdometry) -> str:
        """Go on where the base was before the restart."""
        self.keeper.recall(request.record)
        if self.has_begun:
            self.odometry.lose_wheels()
        return "odometry goes on from before the restart"

    @property
    def is_at_rest(self) -> bool:
        """Return whether the wheels are to stand still."""
        return self.drive.at_rest

    def on_cmd_vel(self, message: Twist) -> None:
        """Take a command."""
        velocity = Velocity2(message.linear.x, message.angular.z)
        if velocity != AT_REST:
            if self.now - self.moved_at > PAUSE:
                self.failure = ""
            self.moved_at = self.now
        self.refused = self.drive.command(velocity, self.now) or ""

    def begin(self) -> None:
        """Greet the board: it was plugged in, or the port was opened."""
        self.link.forget()
        self.trouble = ""

    def take(self, data: bytes) -> None:
        """Publish what the board says."""
        for state in self.link.feed(data, self.now):
            self.understood()
            self.watch(state)
            self.last = state
            if state.begins:
                if self.keeper.kept is not None:
                    self.warn("the board has started again: how far its wheels have turned meanwhile is not known")
                self.has_begun = True
                self.odometry.lose_wheels()
            if reason := self.odometry.update(state.left, state.right, self.now):
                self.faults["jumps of wheels"] += "jumped" in reason
            if self.keeper.may_report(self.now):
                self.publish(state)
                if news := self.keeper.news(is_at_rest=self.drive.at_rest):
                    self.context.repeat([RecallOdometry(news)])

    def watch(self, state: wheel_board.BoardState) -> None:
        """Notice a motor that has failed, and a wheel that does not do what it is commanded."""
        before = state if self.last is None or state.begins else self.last
        faults, tick = list[str](), self.geometry.metres_per_unit
        for side, watch in self.watches.items():
            speed, new, old = (getattr(each, side) for each in (self.said, state, before))
            watch.update(speed * tick, self.geometry.turned(new, old) * tick, self.now)
            if fault := watch.fault(is_urgent=state.has_failed):
                faults.append(f"the {side} wheel {fault}")
        if (faults or state.has_failed) and not self.failure:
            self.failure = f"{faults[0] if faults else 'a motor has failed'}: the base rests"
            self.warn(self.failure)

    def publish(self, state: wheel_board.BoardState) -> None:
        """Publish the odometry and the battery."""
        header = Header(stamp=to_time(self.stamp), frame_id=ODOM)
        if self.odom.is_wanted:
            self.odom(odometry_message(self.odometry, header, BASE))
        self.tf(odometry_transform(self.odometry, header, BASE))
        if self.battery.is_wanted:
            unmeasured = ("temperature", "current", "charge", "capacity", "design_capacity", "percentage")
            unknown: dict[str, Any] = dict.fromkeys(unmeasured, math.nan)
            self.battery(BatteryState(Header(header.stamp), voltage=state.voltage, present=True, **unknown))

    def step(self, dt: float) -> None:
        """Take what the board says, and say how fast its wheels should turn."""
        super().step(dt)
        is_alive = self.line.is_open and self.link.is_alive(self.now)
        if is_alive != self.was_alive:
            self.was_alive = is_alive
            self.changed(is_alive=is_alive)
        if not is_alive or self.failure:
            self.drive.rest()
        speeds = self.drive.step(self.now, dt)
        if self.line.is_open:
            self.say(speeds)

    def changed(self, *, is_alive: bool) -> None:
        """Rest when the board is not heard any more, and tell when it is again."""
        if is_alive:
            self.trouble = ""
            self.info("the board answers")
            return
        self.last = None
        self.link.forget()
        if self.line.is_open:
            self.complain("the board is not heard: the base rests")

    def say(self, speeds: WheelSpeeds) -> None:
        """Send the speeds of the wheels; a port that takes nothing is opened again."""
        self.said = speeds
        try:
            if not self.line.write(self.link.speak(self.now, speeds)):
                self.line.close()
                self.complain(f"{self.config.port} takes no bytes: the base rests")
        except PortError as error:
            self.lose(error)

    def report(self) -> None:
        """Report how the board is; one that never answered has its own words."""
        if self.link.is_of_another_version:
            speaks = f"version {self.link.version} of the protocol, not {wheel_board.VERSION}"
            self.complain(f"the board speaks {speaks}: load the sketch again")
        elif self.was_alive or self.now - max(self.since, self.read_at) > SILENT:
            super().report()
        elif self.trouble:
            self.complain(self.trouble)
        else:
            self.status(Level.WARN, "the board has not answered yet")

    def state(self) -> tuple[Level, str]:
        """Return how the board is."""
        if self.failure:
            return Level.ERROR, self.failure
        if self.refused:
            return Level.WARN, f"a command was refused: {self.refused}"
        return Level.OK, "drives" if not self.drive.at_rest else "rests"

    def values(self) -> dict[str, str]:
        """Return the battery."""
        return {"battery": f"{self.last.voltage:.2f} V"} if self.last is not None else {}

    def stop(self) -> None:
        """Brake and ignore commands until `release`."""
        self.drive.brake()

    def release(self) -> None:
        """Accept commands again."""
        self.drive.release()

    def hold(self) -> None:
        """Rest: robot time stands still."""
        self.drive.rest()
        self.stand()

    def go_on(self) -> None:
        """Brake until the next command: robot time stood still, or has jumped."""
        self.drive.forget()

    def brake(self) -> None:
        """Come to rest for good."""
        self.drive.brake()

    def stand(self) -> None:
        """Let the board stand, if it can hear that."""
        if self.line.is_open:
            self.say(WheelSpeeds())

    def summary(self) -> dict[str, str]:
        """Report where it went."""
        pose = self.odometry.pose
        return {"place in odom": f"{pose.x:.2f} m, {pose.y:.2f} m, {math.degrees(pose.heading):.0f} deg"}
