"""What people slow down stays on its path and within its accelerations, holds, and arrives when it may go on."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.domains.servos.curves import JointSample
from rbxcompose.domains.servos.limits import MotionLimits
from rbxcompose.domains.servos.trajectory import TrajectoryCode
from rbxcompose.domains.servos.trajectory_follower import SPARE, share_mistake
from tests.control.test_trajectory_follower import DT, Arm
from tests.control.trajectories import NAMES, goal

HARD = 1.0
SMOOTH = MotionLimits(-2.0, 2.0, 2.0, HARD)
ACROSS = goal((4.0, (1.0, -0.5)))


def moving() -> Arm:
    arm = Arm(limits=SMOOTH)
    arm.send(ACROSS)
    return arm


@settings(max_examples=settings().max_examples // 2)
@given(st.lists(st.tuples(st.integers(1, 120), st.floats(0.0, 1.0)), max_size=5))
def test_the_joints_stay_on_their_path_and_brake_as_hard_as_they_may(changes: list[tuple[int, float]]) -> None:
    arm, seen = moving(), [(JointSample(0.0), JointSample(0.0))]
    for cycles, share in [*changes, (2_000, 1.0)]:
        arm.follower.pace.share = share
        for _ in range(cycles):
            desired = arm.step().desired
            if desired and not arm.steps[-1].outcome:
                seen.append((desired[NAMES[0]], desired[NAMES[1]]))
    outcomes = [step.outcome for step in arm.steps if step.outcome is not None]
    assert [outcome.code for outcome in outcomes] == [TrajectoryCode.SUCCESSFUL]
    assert arm.measured[NAMES[0]].position == pytest.approx(1.0, abs=1e-3)
    for sample, other in seen:
        assert other.position == pytest.approx(-0.5 * sample.position, abs=1e-9)
    for (before, _), (after, _) in pairwise(seen):
        assert after.position - before.position >= -1e-9
        assert abs(after.velocity - before.velocity) <= (1.0 + SPARE) * HARD * DT + 2e-3
        assert abs(after.position - before.position - DT * (before.velocity + after.velocity) / 2) < 2e-4


def test_a_motion_that_is_held_waits_as_long_as_people_want_and_takes_that_much_longer() -> None:
    arm = moving()
    assert arm.run(1.5) is None
    arm.follower.pace.share = 0.0
    assert arm.run(1.0) is None
    held = arm.measured[NAMES[0]].position
    assert arm.run(20.0) is None
    assert arm.measured[NAMES[0]].position == pytest.approx(held, abs=1e-4)
    assert arm.measured[NAMES[0]].velocity == 0.0
    arm.follower.pace.share = 1.0
    outcome = arm.run(5.0)
    assert outcome is not None
    assert outcome.code is TrajectoryCode.SUCCESSFUL
    assert 24.0 < arm.now < 26.5


def test_at_half_of_its_speed_a_motion_takes_twice_as_long() -> None:
    arm = Arm(limits=SMOOTH)
    arm.follower.pace.share = 0.5
    arm.send(ACROSS)
    outcome = arm.run(10.0)
    assert outcome is not None
    assert arm.now == pytest.approx(8.0, abs=0.05)


def test_a_motion_that_is_held_can_be_cancelled_and_replaced_without_a_jump() -> None:
    arm = moving()
    arm.run(2.0)
    arm.follower.pace.share = 0.3
    arm.run(0.3)
    before = arm.steps[-1].desired[NAMES[0]]
    arm.send(goal((5.0, (0.2, 0.2))))
    after = arm.step().desired[NAMES[0]]
    assert after.position == pytest.approx(before.position + DT * before.velocity, abs=1e-3)
    assert after.velocity == pytest.approx(before.velocity, abs=2 * HARD * DT + 1e-3)
    arm.run(0.5)
    before = arm.steps[-1].desired[NAMES[0]]
    assert arm.follower.cancel(arm.now) is not None
    after = arm.step().desired[NAMES[0]]
    assert after.velocity == pytest.approx(before.velocity, abs=2 * HARD * DT)


def test_what_is_led_live_keeps_its_speed() -> None:
    arm = Arm(limits=SMOOTH)
    arm.follower.pace.share = 0.0
    arm.follower.accept(ACROSS, arm.now, arm.commanded, is_live=True)
    assert arm.run(5.0) is not None


@pytest.mark.parametrize("share", [math.nan, -0.1, 1.1, math.inf])
def test_what_is_no_share_says_so(share: float) -> None:
    assert "from 0 % to 100 %" in share_mistake(share)
