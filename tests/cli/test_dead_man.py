"""Driving by keys: what is commanded while a key is pressed, and after."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import Velocity2
from rbxcompose.domains.bases.commands.drive import HOLD, PERIOD, DeadMan, keys
from tests.loops import for_all


@for_all(
    "key, velocity",
    [
        ("w", Velocity2(0.2, 0.0)),
        ("s", Velocity2(-0.2, 0.0)),
        ("a", Velocity2(0.0, 0.5)),
        ("d", Velocity2(0.0, -0.5)),
        ("\x1b[A", Velocity2(0.2, 0.0)),
        ("\x1bOC", Velocity2(0.0, -0.5)),
        (" ", Velocity2()),
        ("x", None),
    ],
)
def test_a_key_is_a_velocity_at_once(key: str, velocity: Velocity2 | None) -> None:
    assert DeadMan(0.2, 0.5).press(key, 1.0) == velocity


def test_after_the_last_key_comes_one_command_to_stand_still_and_then_silence() -> None:
    dead_man = DeadMan(0.2, 0.5)
    dead_man.press("w", 0.0)
    told = [dead_man.due(PERIOD * count) for count in range(1, 8)]
    assert told == [Velocity2(0.2, 0.0)] * 2 + [Velocity2()] + [None] * 4


def test_a_key_that_is_held_goes_on() -> None:
    dead_man = DeadMan(0.2, 0.5)
    assert dead_man.press("w", 0.0) == Velocity2(0.2, 0.0)
    assert dead_man.press("w", 0.2) is None
    assert dead_man.due(0.4) == Velocity2(0.2, 0.0)


def test_space_stands_still_at_once_and_is_silent() -> None:
    dead_man = DeadMan(0.2, 0.5)
    dead_man.press("w", 0.0)
    assert dead_man.press(" ", 0.1) == Velocity2()
    assert dead_man.due(0.2) is None


def test_letting_go_tells_to_stand_still_only_who_moves() -> None:
    dead_man = DeadMan(0.2, 0.5)
    assert dead_man.release() is None
    dead_man.press("a", 0.0)
    assert dead_man.release() == Velocity2()
    assert dead_man.release() is None


@given(st.lists(st.tuples(st.sampled_from(["w", "a", " ", "\x1b[B", "?"]), st.floats(0.0, 1.0)), max_size=20))
def test_however_keys_are_pressed_the_last_command_is_to_stand_still(presses: list[tuple[str, float]]) -> None:
    dead_man, now, told = DeadMan(0.2, 0.5), 0.0, []
    for key, pause in presses:
        told.append(dead_man.press(key, now))
        now += pause
        told.append(dead_man.due(now))
    told.append(dead_man.due(now + HOLD))
    commands = [velocity for velocity in told if velocity is not None]
    assert commands[-1:] in ([], [Velocity2()])
    assert dead_man.due(now + HOLD + PERIOD) is None


def test_arrows_are_one_key_each() -> None:
    assert keys("w\x1b[Aq\x1bOD ") == ["w", "\x1b[A", "q", "\x1bOD", " "]
    assert keys("W\x1b[Z") == ["w", "\x1b", "[", "z"]
