"""Promises of joints that slide."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.control.calibration import Calibration
from rbxcompose.control.limits import MotionLimits
from rbxcompose.control.linear import LinearJoint

TABLE = Calibration(((100.0, 0.4), (300.0, 0.25), (900.0, 0.0)))
LIFT = LinearJoint(TABLE, MotionLimits(0.05, 0.35, 0.05))


@given(st.floats(0.05, 0.35))
def test_the_position_of_the_reading_of_a_position_is_that_position(position: float) -> None:
    assert LIFT.position(LIFT.reading(position)) == pytest.approx(position, abs=1e-9)


@pytest.mark.parametrize("reading", [99.0, 901.0, math.nan, math.inf])
def test_a_reading_beyond_the_calibration_is_no_position(reading: float) -> None:
    assert LIFT.position(reading) is None


def test_positions_are_clamped_to_the_limits() -> None:
    assert LIFT.reading(9.0) == LIFT.reading(0.35)
    assert LIFT.direction(9.0, 0.35) == 0


@given(st.floats(-0.1, 0.5), st.floats(0.05, 0.35), st.sampled_from([0.001, 0.004]))
def test_it_arrives_within_the_dead_band_and_stays(wanted: float, position: float, step: float) -> None:
    moving, starts = 0, 0
    for _ in range(500):
        now = LIFT.direction(wanted, position, moving=moving)
        starts += now != moving and now != 0
        moving = now
        position += step * now
    assert abs(position - LIFT.limits.clamped(wanted)) <= LIFT.dead_band
    assert moving == 0
    assert starts <= 1


def test_a_joint_that_moves_goes_on_to_the_wanted_position_and_not_to_the_edge_of_the_dead_band() -> None:
    assert LIFT.direction(0.2, 0.195) == 0
    assert LIFT.direction(0.2, 0.195, moving=1) == 1
    assert LIFT.direction(0.2, 0.2, moving=1) == 0


@pytest.mark.parametrize(("wanted", "position"), [(0.2, None), (math.nan, 0.2)])
def test_without_a_position_or_a_wish_it_stands_still(wanted: float, position: float | None) -> None:
    assert LIFT.direction(wanted, position, moving=1) == 0


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match=r"'upper' of 0\.5 m is beyond the calibration: 0 m to 0\.4 m"):
        LinearJoint(TABLE, MotionLimits(upper=0.5))
    with pytest.raises(ValueError, match="a dead band of"):
        LinearJoint(TABLE, MotionLimits(), dead_band=-0.1)
