"""A gamepad at this machine: what its events mean, and the velocity that a person commands while a button is held.

Codes are those of Linux (`input-event-codes.h`), and `joy` has the order and the signs of ROS's `joy_linux`: axes and
buttons by their codes, a stick to the left or up is +1, a trigger that nobody touches is +1.
"""

from __future__ import annotations

import errno
import math
import os
import select
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, Field

from rbxcompose import sdk
from rbxcompose.base.arrays import np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import AT_REST, Velocity2
from rbxcompose.base.levels import Level
from rbxcompose.base.printable import plain
from rbxcompose.base.units import TIME, format_quantity
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.sensor_msgs import Joy
from rbxcompose.msgs.stamps import to_time
from rbxcompose.msgs.std_msgs import Header

if TYPE_CHECKING:
    from evdev import InputDevice

EV_SYN, EV_KEY, EV_ABS = 0, 1, 3
SYN_REPORT, SYN_DROPPED = 0, 3
ABS_X, ABS_Y, ABS_Z, ABS_RX, ABS_RY, ABS_RZ = range(6)
ABS_HAT0X, ABS_HAT0Y = 0x10, 0x11
BTN_JOYSTICK, BTN_GAMEPAD, LAST_BUTTON = 0x120, 0x130, 0x13F
REPEATED = 0.05  # [s] between two commands that are alike

ButtonName = Literal["a", "b", "x", "y", "l1", "r1", "l2", "r2", "select", "start", "mode", "l3", "r3"]
AxisName = Literal["left_x", "left_y", "right_x", "right_y", "pad_x", "pad_y"]
_BUTTONS: Mapping[ButtonName, tuple[int, int]] = {  # as the kernel names them, and on pads that only number them
    "a": (0x130, 0x121),
    "b": (0x131, 0x122),
    "x": (0x133, 0x120),
    "y": (0x134, 0x123),
    "l1": (0x136, 0x124),
    "r1": (0x137, 0x125),
    "l2": (0x138, 0x126),
    "r2": (0x139, 0x127),
    "select": (0x13A, 0x128),
    "start": (0x13B, 0x129),
    "mode": (0x13C, 0x12C),
    "l3": (0x13D, 0x12A),
    "r3": (0x13E, 0x12B),
}
_AXES: Mapping[AxisName, tuple[int, int]] = {  # with a right stick that is RX and RY, and on pads where it is Z and RZ
    "left_x": (ABS_X, ABS_X),
    "left_y": (ABS_Y, ABS_Y),
    "right_x": (ABS_RX, ABS_Z),
    "right_y": (ABS_RY, ABS_RZ),
    "pad_x": (ABS_HAT0X, ABS_HAT0X),
    "pad_y": (ABS_HAT0Y, ABS_HAT0Y),
}
FOLDER = Path("/dev/input")
JOIN_GROUP = 'sudo usermod -aG input $USER, then log in again; or a udev rule with TAG+="uaccess"'
_PREFIX = "event"
_MOST = 16  # reads of 64 events each in one go: a device that floods holds nothing up, and the kernel drops the rest
_WAIT = 0.008  # [s] of a step in which it waits for events, in real time
_AGAIN = 1.0  # [s] between two looks for a gamepad that is not there


@dataclass(frozen=True, slots=True)
class PadLayout:
    """Which axes a device has, by code with the least and the greatest value of each, and which keys."""

    axes: Mapping[int, tuple[int, int]]
    keys: tuple[int, ...]

    @property
    def is_gamepad(self) -> bool:
        """Return whether it has a stick and buttons of a gamepad; mice, keyboards and touch pads have not."""
        return {ABS_X, ABS_Y} <= self.axes.keys() and bool(self.buttons)

    @property
    def buttons(self) -> tuple[int, ...]:
        """Return the codes of its buttons."""
        return tuple(sorted(code for code in self.keys if BTN_JOYSTICK <= code <= LAST_BUTTON))

    def button(self, name: ButtonName) -> int | None:
        """Return the code of a button; None if it has no such."""
        named, numbered = _BUTTONS[name]
        code = named if any(key >= BTN_GAMEPAD for key in self.buttons) else numbered
        return code if code in self.keys else None

    def axis(self, name: AxisName) -> int | None:
        """Return the code of an axis; None if it has no such."""
        usual, other = _AXES[name]
        code = usual if ABS_RX in self.axes else other
        return code if code in self.axes else None

    @property
    def named(self) -> list[str]:
        """Return the names of what it has."""
        buttons = [name for name in _BUTTONS if self.button(name) is not None]
        return [*buttons, *(name for name in _AXES if self.axis(name) is not None)]

    def lacks(self, buttons: Iterable[ButtonName], axes: Iterable[AxisName]) -> list[str]:
        """Return which of these it does not have."""
        missing = [f"button {name}" for name in buttons if self.button(name) is None]
        return missing + [f"axis {name}" for name in dict.fromkeys(axes) if self.axis(name) is None]


class PadState:
    """Where the sticks of a device are and which of its buttons are down, by its events."""

    def __init__(self, layout: PadLayout) -> None:
        self.layout = layout
        self._axes = {code: (least + most) / 2 for code, (least, most) in layout.axes.items()}
        self._down: set[int] = set()
        self.lost_events = False  # the kernel dropped some: until the state was read anew, nothing counts

    def read_anew(self, axes: Mapping[int, int], down: Iterable[int]) -> None:
        """Take the whole state, as it is at the first moment and after events were lost."""
        self._axes |= {code: float(value) for code, value in axes.items() if code in self._axes}
        self._down = set(down)
        self.lost_events = False

    def feed(self, type_: int, code: int, value: int) -> None:
        """Take an event."""
        if type_ == EV_SYN and code == SYN_DROPPED:
            self.lost_events = True
        elif type_ == EV_ABS and code in self._axes:
            self._axes[code] = float(value)
        elif type_ == EV_KEY and value:
            self._down.add(code)
        elif type_ == EV_KEY:
            self._down.discard(code)

    def is_down(self, button: ButtonName) -> bool:
        """Return whether a button is down."""
        return self.layout.button(button) in self._down

    def position(self, name: AxisName, dead_zone: float) -> float:
        """Return where an axis is, from -1 (right, down) to 1 (left, up); 0 within the dead zone, and without it."""
        code = self.layout.axis(name)
        return 0.0 if code is None else self._position(code, dead_zone)

    def axes(self, dead_zone: float) -> list[float]:
        """Return all axes, as `joy_linux` orders them."""
        return [self._position(code, dead_zone) for code in sorted(self._axes)]

    def buttons(self) -> list[int]:
        """Return all buttons: 1 is down."""
        return [int(code in self._down) for code in self.layout.buttons]

    def _position(self, code: int, dead_zone: float) -> float:
        least, most = self.layout.axes[code]
        if most <= least:
            return 0.0
        value = -(2.0 * (self._axes[code] - least) / (most - least) - 1.0)
        # Sticks with an even number of values have no middle: 127 of 255 is at rest, too, within any dead zone.
        beyond = max(0.0, min(abs(value), 1.0) - dead_zone) / (1.0 - dead_zone)
        return math.copysign(beyond, value) if beyond else 0.0


class HeldDrive:
    """Commands while the button is held, and a single zero at the end of that.

    The button counts only after it was seen released: a pad that is plugged in with the button down moves nothing, nor
    does one whose button was held through a stop. Of a pad out of reach of its radio, the kernel knows nothing for
    seconds; a hand on a stick is never quite still, so that a held button without any event ends, too.
    """

    def __init__(self, config: GamepadConfig) -> None:
        self.config = config
        self.is_driving = False
        self.is_silent = False  # the last drive ended because the pad sent nothing
        self._is_armed = self._is_down = False
        self._heard_at = self._sent_at = -math.inf
        self._sent = AT_REST

    @property
    def must_be_released(self) -> bool:
        """Return whether the button is held, and counts only after it was released."""
        return self._is_down and not self._is_armed

    def disarm(self) -> None:
        """Let the button, if it is held, count only after it was released: the robot was stopped."""
        self._is_armed = not self._is_down

    def hear(self, now: float, *, is_down: bool) -> None:
        """Take where the button is, as the pad has just said."""
        self._heard_at, self._is_down = now, is_down
        self._is_armed = self._is_armed or not is_down
        self.is_silent = self.is_silent and is_down

    def forget(self) -> None:
        """Take the pad for gone: until it is heard again, nobody knows where its button is."""
        self._is_down = self._is_armed = False

    def command(self, now: float, forwards: float, turn: float) -> Velocity2 | None:
        """Return the velocity to send now, None for silence; `forwards` and `turn` are the axes, from -1 to 1."""
        if self.is_driving and now - self._heard_at > self.config.silence:
            self.is_silent = True
            self.disarm()
        if not (self._is_down and self._is_armed):
            ends, self.is_driving = self.is_driving, False
            return AT_REST if ends else None
        wanted = Velocity2(forwards * self.config.max_speed, turn * self.config.max_turn_rate)
        if self.is_driving and wanted == self._sent and now - self._sent_at < REPEATED - 1e-6:
            return None
        self.is_driving, self._sent, self._sent_at = True, wanted, now
        return wanted


class NoGamepadError(Exception):
    """Raised when there is no gamepad to open, with the reason and what helps; `is_wrong` if waiting does not."""

    def __init__(self, problem: str, help: str = "", *, is_wrong: bool = False) -> None:
        super().__init__(problem)
        self.help, self.is_wrong = help, is_wrong


class LostGamepadError(Exception):
    """Raised when an open gamepad has gone."""


class EventPad:
    """An open gamepad."""

    def __init__(self, device: InputDevice[str], layout: PadLayout) -> None:
        self._device = device
        self.name, self.path = plain(device.name), str(device.path)
        self.state = PadState(layout)
        self._read_anew()

    def read(self, patience: float) -> Iterator[None]:
        """Wait for events for up to `patience` [s], and yield after each that was taken.

        Raises:
            LostGamepadError: if the gamepad has gone.
        """
        try:
            for _ in range(_MOST):
                if not select.select([self._device.fd], [], [], patience)[0]:
                    return
                events, patience = list(self._device.read()), 0.0
                if not events:
                    raise LostGamepadError(f"{self.path} has ended")
                for event in events:
                    self.state.feed(event.type, event.code, event.value)
                    if not self.state.lost_events:
                        yield
                if self.state.lost_events:
                    self._read_anew()
                    yield
        except (OSError, ValueError) as error:
            raise LostGamepadError(str(error)) from error

    def close(self) -> None:
        """Close it."""
        self._device.close()

    def _read_anew(self) -> None:
        axes = {code: self._device.absinfo(code).value for code in self.state.layout.axes}
        self.state.read_anew(axes, self._device.active_keys())


def listing() -> tuple[tuple[str, int], ...]:
    """Return the input devices that are there now, each with when it or its rights changed: cheap to compare."""
    try:
        with os.scandir(FOLDER) as entries:
            found = [(entry.path, entry.stat().st_ctime_ns) for entry in entries if entry.name.startswith(_PREFIX)]
    except OSError:
        return ()  # none was ever plugged in, or it went meanwhile
    return tuple(sorted(found, key=lambda item: (len(item[0]), item[0])))


def open_gamepad(wanted: str, buttons: tuple[ButtonName, ...], axes: tuple[AxisName, ...]) -> EventPad:
    """Open the gamepad with this path, or part of a name; without either, the first one.

    Raises:
        NoGamepadError: if there is none, or it lacks a button or an axis.
    """
    is_path = wanted.startswith("/")
    paths = [wanted] if is_path else [path for path, _ in listing()]
    forbidden: list[str] = []
    others: list[tuple[str, str]] = []  # what is wrong with them, and what helps
    for path in paths:
        try:
            device = _opened(path)
        except PermissionError:
            forbidden.append(path)
            continue
        except OSError as error:
            if is_path and error.errno not in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
                words = "is no event device of the kernel"
                raise NoGamepadError(
                    f"{path} {words}", "name one that ends in -event-joystick", is_wrong=True
                ) from error
            continue  # it went meanwhile
        try:
            layout = _layout(device)
            name = plain(device.name)
            if is_path or wanted.casefold() in name.casefold():
                if not (missing := layout.lacks(buttons, axes)) and layout.is_gamepad:
                    return EventPad(device, layout)
                if wanted or layout.is_gamepad:
                    lacking = f"it has no {' and no '.join(missing)}" if missing else "it has no stick and buttons"
                    has = f"set 'hold', 'forwards' and 'turn' to what it has: {', '.join(layout.named)}"
                    others.append((f"{path} ({name}) cannot drive: {lacking}", has if layout.is_gamepad else ""))
        except OSError:
            others.append((f"{path} went while it was opened", ""))
        device.close()
    if others:
        raise NoGamepadError(*others[0], is_wrong=bool(wanted))
    if is_path and forbidden:
        raise NoGamepadError(f"{wanted} may not be read by this user", JOIN_GROUP, is_wrong=True)
    named = f" with '{wanted}' in its name" if wanted and not is_path else ""
    problem = f"{wanted} is not connected" if is_path else f"no gamepad{named} is connected"
    if not forbidden:
        raise NoGamepadError(problem)
    hidden = f"{len(forbidden)} input device{'s' if len(forbidden) > 1 else ''}"
    raise NoGamepadError(f"{problem}, or this user may not read it: {hidden} may not be read", JOIN_GROUP)


def _opened(path: str) -> InputDevice[str]:
    import evdev

    return evdev.InputDevice(path, readonly=True)


def _layout(device: InputDevice[str]) -> PadLayout:
    found: dict[int, list[Any]] = dict(device.capabilities())  # evdev's own type says nothing of ranges
    axes = {code: (info.min, info.max) for code, info in found.get(EV_ABS, ())}
    return PadLayout(axes, tuple(found.get(EV_KEY, ())))


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
    """A held button without any event for this long counts as released: a radio may be out of reach. A stick that is
    held quite still sends none, either."""


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
        self.held = HeldDrive(self.config)
        self.patience = _WAIT if self.context.clock.is_real else 0.0
        self.there: object = None  # the input devices when it looked the last time
        self.looked_at = self.published_at = -math.inf
        self.said = ""
        self.is_halted = self.context.is_stopped

    def reconfigure(self, old: GamepadConfig) -> None:
        """Follow other speeds."""
        self.held.config = self.config

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
        buttons, axes = ((config.hold,), (config.forwards, config.turn)) if config.drive else ((), ())
        try:
            self.pad = open_gamepad(config.device, buttons, axes)
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
            silence = format_quantity(self.config.silence, TIME)
            return Level.WARN, f"has sent nothing for {silence} ('silence'): release '{hold}' and hold it again"
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
