"""Straight lines of the tip: the tip stays on them, and what cannot be followed says how far it was."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.geometry import Transform3
from rbxcompose.motion.inverse_kinematics import TOLERANCE
from rbxcompose.motion.joint_space import interpolated
from rbxcompose.motion.straight_line import JUMP, STEP, straight
from tests.motion.pi_hand import made

READY = np.array([0.4, -1.2, 0.1, 0.9, 0.6, 0.2])
SHIFT = st.floats(-0.05, 0.05)


@settings(max_examples=100, deadline=None)
@given(SHIFT, SHIFT, SHIFT)
def test_the_tip_stays_on_the_line_also_between_its_points(x: float, y: float, z: float) -> None:
    works = made()[2]
    start = works.kinematics.tip_pose(READY)
    goal = start.compose(Transform3((x, y, z)))
    line = straight(works.kinematics, works.planner.space, READY, goal)
    begin, way = np.array(start.translation), np.array(goal.translation) - start.translation
    for values in interpolated(line.positions, 0.01):
        at = np.array(works.kinematics.tip_pose(values).translation) - begin
        share = float(at @ way / max(float(way @ way), 1e-12))
        assert np.linalg.norm(at - share * way) < 3 * TOLERANCE
    assert np.all(np.abs(np.diff(line.positions, axis=0)) <= JUMP)
    assert (line.fraction == 1.0) is (not line.problem)
    if not line.problem:
        reached = works.kinematics.tip_pose(line.positions[-1]).translation
        assert reached == pytest.approx(goal.translation, abs=TOLERANCE)


def test_a_line_out_of_reach_tells_how_far_it_could_be_followed() -> None:
    works = made()[2]
    goal = works.kinematics.tip_pose(READY).compose(Transform3((1.0, 0.0, 0.0)))
    line = straight(works.kinematics, works.planner.space, READY, goal)
    assert 0.0 < line.fraction < 1.0
    assert f"at {line.fraction:.0%} of the line" in line.problem
    assert len(line.positions) == pytest.approx(1 + line.fraction / STEP)
