"""Promises of the simulated battery."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.levels import Level
from rbxcompose.domains.power.components.battery_sim import BatteryCore, BatterySimConfig

SETTINGS = BatterySimConfig(runtime=60.0)


@given(st.floats(1, 7200), st.integers(1, 500))
def test_it_is_empty_after_its_runtime_however_the_time_is_divided(runtime: float, steps: int) -> None:
    battery = BatteryCore(BatterySimConfig(runtime=runtime))
    for _ in range(steps):
        battery.step(runtime / steps)
    assert battery.level == 0.0


@given(st.floats(1, 100), st.lists(st.floats(0, 10), max_size=30))
def test_it_drains_evenly_and_never_below_empty(runtime: float, steps: list[float]) -> None:
    battery = BatteryCore(BatterySimConfig(runtime=runtime))
    for dt in steps:
        battery.step(dt)
    assert battery.level == pytest.approx(max(0.0, 1.0 - sum(steps) / runtime), abs=1e-6)


@pytest.mark.parametrize(
    ("level", "status"),
    [
        (1.0, (Level.OK, "Battery OK")),
        (0.5, (Level.OK, "Battery OK")),
        (0.499, (Level.WARN, "Medium battery")),
        (0.2, (Level.WARN, "Medium battery")),
        (0.199, (Level.ERROR, "Low battery")),
        (0.0, (Level.ERROR, "Low battery")),
    ],
)
def test_it_complains_strictly_below_its_thresholds(level: float, status: tuple[Level, str]) -> None:
    assert BatteryCore(SETTINGS, level).status == status


def test_it_does_not_complain_at_a_threshold_that_it_came_to_in_small_steps() -> None:
    battery = BatteryCore(BatterySimConfig(runtime=20.0))
    for _ in range(10):
        battery.step(1.0)
    assert battery.status == (Level.OK, "Battery OK")
    for _ in range(6):
        battery.step(1.0)
    assert battery.status == (Level.WARN, "Medium battery")


def test_the_level_can_be_set() -> None:
    battery = BatteryCore(SETTINGS)
    assert battery.set(0.25) == ""
    assert battery.level == 0.25


@pytest.mark.parametrize("level", [-0.01, 1.01, 100.0, math.nan])
def test_a_level_that_no_battery_has_is_refused_with_a_reason(level: float) -> None:
    battery = BatteryCore(SETTINGS)
    assert "between 0 % and 100 %" in battery.set(level)
    assert battery.level == 1.0


def test_a_new_runtime_keeps_the_level() -> None:
    battery = BatteryCore(SETTINGS)
    battery.step(30.0)
    battery.settings = BatterySimConfig(runtime=10.0)
    assert battery.level == pytest.approx(0.5)
    battery.step(5.0)
    assert battery.level == 0.0
