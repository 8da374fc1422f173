"""A gamepad that is made: events as the bytes that the kernel writes, read by evdev itself from a named pipe."""

from __future__ import annotations

import os
import struct
import sys
from collections.abc import Iterable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import evdev
import pytest
from evdev.eventio import EventIO

from rbxcompose.commands.main import main
from rbxcompose.domains.devices.components import gamepad

EVENT = struct.Struct("llHHi")  # struct input_event
STICKS = (evdev.ecodes.ABS_X, evdev.ecodes.ABS_Y, evdev.ecodes.ABS_RX, evdev.ecodes.ABS_RY)
TRIGGERS = (evdev.ecodes.ABS_Z, evdev.ecodes.ABS_RZ)
XBOX_AXES = {
    **dict.fromkeys(STICKS, (-32768, 32767)),
    **dict.fromkeys(TRIGGERS, (0, 255)),
    **dict.fromkeys((evdev.ecodes.ABS_HAT0X, evdev.ecodes.ABS_HAT0Y), (-1, 1)),
}
XBOX_KEYS = (0x130, 0x131, 0x133, 0x134, 0x136, 0x137, 0x13A, 0x13B, 0x13C, 0x13D, 0x13E)
LB = 0x136


class Described:
    """What the kernel would say of a device when it is asked."""

    def __init__(
        self,
        name: str = "Microsoft Xbox 360 pad",
        axes: dict[int, tuple[int, int]] = XBOX_AXES,
        keys: Iterable[int] = XBOX_KEYS,
    ) -> None:
        self.name, self.axes, self.keys = name, axes, tuple(keys)
        self.values = dict.fromkeys(axes, 0)
        self.down: set[int] = set()


_made: dict[str, Described] = {}


class MadeGamepad(Described):
    """An input device of a folder, which is plugged in."""

    def __init__(self, folder: Path, number: int = 0, **described: Any) -> None:
        super().__init__(**described)
        self.path = folder / f"event{number}"
        self.plug()

    def plug(self) -> None:
        os.mkfifo(self.path)
        self._far = os.open(self.path, os.O_RDWR | os.O_NONBLOCK)
        _made[str(self.path)] = self

    def unplug(self) -> None:
        self.path.unlink()
        os.close(self._far)
        del _made[str(self.path)]

    def move(self, axis: int, value: int) -> None:
        self.values[axis] = value
        self.write((evdev.ecodes.EV_ABS, axis, value))

    def press(self, *keys: int) -> None:
        self.down |= set(keys)
        self.write(*((evdev.ecodes.EV_KEY, key, 1) for key in keys))

    def let_go(self, *keys: int) -> None:
        self.down -= set(keys)
        self.write(*((evdev.ecodes.EV_KEY, key, 0) for key in keys))

    def write(self, *events: tuple[int, int, int]) -> None:
        """Write events, and the report that ends them."""
        self.write_bytes(b"".join(EVENT.pack(0, 0, *event) for event in (*events, (evdev.ecodes.EV_SYN, 0, 0))))

    def write_bytes(self, data: bytes) -> None:
        os.write(self._far, data)


class PipedDevice(EventIO):
    """What evdev has for an open device, with its own reading of bytes; what it asks the kernel is answered here."""

    def __init__(self, path: str, readonly: bool = False) -> None:
        self.fd = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        self.path, self._made = path, _made.get(os.path.realpath(path), Described())
        self.name = self._made.name

    def capabilities(self) -> dict[int, list[object]]:
        ranges = [(code, evdev.AbsInfo(0, *limits, 0, 0, 0)) for code, limits in self._made.axes.items()]
        return {evdev.ecodes.EV_KEY: list(self._made.keys), evdev.ecodes.EV_ABS: [*ranges]}

    def absinfo(self, code: int) -> object:
        return SimpleNamespace(value=self._made.values[code])

    def active_keys(self) -> list[int]:
        return sorted(self._made.down)

    def close(self) -> None:
        os.close(self.fd)


def let_be_made(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let gamepads of this folder be those of the machine."""
    monkeypatch.setattr(evdev, "InputDevice", PipedDevice)
    monkeypatch.setattr(gamepad, "FOLDER", folder)


if __name__ == "__main__":  # FOLDER WORD ...: `rbxcompose WORD ...` on a machine whose gamepads are in a folder
    let_be_made(Path(sys.argv[1]), pytest.MonkeyPatch())
    sys.exit(main(sys.argv[2:]))
