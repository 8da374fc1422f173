"""Straight lines of the tip: the tip stays on them, and what cannot be followed says how far it was."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion.groups import interpolated
from rbxcompose.domains.arms.motion.hand_task import JUMP, STEP, LineEnd, line_steps
from rbxcompose.domains.arms.motion.inverse_kinematics import TOLERANCE
from tests.motion.pi_hand import made

Array = NDArray[np.float64]
READY = np.array([0.4, -1.2, 0.1, 0.9, 0.6, 0.2])
SHIFT = st.floats(-0.05, 0.05)


def followed(goal: Transform3) -> tuple[list[Array], LineEnd]:
    """Return the positions on the line from `READY` to a pose, and how it ends."""
    works = made()[2]
    found, steps = [READY], line_steps(works.kinematics, works.planner.space, READY, goal)
    while True:
        try:
            found.append(next(steps))
        except StopIteration as ended:
            end: LineEnd = ended.value
            return found, end


@given(SHIFT, SHIFT, SHIFT)
def test_the_tip_stays_on_the_line_also_between_its_points(x: float, y: float, z: float) -> None:
    works = made()[2]
    start = works.kinematics.tip_pose(READY)
    goal = start.compose(Transform3((x, y, z)))
    positions, end = followed(goal)
    begin, way = np.array(start.translation), np.array(goal.translation) - start.translation
    for values in interpolated(positions, 0.01):
        at = np.array(works.kinematics.tip_pose(values).translation) - begin
        share = float(at @ way / max(float(way @ way), 1e-12))
        assert np.linalg.norm(at - share * way) < 3 * TOLERANCE
    assert np.all(np.abs(np.diff(positions, axis=0)) <= JUMP)
    assert (end.fraction == 1.0) is (not end.problem)
    if not end.problem:
        reached = works.kinematics.tip_pose(positions[-1]).translation
        assert reached == pytest.approx(goal.translation, abs=TOLERANCE)


def test_a_line_out_of_reach_tells_how_far_it_could_be_followed() -> None:
    positions, end = followed(made()[2].kinematics.tip_pose(READY).compose(Transform3((1.0, 0.0, 0.0))))
    assert 0.0 < end.fraction < 1.0
    assert f"at {end.fraction:.0%} of the line" in end.problem
    assert len(positions) == pytest.approx(1 + end.fraction / STEP)
