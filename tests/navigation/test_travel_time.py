"""The least time of a drive, beside what the drive on the simulated base takes."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import Pose2, wrap_angle
from rbxcompose.domains.bases.components.diff_drive_sim import DiffDriveSimConfig
from rbxcompose.domains.bases.driving import least_time
from tests.navigation.test_go_to import SETTINGS, drive

ANGLES = st.floats(-math.pi, math.pi)
BASE = DiffDriveSimConfig()


def least(start: Pose2, goal: Pose2) -> float:
    accelerations = {"acceleration": BASE.acceleration, "turn_acceleration": BASE.turn_acceleration}
    return least_time(start, goal, SETTINGS, **accelerations)


@given(ANGLES, st.floats(0.1, 8.0), ANGLES, ANGLES, st.floats(0.0, 1.0), ANGLES, st.floats(-1.0, 1.0))
def test_no_drive_is_faster_and_a_longer_one_is_hardly_slower(
    heading: float, distance: float, bearing: float, at_end: float, off: float, off_to: float, turned: float
) -> None:
    start = Pose2(0.0, 0.0, heading)
    goal = Pose2(distance * math.cos(bearing), distance * math.sin(bearing), at_end)
    away = off * SETTINGS.distance_tolerance
    real = Pose2(
        away * math.cos(off_to), away * math.sin(off_to), wrap_angle(heading + turned * SETTINGS.heading_tolerance)
    )
    taken, bound = drive(real, goal).duration, least(start, goal)
    assert bound <= taken
    if distance >= 20 * SETTINGS.distance_tolerance:
        assert bound >= 0.8 * taken


def test_unknown_accelerations_only_make_it_shorter() -> None:
    start, goal = Pose2(0.0, 0.0, 0.0), Pose2(1.0, 1.0, math.pi)
    assert least_time(start, goal, SETTINGS) < least(start, goal)
