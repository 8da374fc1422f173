"""A tick of an imported servo is the angle that ArbotiX gives it."""

from __future__ import annotations

import math
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.units import ANGLE, ANGULAR_SPEED, to_si
from rbxcompose.domains.servos.joint_drive import JointServo
from rbxcompose.domains.servos.models import model_named
from tests.importing.imports import import_texts

RANGES = {1024: (None, 300.0), 4096: (None, 360.0, 250.92)}  # [deg]; None is what the driver takes then


def angle(tick: int, ticks: int, turn: float, neutral: int, invert: bool) -> float:
    """Return the angle of a tick [rad], as the driver computes it."""
    k = math.radians(turn) / ticks
    return -(tick - neutral) * k if invert else (tick - neutral) * k


def joint_of(text: str) -> tuple[JointServo, dict[str, list[str]]]:
    with TemporaryDirectory() as folder:
        data = import_texts(Path(folder), text).data
    servo = data["actuators"]["pan_servo"]
    model = model_named(servo["model"])
    assert model
    neutral = servo.get("neutral", model.family.centre)
    return JointServo(servo["id"], model, neutral, servo.get("invert", False)), data["joints"]["pan"].get("limits", {})


@given(st.data(), st.sampled_from(sorted(RANGES)), st.booleans())
def test_each_tick_has_the_angle_of_the_driver(data: st.DataObject, ticks: int, invert: bool) -> None:
    turn = data.draw(st.sampled_from(RANGES[ticks]))
    neutral = data.draw(st.none() | st.integers(0, ticks - 1))
    keys = {"ticks": ticks, "range": turn, "neutral": neutral, "invert": invert or None}
    written = ", ".join(f"{key}: {str(value).lower()}" for key, value in keys.items() if value is not None)
    servo, _ = joint_of(f"joints: {{pan: {{id: 1, {written}}}}}\n")
    usual = 360.0 if ticks == 4096 else 300.0
    for tick in data.draw(st.lists(st.integers(0, ticks - 1), min_size=1)):
        expected = angle(tick, ticks, turn or usual, ticks // 2 if neutral is None else neutral, invert)
        assert servo.angle(tick) == pytest.approx(expected, rel=1e-12, abs=1e-12)


@given(st.floats(-149, 148), st.floats(0.5, 1000))
def test_limits_are_those_of_the_file(least: float, speed: float) -> None:
    _, limits = joint_of(f"joints: {{pan: {{id: 1, min_angle: {least!r}, max_angle: 149, max_speed: {speed!r}}}}}\n")
    assert to_si(limits["position"][0], ANGLE) == pytest.approx(math.radians(least), rel=1e-15, abs=1e-300)
    assert to_si(str(limits["velocity"]), ANGULAR_SPEED) == pytest.approx(math.radians(speed), rel=1e-15)


def test_a_range_that_is_nearly_that_of_a_model_is_told(tmp_path: Path) -> None:
    found = import_texts(tmp_path, "joints: {pan: {id: 1, ticks: 4096, range: 251}}\n")
    assert found.data["actuators"]["pan_servo"]["model"] == "EX-106+"
    assert "4096 ticks over 250.92 degrees" in found.words
    assert "4096 ticks over 251 deg" in found.text
