"""A battery, a base, a driver, a charger and a mux of somebody else: other types, fields, ports and skills."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.msgs.nav2_msgs import NavigateToPose
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.rbxcompose_msgs import Recharge
from rbxcompose.msgs.std_msgs import Float32
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.msgs.vision_msgs import Detection3DArray
from rbxcompose.sdk import (
    Acceleration,
    AngularSpeed,
    Capability,
    Charges,
    CommandsMotion,
    Component,
    Config,
    Drains,
    Drives,
    Forwards,
    In,
    Length,
    MeasuresIn,
    Navigates,
    NeedsExtra,
    OpensPort,
    Out,
    PlaceName,
    Qos,
    Ratio,
    RollsOn,
    ServesAction,
    Setting,
    Speed,
    Time,
    WritesFrame,
    component,
)


class CellConfig(Config):
    """A battery."""

    lasts: Time
    """From full to empty."""
    yellow: Ratio = 0.5
    """Below this it warns."""
    red: Ratio = 0.2
    """Below this it is in error."""
    initial: Ratio = 1.0
    """At the start."""


@component("toy_cell")
class Cell(Component[CellConfig]):
    """Drains."""

    rate = 1.0
    charge = Out(Float32, "soc", unit="%")

    @classmethod
    def capabilities(cls, config: CellConfig) -> tuple[Capability, ...]:
        """Return that it is a battery."""
        yellow, red = Setting(config.yellow, "yellow"), Setting(config.red, "red")
        return (Drains("charge", Setting(config.lasts, "lasts"), yellow, red),)

    def step(self, dt: float) -> None:
        """Stay as full as it is."""
        self.charge(Float32(data=62.5))


class WheelsConfig(Config):
    """A base."""

    fastest: Speed = 0.5
    """Straight on."""
    spin: AngularSpeed = 1.6
    """On the spot."""
    patience: Time = 0.5
    """It waits so long for a command."""
    grip: Acceleration = 1.0
    """It brakes so hard."""
    body: str = "base_footprint"
    """The frame that it moves."""


class Wheels(Component[WheelsConfig]):
    """A base that is told its velocity."""

    simulated = True
    velocity = In(Twist, "cmd_vel", qos="command")
    where = Out(Odometry, "odom")
    frames = Out(TFMessage, "/tf")


@component("toy_wheels")
class ToyWheels(Wheels):
    """One that can be set."""

    @classmethod
    def capabilities(cls, config: WheelsConfig) -> tuple[Capability, ...]:
        """Return its limits, and the frame that it moves."""
        base = Drives(
            "velocity",
            max_speed=Setting(config.fastest, "fastest"),
            max_turn_rate=Setting(config.spin, "spin"),
            drops_above=Setting(2.0),
            stops_after=Setting(config.patience, "patience"),
            acceleration=Setting(config.grip, "grip"),
        )
        return base, WritesFrame("frames", Setting("odom"), Setting(config.body, "body"))


@component("toy_fixed_wheels")
class FixedWheels(Wheels):
    """One of which nothing can be set."""

    @classmethod
    def capabilities(cls, config: WheelsConfig) -> tuple[Capability, ...]:
        """Return its limits."""
        return (Drives("velocity", max_speed=Setting(0.5), stops_after=Setting(0.01), drops_above=Setting(3.0)),)


class RollersConfig(WheelsConfig):
    """A base with wheels in its body."""

    port_wheel: str = "l_wheel_joint"
    """To the left."""
    starboard_wheel: str = "r_wheel_joint"
    """To the right."""
    track: Length = 0.34
    """Between them."""
    size: Length = 0.062
    """Of both."""


@component("toy_rollers")
class Rollers(Component[RollersConfig]):
    """One whose wheels are known."""

    simulated = True
    velocity = In(Twist, "cmd_vel", qos="command")

    @classmethod
    def capabilities(cls, config: RollersConfig) -> tuple[Capability, ...]:
        """Return its speed and its wheels."""
        left, right = Setting(config.port_wheel, "port_wheel"), Setting(config.starboard_wheel, "starboard_wheel")
        wheels = RollsOn(left, right, Setting(config.track, "track"), Setting(config.size, "size"))
        return Drives("velocity", max_speed=Setting(config.fastest, "fastest")), wheels


class PilotConfig(Config):
    """A driver."""

    pace: Speed = 0.3
    """Straight on."""
    turn: AngularSpeed = 1.0
    """On the spot."""
    off_by: Length = 0.05
    """How near it comes."""
    push: Acceleration = 0.5
    """How hard it brakes."""


class ScannerConfig(Config):
    """A device on a serial port."""

    device: str
    """Its port."""


@component("toy_sonar")
class Scanner(Component[ScannerConfig]):
    """A device on a serial port."""

    @classmethod
    def capabilities(cls, config: ScannerConfig) -> tuple[Capability, ...]:
        """Return which port it opens, and by which package."""
        return OpensPort(Setting(config.device, "device")), NeedsExtra(Setting("toy_scanner_sdk"), Setting("scanners"))


@component("toy_pilot")
class Pilot(Component[PilotConfig]):
    """Goes to poses."""

    rate = 20.0
    velocity = Out(Twist, "cmd_vel", qos="command")
    goals = ServesAction(NavigateToPose, "take_to", claims="base")

    @classmethod
    def capabilities(cls, config: PilotConfig) -> tuple[Capability, ...]:
        """Return how fast it is, and how near it comes."""
        limits = Setting(config.pace, "pace"), Setting(config.turn, "turn"), Setting(config.push, "push")
        commands = CommandsMotion("velocity", *limits)
        return commands, Navigates("goals", Setting(config.off_by, "off_by"))


@component("toy_fixed_pilot")
class FixedPilot(Component[Config]):
    """One of which nothing can be set."""

    rate = 20.0
    velocity = Out(Twist, "cmd_vel", qos="command")
    goals = ServesAction(NavigateToPose, "take_to", claims="base")

    @classmethod
    def capabilities(cls, config: Config) -> tuple[Capability, ...]:
        """Return how fast it is, and how near it comes."""
        return CommandsMotion("velocity", Setting(1.0)), Navigates("goals", Setting(0.5))


@component("toy_reflex")
class Reflex(Component[Config]):
    """Moves out of danger."""

    rate = 20.0
    flight = Out(Twist, "cmd_vel", qos="command")

    @classmethod
    def capabilities(cls, config: Config) -> tuple[Capability, ...]:
        """Return that it protects the robot."""
        return (CommandsMotion("flight", protects=True),)


@component("toy_seer")
class Seer(Component[Config]):
    """Sees nothing, in a frame of its own."""

    sights = Out(Detection3DArray, "tags")

    @classmethod
    def capabilities(cls, config: Config) -> tuple[Capability, ...]:
        """Return the frame of what it sees."""
        return (MeasuresIn("sights", Setting("odom")),)


class FillerConfig(Config):
    """A charger."""

    station: PlaceName
    """Where it charges."""
    arm: Length = Field(0.2, gt=0)
    """How far it reaches."""


@component("toy_filler")
class Filler(Component[FillerConfig]):
    """Charges."""

    fill_up = ServesAction(Recharge, "fill_up", claims="base")

    @classmethod
    def capabilities(cls, config: FillerConfig) -> tuple[Capability, ...]:
        """Return where it charges, and how long."""
        station, arm = Setting(config.station, "station"), Setting(config.arm, "arm")
        return (Charges("fill_up", station, arm, until=Setting(0.99)),)


@component("toy_selector")
class Selector(Component[Config]):
    """A mux: one input, one output."""

    take = In(Twist, "selected", qos="command", is_open=True)
    give = Out(Twist, "cmd_vel", qos="command")

    @classmethod
    def capabilities(cls, config: Config) -> tuple[Capability, ...]:
        """Return what it lets through."""
        return (Forwards(("take",), "give"),)


def declaring(name: str, *capabilities: Capability) -> type[Component[Any]]:
    """Return a type with these capabilities, and one output `port`."""

    class Thing(Component[WheelsConfig]):
        port = Out(Float32, "port")

        @classmethod
        def capabilities(cls, config: WheelsConfig) -> tuple[Capability, ...]:
            return capabilities

    return component(name)(Thing)


@component("toy_pusher")
class Pusher(Component[Config]):
    """Pushes the base, and does not call it a command."""

    velocity = Out(Twist, "cmd_vel", qos=Qos.STATE)


@component("toy_surveyor")
class Surveyor(Component[Config]):
    """Waits for a last odometry that nobody keeps."""

    where = In(Odometry, "odom", qos=Qos.LATCHED)
