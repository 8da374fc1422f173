"""Gamepads among the input devices of this machine: found, opened and read by evdev."""

from __future__ import annotations

import errno
import os
import select
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rbxcompose.base.printable import plain
from rbxcompose.domains.devices.gamepad import EV_ABS, EV_KEY, AxisName, ButtonName, PadLayout, PadState

if TYPE_CHECKING:
    from evdev import InputDevice

FOLDER = Path("/dev/input")
JOIN_GROUP = 'sudo usermod -aG input $USER, then log in again; or a udev rule with TAG+="uaccess"'
_PREFIX = "event"
_MOST = 16  # reads of 64 events each in one go: a device that floods holds nothing up, and the kernel drops the rest


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


def listing(folder: Path | None = None) -> tuple[tuple[str, int], ...]:
    """Return the input devices that are there now, each with when it or its rights changed: cheap to compare."""
    try:
        with os.scandir(folder or FOLDER) as entries:
            found = [(entry.path, entry.stat().st_ctime_ns) for entry in entries if entry.name.startswith(_PREFIX)]
    except OSError:
        return ()  # none was ever plugged in, or it went meanwhile
    return tuple(sorted(found, key=lambda item: (len(item[0]), item[0])))


def open_gamepad(wanted: str, hold: ButtonName, axes: tuple[AxisName, ...]) -> EventPad:
    """Open the gamepad with this path, or part of a name; without either, the first one.

    Raises:
        NoGamepadError: if there is none, or it lacks the button or an axis.
    """
    is_path = wanted.startswith("/")
    paths = [wanted] if is_path else [path for path, _ in listing()]
    forbidden: list[str] = []
    others: list[str] = []
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
                if not (missing := layout.lacks(hold, axes)) and layout.is_gamepad:
                    return EventPad(device, layout)
                if wanted:
                    lacking = f"it has no {' and no '.join(missing)}" if missing else "it has no stick and buttons"
                    others.append(f"{path} ({name}) cannot drive: {lacking}")
        except OSError:
            others.append(f"{path} went while it was opened")
        device.close()
    if others:
        raise NoGamepadError(others[0], is_wrong=True)
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
