"""What the events of a gamepad mean, and the velocity that a person commands with it while a button is held.

Codes are those of Linux (`input-event-codes.h`), and `joy` has the order and the signs of ROS's `joy_linux`: axes and
buttons by their codes, a stick to the left or up is +1, a trigger that nobody touches is +1.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Literal

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import AT_REST, Velocity2

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

    def lacks(self, button: ButtonName, axes: Iterable[AxisName]) -> list[str]:
        """Return which of these it does not have."""
        missing = [f"button {button}"] if self.button(button) is None else []
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


@dataclass(frozen=True, slots=True)
class HeldSettings:
    """How a person drives: speeds at the ends of the sticks [m/s, rad/s], and the silence that ends it [s]."""

    max_speed: float
    max_turn_rate: float
    silence: float


class HeldDrive:
    """Commands while the button is held, and a single zero at the end of that.

    The button counts only after it was seen released: a pad that is plugged in with the button down moves nothing, nor
    does one whose button was held through a stop. Of a pad out of reach of its radio, the kernel knows nothing for
    seconds; a hand on a stick is never quite still, so that a held button without any event ends, too.
    """

    def __init__(self, settings: HeldSettings) -> None:
        self.settings = settings
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
        if self.is_driving and now - self._heard_at > self.settings.silence:
            self.is_silent = True
            self.disarm()
        if not (self._is_down and self._is_armed):
            ends, self.is_driving = self.is_driving, False
            return AT_REST if ends else None
        wanted = Velocity2(forwards * self.settings.max_speed, turn * self.settings.max_turn_rate)
        if self.is_driving and wanted == self._sent and now - self._sent_at < REPEATED - 1e-6:
            return None
        self.is_driving, self._sent, self._sent_at = True, wanted, now
        return wanted
