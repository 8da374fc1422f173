"""A gamepad commands velocities while a button is held, and whatever becomes of it, the base comes to rest."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.devices.components.gamepad import ABS_X, ABS_Y, PadLayout, PadState
from rbxcompose.msgs.diagnostic_msgs import DiagnosticStatus
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.msgs.sensor_msgs import Joy
from rbxcompose.testing import Bench, check_text, instance
from tests.devices.made_gamepad import EVENT, LB, XBOX_KEYS, MadeGamepad, let_be_made

MOUSE: dict[str, Any] = {"name": "Logitech Mouse", "axes": {}, "keys": (0x110, 0x111)}


@pytest.fixture
def plug(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., MadeGamepad]:
    let_be_made(tmp_path, monkeypatch)
    return lambda *arguments, **options: MadeGamepad(tmp_path, *arguments, **options)


Plug = Callable[..., MadeGamepad]


class Driven:
    """A gamepad of a robot on the bench: what it commands, and what it says."""

    def __init__(self, **config: object) -> None:
        self.bench = Bench(instance("gamepad", "gamepad", {"max_speed": 0.5, "max_turn_rate": 1.0, **config}))
        self.commands = self.bench.collect("cmd_vel", Twist)
        self.joy = self.bench.collect("joy", Joy)
        self.statuses: list[DiagnosticStatus] = self.bench.statuses("gamepad")
        self.bench.advance(0.1)

    def during(self, seconds: float) -> list[tuple[float, float]]:
        """Return what is commanded while time passes."""
        before = len(self.commands)
        self.bench.advance(seconds)
        return [(round(one.linear.x, 3), round(one.angular.z, 3)) for one in self.commands[before:]]

    @property
    def status(self) -> str:
        self.bench.advance(1.0)
        return self.statuses[-1].message


def test_the_stick_drives_while_the_button_is_held_and_a_single_zero_ends_it(plug: Plug) -> None:
    pad = plug()
    robot = Driven()
    pad.move(ABS_Y, -32768)
    assert robot.during(0.5) == []
    pad.press(LB)
    pad.move(ABS_X, 32767)
    driven = robot.during(0.5)
    assert set(driven) == {(0.5, -1.0)}
    assert 10 <= len(driven) <= 12
    pad.let_go(LB)
    assert robot.during(2.0) == [(0.0, 0.0)]


def test_within_the_dead_zone_a_held_button_holds_the_robot_still(plug: Plug) -> None:
    pad = plug()
    robot = Driven()
    pad.press(LB)
    pad.move(ABS_Y, -3000)
    assert set(robot.during(0.5)) == {(0.0, 0.0)}


def test_unplugged_while_it_drives_it_stops_once_and_drives_again_only_after_a_new_press(plug: Plug) -> None:
    pad = plug()
    robot = Driven()
    pad.press(LB)
    pad.move(ABS_Y, -32768)
    assert (0.5, 0.0) in robot.during(0.3)
    pad.unplug()
    assert robot.during(2.0) == [(0.0, 0.0)]
    assert any("Microsoft Xbox 360 pad has gone" in text for text in robot.bench.texts())
    assert robot.status == "no gamepad is connected; it waits for a gamepad"
    pad.plug()  # with the button still down
    assert robot.during(3.0) == []
    assert robot.status == "Microsoft Xbox 360 pad moves nothing until 'l1' is released and held again"
    pad.let_go(LB)
    pad.press(LB)
    assert set(robot.during(0.3)) == {(0.5, 0.0)}


def test_it_waits_for_a_gamepad_that_is_not_there(plug: Plug) -> None:
    robot = Driven()
    assert robot.status == "no gamepad is connected; it waits for a gamepad"
    plug(0, **MOUSE)
    plug(12)
    assert robot.status == "Microsoft Xbox 360 pad is ready: hold 'l1' to drive"


def test_a_name_chooses_among_several(plug: Plug) -> None:
    plug(0)
    plug(1, name="Sony Wireless Controller")
    assert Driven(device="sony").status.startswith("Sony Wireless Controller is ready")


def test_a_device_that_is_no_gamepad_is_refused_with_what_it_lacks(plug: Plug, tmp_path: Path) -> None:
    plug(3, **MOUSE)
    robot = Driven(device=str(tmp_path / "event3"))
    assert f"{tmp_path}/event3 (Logitech Mouse) cannot drive: it has no button l1 and no axis left_y" in robot.status
    assert robot.during(1.0) == []


def test_a_pad_without_the_button_cannot_drive_but_publishes_joy(plug: Plug, tmp_path: Path) -> None:
    plug(2, name="SNES Pad", axes={0: (0, 255), 1: (0, 255)}, keys=(0x130, 0x131))
    robot = Driven()
    cannot = f"{tmp_path}/event2 (SNES Pad) cannot drive: it has no button l1; it waits for a gamepad"
    assert robot.status == cannot
    helps = [value.value for value in robot.statuses[-1].values if value.key == "help"]
    assert helps == ["set 'hold', 'forwards' and 'turn' to what it has: a, b, left_x, left_y"]
    read = Driven(drive=False)
    assert read.status == "SNES Pad is read"
    assert read.joy


@pytest.mark.parametrize(
    ("device", "level", "words"),
    [
        ("event4", 2, "{device} may not be read by this user"),
        ("", 1, "no gamepad is connected, or this user may not read it: 1 input device may not be read"),
    ],
    ids=["by its path", "any"],
)
def test_a_device_that_may_not_be_read_is_reported_with_what_helps(
    device: str, level: int, words: str, plug: Plug, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: str, **_: object) -> None:
        raise PermissionError(13, "Permission denied", path)

    plug(4)
    monkeypatch.setattr("evdev.InputDevice", refuse)
    path = str(tmp_path / device) if device else ""
    robot = Driven(device=path)
    assert robot.status == f"{words.format(device=path)}; it waits for a gamepad"
    assert robot.statuses[-1].level == level
    assert [value.value for value in robot.statuses[-1].values if value.key == "help"] == [
        'sudo usermod -aG input $USER, then log in again; or a udev rule with TAG+="uaccess"'
    ]


def test_a_held_button_without_any_event_ends(plug: Plug) -> None:
    pad = plug()
    robot = Driven(silence="1 s")
    pad.press(LB)
    pad.move(ABS_Y, -32768)
    assert robot.during(3.0)[-1] == (0.0, 0.0)
    assert robot.status == "Microsoft Xbox 360 pad has sent nothing for 1 s ('silence'): release 'l1' and hold it again"
    pad.move(ABS_Y, -32000)
    assert robot.during(1.0) == []
    pad.let_go(LB)
    pad.press(LB)
    assert robot.during(0.2)


def test_the_part_says_how_long_a_stick_may_be_steady(tmp_path: Path) -> None:
    text = """
rbx: 1
kind: Robot
name: cart
include:
  base: rbx:parts/base.yaml
  hand: {part: rbx:parts/gamepad.yaml, with: {silence: 10 s}}
"""
    pads = [each.config for each in check_text(text, tmp_path).plan.instances if each.type == "gamepad"]
    assert [getattr(config, "silence", None) for config in pads] == [10.0]


def test_after_a_stop_of_the_robot_the_button_must_be_released(plug: Plug) -> None:
    pad = plug()
    robot = Driven()
    pad.press(LB)
    pad.move(ABS_Y, -32768)
    robot.during(0.3)
    component = robot.bench.component("gamepad")
    component.stop()
    assert robot.during(0.5) == [(0.0, 0.0)]
    component.release()
    assert robot.during(0.5) == []
    pad.let_go(LB)
    pad.press(LB)
    assert set(robot.during(0.3)) == {(0.5, 0.0)}


def test_after_a_stop_a_button_that_was_not_held_drives_at_its_first_press(plug: Plug) -> None:
    pad = plug()
    robot = Driven()
    component = robot.bench.component("gamepad")
    component.stop()
    robot.during(0.5)
    component.release()
    pad.press(LB)
    pad.move(ABS_Y, -32768)
    assert set(robot.during(0.3)) == {(0.5, 0.0)}


def test_a_button_that_is_pressed_during_a_stop_must_be_released(plug: Plug) -> None:
    pad = plug()
    robot = Driven()
    component = robot.bench.component("gamepad")
    component.stop()
    pad.press(LB)
    robot.during(0.5)
    component.release()
    assert robot.during(0.5) == []


def test_events_that_the_kernel_dropped_are_made_up_for_by_its_state(plug: Plug) -> None:
    pad = plug()
    robot = Driven()
    pad.press(LB)
    pad.move(ABS_Y, -32768)
    robot.during(0.2)
    pad.down.clear()  # the release is among what was dropped
    pad.write((0, 3, 0))
    assert robot.during(1.0) == [(0.0, 0.0)]


def test_a_device_that_floods_delays_no_release(plug: Plug) -> None:
    pad = plug()
    robot = Driven()
    pad.press(LB)
    for value in range(2000):
        pad.write_bytes(EVENT.pack(0, 0, 3, ABS_Y, -value * 16))
    pad.let_go(LB)
    flooded = robot.during(1.0)
    assert len(flooded) <= 10
    assert flooded[-1] == (0.0, 0.0)


@pytest.mark.parametrize("data", [b"\xff" * 24 * 9, os.urandom(24 * 40), bytes(7)], ids=["ones", "random", "a part"])
def test_no_bytes_make_it_fail(plug: Plug, data: bytes) -> None:
    pad = plug()
    robot = Driven()
    pad.write_bytes(data)
    robot.during(1.0)
    assert robot.bench.host.states()["gamepad"] == ("active", 0), robot.bench.texts()
    assert all(math.isfinite(one.linear.x) and abs(one.linear.x) <= 0.5 for one in robot.commands)


def test_joy_has_the_order_and_the_signs_of_joy_linux(plug: Plug) -> None:
    pad = plug()
    robot = Driven(drive=False, dead_zone="0 %")
    pad.move(ABS_X, -32768)
    pad.press(XBOX_KEYS[1])
    robot.bench.advance(0.1)
    last = robot.joy[-1]
    assert [round(one, 2) for one in last.axes] == [1.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0]
    assert list(last.buttons) == [0, 1, *[0] * 9]
    assert robot.commands == []


def test_its_speed_changes_while_it_drives(plug: Plug) -> None:
    pad = plug()
    robot = Driven()
    pad.press(LB)
    pad.move(ABS_Y, -32768)
    robot.during(0.2)
    robot.bench.set_live("gamepad", max_speed=0.1)
    assert robot.during(0.3)[-1] == (0.1, 0.0)


@given(st.integers(-(2**31), 2**31 - 1), st.integers(-40000, 40000), st.integers(-40000, 40000), st.floats(0.0, 0.9))
def test_an_axis_is_between_minus_one_and_one_whatever_a_device_says(
    value: int, least: int, most: int, dead_zone: float
) -> None:
    state = PadState(PadLayout({ABS_X: (least, most), ABS_Y: (0, 255)}, XBOX_KEYS))
    state.feed(3, ABS_X, value)
    assert -1.0 <= state.position("left_x", dead_zone) <= 1.0


@pytest.mark.parametrize(
    ("keys", "axes", "expected"),
    [
        (XBOX_KEYS, {0: (0, 255), 1: (0, 255), 3: (0, 255), 4: (0, 255)}, (LB, 3)),
        (tuple(range(0x120, 0x12C)), {0: (0, 255), 1: (0, 255), 2: (0, 255), 5: (0, 255)}, (0x124, 2)),
    ],
    ids=["as the kernel names them", "buttons with numbers"],
)
def test_both_common_layouts_are_known(
    keys: tuple[int, ...], axes: dict[int, tuple[int, int]], expected: tuple[int, int]
) -> None:
    layout = PadLayout(axes, keys)
    assert layout.is_gamepad
    assert (layout.button("l1"), layout.axis("right_x")) == expected
