"""Promises of grippers."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.servos.gripper import (
    CalibratedGripper,
    FingerGeometry,
    FingerGripper,
    GripAttempt,
    GripOutcome,
    GripperModel,
    GripPolicy,
    ParallelGripper,
)
from rbxcompose.domains.servos.transmission import Calibration

FINGERS = FingerGeometry(0.004, 0.065, 0.0, 0.09)
TABLE = ((0.0, 0.6), (0.01, 0.45), (0.02, 0.2), (0.03, -0.1), (0.042, -0.5))
MODELS: dict[str, GripperModel] = {
    "one_sided": FingerGripper(FINGERS, (0.1,), (True,)),
    "dual": FingerGripper(FINGERS, (0.1, -0.2), (False, True)),
    "parallel": ParallelGripper(-12.0, 0.3, 0.0, 0.06),
    "calibrated": CalibratedGripper(Calibration(TABLE)),
}
PARALLEL = ParallelGripper(10.0, 0.0, 0.0, 0.06)


@pytest.mark.parametrize("name", MODELS)
@given(share=st.floats(0.0, 1.0))
def test_the_opening_of_the_angles_of_an_opening_is_that_opening(name: str, share: float) -> None:
    model = MODELS[name]
    least, greatest = model.openings
    opening = least + share * (greatest - least)
    assert model.opening(model.angles(opening)) == pytest.approx(opening, abs=1e-9)


@pytest.mark.parametrize("name", MODELS)
@given(angle=st.floats(-9.0, 9.0))
def test_any_measured_angle_has_an_opening_within_the_range(name: str, angle: float) -> None:
    least, greatest = MODELS[name].openings
    assert least <= MODELS[name].opening((angle, angle)) <= greatest


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("opening", [-0.001, 0.2, math.nan])
def test_an_opening_outside_of_the_range_is_refused_with_the_reason(name: str, opening: float) -> None:
    with pytest.raises(ValueError, match="it opens from 0 m to"):
        GripAttempt(MODELS[name], opening, GripPolicy())


def test_the_fingers_of_a_dual_gripper_turn_in_opposite_directions() -> None:
    left, right = FingerGripper(FINGERS, (0.0, 0.0), (False, False)).angles(0.05)
    assert left == -right > 0.0


@pytest.mark.parametrize(
    ("build", "reason"),
    [
        (lambda: FingerGeometry(0.01, 0.02, 0.0, 0.09), "open from -0.03 m to 0.05 m, so 0.09 m is not reachable"),
        (lambda: FingerGeometry(0.1, 0.02, 0.0, 0.09), "so 0 m is not reachable"),
        (lambda: FingerGeometry(finger_length=0.0), "does not open anything"),
        (lambda: ParallelGripper(least=0.05, greatest=0.05), "no range"),
        (lambda: ParallelGripper(scale=0.0), "no angle belongs to an opening"),
    ],
)
def test_a_gripper_that_cannot_be_is_refused_with_the_reason(build: Callable[[], object], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        build()


def close_on(block: float, policy: GripPolicy, wanted: float = 0.0) -> tuple[GripOutcome | None, float]:
    """Close from 6 cm at 5 cm/s on a block [m]; return the outcome, and when it came."""
    grip, opening, now = GripAttempt(PARALLEL, wanted, policy), 0.06, 0.0
    for _ in range(1000):
        outcome = grip.step(now, PARALLEL.angles(opening), 0.4)
        if outcome is not None:
            return outcome, now
        now += 0.01
        opening = max(opening - 0.0005, block, wanted)
    return None, now


@pytest.mark.parametrize(("on_stall", "is_success"), [("success", True), ("fail", False)])
def test_a_gripper_that_makes_no_progress_has_stalled(on_stall: str, is_success: bool) -> None:
    policy = GripPolicy(on_stall="success" if on_stall == "success" else "fail")
    outcome, when = close_on(0.03, policy)
    assert outcome is not None
    assert (outcome.stalled, outcome.reached_goal, outcome.is_success) == (True, False, is_success)
    assert outcome.position == pytest.approx(0.03)
    assert outcome.effort == 0.4
    assert outcome.message == "stalled at 0.0300 m, 0.0300 m from 0.0000 m"
    assert when == pytest.approx(0.6 + 1.0, abs=0.05)


def test_a_gripper_that_arrives_has_reached_its_goal() -> None:
    outcome, when = close_on(0.0, GripPolicy(), wanted=0.02)
    assert outcome is not None
    assert (outcome.stalled, outcome.reached_goal, outcome.is_success) == (False, True, True)
    assert when == pytest.approx(0.76, abs=0.02)


def test_a_slow_gripper_does_not_stall_and_a_silent_one_is_not_judged() -> None:
    grip = GripAttempt(PARALLEL, 0.0, GripPolicy())
    for index in range(300):
        assert grip.step(index * 0.1, PARALLEL.angles(0.06 - index * 0.00019)) is None
    grip = GripAttempt(PARALLEL, 0.0, GripPolicy())
    for index in range(300):
        assert grip.step(index * 0.1, (math.nan,)) is None
