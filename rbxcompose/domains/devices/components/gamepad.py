"""A gamepad at this machine."""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, Field

from rbxcompose import sdk
from rbxcompose.base.geometry import Velocity2
from rbxcompose.base.levels import Level
from rbxcompose.domains.devices.event_devices import EventPad, LostGamepadError, NoGamepadError, listing, open_gamepad
from rbxcompose.domains.devices.gamepad import REPEATED, AxisName, ButtonName, HeldDrive, HeldSettings
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.sensor_msgs import Joy
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header

_WAIT = 0.008  # [s] of a step in which it waits for events, in real time
_AGAIN = 1.0  # [s] between two looks for a gamepad that is not there


def _event_device(text: str) -> str:
    """Refuse the kernel's older interface, which cannot be read like this."""
    if text.startswith("/dev/input/js"):
        raise ValueError("must be an event device, such as one of /dev/input/by-id that ends in -event-joystick")
    return text


class GamepadConfig(sdk.Config):
    """Which gamepad, and how it drives."""

    device: Annotated[str, AfterValidator(_event_device)] = ""
    """Part of its name, such as `Xbox`, or its file, such as one of `/dev/input/by-id` that ends in `-event-joystick`;
    without it, the first gamepad."""
    drive: bool = True
    """Whether it commands velocities; `joy` is published in any case."""
    hold: ButtonName = "l1"
    """The button that must be held to drive; `a` is the lowest of the four (a cross on others), `l1` on the left above.
    """
    forwards: AxisName = "left_y"
    """The axis that drives."""
    turn: AxisName = "left_x"
    """The axis that turns."""
    max_speed: Annotated[sdk.Speed, sdk.Live()] = Field(0.3, gt=0)
    """Speed at the end of the axis."""
    max_turn_rate: Annotated[sdk.AngularSpeed, sdk.Live()] = Field(math.radians(60), gt=0)
    """Turn rate at the end of the axis."""
    dead_zone: Annotated[sdk.Ratio, sdk.Live()] = Field(0.1, ge=0, le=0.9)
    """The share of an axis around its middle that counts as the middle."""
    silence: Annotated[sdk.Time, sdk.Live()] = Field(3.0, gt=0)
    """A held button without any event for this long counts as released: a radio may be out of reach."""


@sdk.component("gamepad")
class Gamepad(sdk.Component[GamepadConfig]):
    """Commands velocities by the sticks of a gamepad while a button is held, and publishes `joy`, as `joy_linux` does.

    Released, unplugged or out of reach, it sends a zero, and nothing more. It may be plugged in at any time.

    Example:
        gamepad: {type: gamepad, max_speed: 0.3 m/s, hold: l1, connect: {cmd_vel: cmd_vel/teleop}}
    """

    blocking = True  # it waits for events
    rate = 100.0
    joy = sdk.Out(Joy, "joy")

    @classmethod
    def ports(cls, config: GamepadConfig) -> dict[str, sdk.Port[Any]]:
        """Return the ports: without driving, no velocities."""
        found = super().ports(config)
        return found | ({"cmd_vel": sdk.Out(Twist, "cmd_vel", qos="command").named("cmd_vel")} if config.drive else {})

    @classmethod
    def capabilities(cls, config: GamepadConfig) -> tuple[sdk.Capability, ...]:
        """Declare how fast it drives, and what it needs."""
        extra = sdk.NeedsExtra(sdk.Setting("evdev"), sdk.Setting("gamepad"))
        if not config.drive:
            return (extra,)
        speed, turn_rate = (
            sdk.Setting(config.max_speed, "max_speed"),
            sdk.Setting(config.max_turn_rate, "max_turn_rate"),
        )
        return extra, sdk.CommandsMotion("cmd_vel", speed, turn_rate)

    def configure(self) -> None:
        """Begin without a gamepad."""
        self.pad: EventPad | None = None
        self.at_end.callback(self.close)
        self.held = HeldDrive(settings_of(self.config))
        self.patience = _WAIT if self.context.clock.is_real else 0.0
        self.there: object = None  # the input devices when it looked the last time
        self.looked_at = self.published_at = -math.inf
        self.said = ""
        self.is_halted = self.context.is_stopped

    def reconfigure(self, old: GamepadConfig) -> None:
        """Follow other speeds."""
        self.held.settings = settings_of(self.config)

    @property
    def is_at_rest(self) -> bool:
        """Return whether it commands nothing."""
        return not self.held.is_driving

    def step(self, dt: float) -> None:
        """Wait a moment for events, and publish what follows from them."""
        if self.pad is None:
            self.look()
        if self.pad is None:
            return
        has_changed = False
        try:
            for _ in self.pad.read(self.patience):
                has_changed = True
                self.held.hear(self.now, is_down=self.pad.state.is_down(self.config.hold))
        except LostGamepadError as error:
            self.lose(self.pad, str(error))
            return
        if has_changed or self.now - self.published_at >= REPEATED - 1e-6:
            self.publish(self.pad)
        self.command(self.pad)

    def look(self) -> None:
        """Open the gamepad, if something was plugged in since the last look."""
        if self.now - self.looked_at < _AGAIN:
            return
        self.looked_at = self.now
        config, there = self.config, listing()
        if there == self.there and not config.device.startswith("/"):  # a link may come later than its device
            return
        axes = (config.forwards, config.turn) if config.drive else ()
        try:
            self.pad = open_gamepad(config.device, config.hold, axes)
        except NoGamepadError as error:
            self.there = there
            level = Level.ERROR if error.is_wrong else Level.WARN
            self.report(level, f"{error}; it waits for a gamepad", **({"help": error.help} if error.help else {}))
            return
        self.held.forget()
        self.held.hear(self.now, is_down=self.pad.state.is_down(config.hold))
        self.info(f"{self.pad.name} at {self.pad.path} is the gamepad")

    def lose(self, pad: EventPad, why: str) -> None:
        """Come to rest: the gamepad has gone."""
        self.held.forget()
        self.command(pad)
        pad.close()
        self.pad = self.there = None
        self.looked_at = self.now  # what has just gone may still be listed
        self.report(Level.WARN, f"{pad.name} has gone ({why}); it waits for a gamepad")

    def publish(self, pad: EventPad) -> None:
        """Publish the sticks and buttons."""
        self.published_at = self.now
        if self.joy.is_wanted:
            header = Header(stamp=to_time(self.stamp), frame_id="joy")
            axes = np.array(pad.state.axes(self.config.dead_zone), np.float32)
            self.joy(Joy(header, axes, np.array(pad.state.buttons(), np.int32)))

    def command(self, pad: EventPad) -> None:
        """Publish the velocity that a person commands, if one does."""
        config, state = self.config, pad.state
        if not config.drive:
            self.report(Level.OK, f"{pad.name} is read", device=pad.path)
            return
        if self.is_halted:
            self.held.disarm()
        forwards, turn = (state.position(axis, config.dead_zone) for axis in (config.forwards, config.turn))
        self.send(self.held.command(self.now, forwards, turn))
        level, words = self.sentence()
        self.report(level, f"{pad.name} {words}", device=pad.path)

    def send(self, velocity: Velocity2 | None) -> None:
        """Publish a velocity; None is silence."""
        if velocity is not None:
            linear, angular = Vector3(x=velocity.linear), Vector3(z=velocity.angular)
            self.bound["cmd_vel"](Twist(linear=linear, angular=angular))

    def sentence(self) -> tuple[Level, str]:
        """Return what the gamepad does now."""
        hold = self.config.hold
        if self.held.is_driving:
            return Level.OK, "drives"
        if self.held.is_silent:
            return Level.WARN, f"has been silent: release '{hold}' and hold it again"
        if self.held.must_be_released:
            return Level.WARN, f"moves nothing until '{hold}' is released and held again"
        return Level.OK, f"is ready: hold '{hold}' to drive"

    def report(self, level: Level, text: str, **values: object) -> None:
        """Report a state when it begins; a bad one also to the log."""
        if text == self.said:
            return
        self.said = text
        self.status(level, text, **values)
        if level is not Level.OK:
            help_ = values.get("help")
            self.warn(f"{text}: {help_}" if help_ else text)

    def rest(self) -> None:
        """End what it commands; the button counts only after it was released."""
        self.held.disarm()
        if self.config.drive:
            self.send(self.held.command(self.now, 0.0, 0.0))

    def stop(self) -> None:
        """Come to rest until `release`."""
        self.is_halted = True
        self.rest()

    def release(self) -> None:
        """Drive again when the button is released and held."""
        self.is_halted = False

    def hold(self) -> None:
        """Come to rest: robot time stands still."""
        self.rest()

    def brake(self) -> None:
        """Come to rest for good."""
        self.stop()

    def close(self) -> None:
        """Close the gamepad."""
        if self.pad is not None:
            self.pad.close()
            self.pad = None


def settings_of(config: GamepadConfig) -> HeldSettings:
    """Return the settings of the core."""
    return HeldSettings(config.max_speed, config.max_turn_rate, config.silence)
