"""Promises of trajectories before they move anything."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from rbxcompose.domains.servos.curves import JointSample
from rbxcompose.domains.servos.limits import MotionLimits
from rbxcompose.domains.servos.trajectory import (
    JointRules,
    TrajectoryCode,
    TrajectoryGoal,
    TrajectoryPlan,
    TrajectoryPoint,
    TrajectoryPolicy,
    TrajectoryRefusal,
    TrajectoryTolerance,
    plan_trajectory,
)
from tests.control.trajectories import FREE, NAMES, SLOW, TIGHT, WIDE, ZERO, goal, goals, planned, points, rules
from tests.loops import for_all

POLICY = TrajectoryPolicy()
CLAMP = TrajectoryPolicy(outside="clamp")
LINEAR = TrajectoryPolicy(interpolation="linear")
STRETCH = TrajectoryPolicy(too_fast="stretch")
ONE = goal((1.0, (0.5, 0.5)))
CODE = TrajectoryCode


def refusal(
    trajectory_goal: TrajectoryGoal, limits: MotionLimits = WIDE, policy: TrajectoryPolicy = POLICY, now: float = 0.0
) -> TrajectoryRefusal:
    answer = plan_trajectory(trajectory_goal, now, ZERO, rules(limits), policy)
    assert isinstance(answer, TrajectoryRefusal), answer
    return answer


WRONG: dict[str, tuple[TrajectoryGoal, TrajectoryCode, str]] = {
    "empty": (goal(), CODE.INVALID_GOAL, "it has no points"),
    "no joints": (TrajectoryGoal((), points((1.0, ()))), CODE.INVALID_JOINTS, "it names no joints"),
    "unknown": (
        replace(ONE, joints=("pan", "roll")),
        CODE.INVALID_JOINTS,
        "joint 'roll' is unknown; there are pan, tilt",
    ),
    "twice": (replace(ONE, joints=("pan", "pan")), CODE.INVALID_JOINTS, "joint 'pan' is named twice"),
    "too few": (goal((1.0, (0.5,))), CODE.INVALID_GOAL, "point 0 has 1 positions for 2 joints"),
    "velocities": (
        TrajectoryGoal(NAMES, (TrajectoryPoint(1.0, (0.0, 0.0), (0.0,)),)),
        CODE.INVALID_GOAL,
        "point 0 has 1 velocities for 2 joints",
    ),
    "no number": (goal((1.0, (0.5, math.nan))), CODE.INVALID_GOAL, "point 0 has nan among its positions"),
    "no time": (goal((math.inf, (0.5, 0.5))), CODE.INVALID_GOAL, "the time of point 0 is inf"),
    "no start": (goal((1.0, (0.5, 0.5)), start=math.nan), CODE.INVALID_GOAL, "its start nan is not a finite number"),
    "before": (goal((-1.0, (0.5, 0.5))), CODE.INVALID_GOAL, "point 0 is at -1 s, before the start"),
    "equal": (goal((1.0, (0, 0)), (1.0, (1, 1))), CODE.INVALID_GOAL, "points 0 and 1 are both at 1 s"),
    "back": (
        goal((1.0, (0, 0)), (0.5, (1, 1))),
        CODE.INVALID_GOAL,
        "point 1 is at 0.5 s, before the point in front of it",
    ),
    "some": (
        TrajectoryGoal(NAMES, (TrajectoryPoint(1.0, (0, 0), (0, 0)), TrajectoryPoint(2.0, (1, 1)))),
        CODE.INVALID_GOAL,
        "point 1 has no velocities, but others have",
    ),
    "accelerations": (
        TrajectoryGoal(NAMES, (TrajectoryPoint(1.0, (0, 0), (), (0, 0)),)),
        CODE.INVALID_GOAL,
        "it has accelerations without velocities",
    ),
    "moving": (
        TrajectoryGoal(NAMES, (TrajectoryPoint(1.0, (0, 0), (0, 0.5)),)),
        CODE.INVALID_GOAL,
        "joint 'tilt' has a velocity of 0.5 at the end, not 0",
    ),
    "outside": (goal((9.0, (0.5, 3.5))), CODE.INVALID_GOAL, "joint 'tilt' at 3.5 is outside of its limits"),
}


@for_all("name", WRONG)
def test_a_wrong_trajectory_is_refused_with_code_and_reason(name: str) -> None:
    trajectory_goal, code, message = WRONG[name]
    answer = refusal(trajectory_goal)
    assert (answer.code, answer.message) == (code, message)


def test_missing_joints_hold() -> None:
    part = TrajectoryGoal(("tilt",), points((1.0, (0.5,))))
    assert planned(part).curves.keys() == {"tilt"}


@given(goals(), st.sampled_from(["auto", "linear"]))
def test_every_waypoint_is_hit_at_its_time(one: TrajectoryGoal, interpolation: str) -> None:
    plan = planned(one, FREE, LINEAR if interpolation == "linear" else POLICY)
    assert plan.notes == ()
    for point in one.points:
        for name, position in zip(NAMES, point.positions, strict=True):
            assert plan.curves[name].sample(point.time).position == pytest.approx(position, abs=1e-9)


@given(goals())
def test_position_and_velocity_have_no_jumps(one: TrajectoryGoal) -> None:
    plan, dt = planned(one, FREE), 1e-6
    for curve in plan.curves.values():
        for point in one.points:
            before, after = curve.sample(point.time - dt), curve.sample(point.time + dt)
            assert before.position == pytest.approx(after.position, abs=1e-4)
            assert before.velocity == pytest.approx(after.velocity, abs=1e-2)


@given(goals())
def test_a_trajectory_that_is_too_fast_is_stretched_below_the_limits_and_keeps_its_way(one: TrajectoryGoal) -> None:
    plain, slow = planned(one, FREE), planned(one, SLOW, STRETCH)
    assert all(curve.speed <= 1.0 + 1e-6 for curve in slow.curves.values())
    factor = slow.curves["pan"].duration / plain.curves["pan"].duration
    assert bool(slow.notes) == (factor > 1.0)
    for name in NAMES:
        for share in (0.2, 0.5, 0.7):
            time = share * plain.curves[name].duration
            expected = plain.curves[name].sample(time).position
            assert slow.curves[name].sample(time * factor).position == pytest.approx(expected, abs=1e-6)


def test_too_fast_is_refused_with_the_joint_its_speed_and_its_limit() -> None:
    answer = refusal(goal((1.0, (0.0, 2.0))), TIGHT)
    assert answer.message == "joint 'tilt' would move at 3, its limit is 1"
    assert refusal(goal((1.0, (0.0, 2.0))), TIGHT, LINEAR).message == "joint 'tilt' would move at 2, its limit is 1"


def test_a_joint_that_may_not_move_is_not_stretched_for_ever() -> None:
    assert "its limit is 0" in refusal(ONE, MotionLimits(velocity=0.0), STRETCH).message


def test_positions_outside_are_clamped_if_that_is_wanted_and_it_is_said() -> None:
    plan = planned(goal((9.0, (0.5, 3.5))), policy=CLAMP)
    assert plan.curves["tilt"].last == pytest.approx(3.0)
    assert plan.notes == ("joint 'tilt' is clamped from 3.5 to 3",)


def test_a_spline_of_ours_that_would_leave_the_limits_becomes_less_smooth_instead() -> None:
    one = goal((1.0, (0.0, 0.0)), (1.3, (0.0, 3.0)), (2.3, (0.0, 3.0)))
    plan = planned(one)
    assert plan.notes == ("joint 'tilt' has a less smooth curve, which stays within its limits",)
    assert plan.curves["tilt"].extent[1] <= 3.0 + 1e-9


def test_velocities_of_the_user_that_leave_the_limits_are_refused_or_clamped() -> None:
    trajectory_goal = TrajectoryGoal(
        NAMES, (TrajectoryPoint(1.0, (0.0, 2.9), (0.0, 3.0)), TrajectoryPoint(2.0, (0.0, 2.9), (0.0, 0.0)))
    )
    assert "outside its limits" in refusal(trajectory_goal).message
    curve = planned(trajectory_goal, policy=CLAMP).curves["tilt"]
    assert max(curve.sample(i / 100).position for i in range(200)) == 3.0


def test_points_of_the_past_are_dropped_and_that_is_said() -> None:
    one = goal((1.0, (0.1, 0.1)), (2.0, (0.2, 0.2)), (3.0, (0.3, 0.3)), start=10.0)
    plan = planned(one, now=12.0)
    assert plan.notes == ("2 of 3 points are past, and dropped",)
    assert (plan.begin, plan.end) == (12.0, 13.0)
    assert plan.curves["pan"].last == pytest.approx(0.3)


def test_a_trajectory_of_the_past_is_no_success() -> None:
    answer = refusal(goal((1.0, (0.1, 0.1)), start=10.0), now=12.0)
    assert answer == TrajectoryRefusal(CODE.OLD_HEADER_TIMESTAMP, "all points are past, the last by 1.000 s")


@example(0.25, 0.109375, 0.875)  # the time that one joint needs is one in which the other would overshoot
@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(-0.9, 0.9))
def test_a_point_at_zero_is_reached_as_fast_as_the_limits_allow(pan: float, tilt: float, speed: float) -> None:
    start = {name: JointSample(0.0, speed) for name in NAMES}
    plan = plan_trajectory(goal((0.0, (pan, tilt))), 5.0, start, rules(TIGHT), CLAMP)
    assert isinstance(plan, TrajectoryPlan)
    assert "as fast as the limits allow" in plan.notes[0]
    for name, position in zip(NAMES, (pan, tilt), strict=True):
        curve = plan.curves[name]
        assert curve.last == pytest.approx(position)
        assert curve.speed <= 1.0 + 1e-6
        hardest = max(abs(curve.sample(curve.duration * share).acceleration) for share in (0.0, 1 - 1e-12))
        assert hardest <= 4.0 + 1e-3


def test_the_time_to_a_point_at_zero_is_the_least_one() -> None:
    assert planned(goal((0.0, (1.0, 0.0))), TIGHT).end == pytest.approx(1.5, rel=1e-6)  # 3/2 d/v of a cubic
    assert planned(goal((0.0, (0.02, 0.0))), TIGHT).end == pytest.approx(math.sqrt(0.03), rel=1e-6)  # sqrt(6 d/a)
    assert planned(goal((0.0, (1.0, 0.0))), TIGHT, LINEAR).end == pytest.approx(1.0, rel=1e-6)


def test_a_first_point_where_the_joints_are_costs_no_time_and_another_one_delays_the_rest() -> None:
    assert planned(goal((0.0, (0.0, 0.0)), (4.0, (1.0, 1.0))), TIGHT).end == 4.0
    assert planned(goal((0.0, (1.0, 0.0)), (4.0, (1.0, 1.0))), TIGHT).end == pytest.approx(5.5)


@pytest.mark.parametrize("limits", [TIGHT, FREE])
@pytest.mark.parametrize("gap", [0.003, -0.02])
def test_a_small_gap_to_a_slow_motion_fades_out_within_the_limits_and_costs_no_time(
    limits: MotionLimits, gap: float
) -> None:
    speed = 0.01
    rows = ((0.0, 0.0, 0.0), (0.001, 0.5e-5, speed), (3.0, 0.03, speed), (3.001, 0.030005, 0.0))
    slow = TrajectoryGoal(NAMES, tuple(TrajectoryPoint(time, (at, at), (v, v)) for time, at, v in rows))
    start = {name: JointSample(gap) for name in NAMES}
    plan = plan_trajectory(slow, 0.0, start, rules(limits), replace(POLICY, tolerance=TrajectoryTolerance(goal=0.05)))
    assert isinstance(plan, TrajectoryPlan), plan
    curve = plan.curves["pan"]
    assert (curve.first, curve.duration) == (gap, 3.001)
    assert curve.speed <= speed + 0.06
    assert curve.sample(2.9).position == pytest.approx(0.029, abs=1e-4)


def test_a_gap_for_which_a_fast_motion_leaves_no_speed_is_closed_first() -> None:
    times = [0.1 * step for step in range(11)]
    at_full_speed = [TrajectoryPoint(time, (time, 0.0), (1.0, 0.0)) for time in times]
    fast = TrajectoryGoal(NAMES, (*at_full_speed, TrajectoryPoint(1.1, (1.05, 0.0), (0.0, 0.0))))
    policy = TrajectoryPolicy(tolerance=TrajectoryTolerance(goal=0.05))
    plan = plan_trajectory(fast, 0.0, {name: JointSample(-0.01) for name in NAMES}, rules(TIGHT), policy)
    assert isinstance(plan, TrajectoryPlan), plan
    assert "the point at 0 s is reached as fast as the limits allow" in plan.notes[0]


def test_without_limits_a_point_at_zero_is_refused() -> None:
    assert "no limits that say how fast" in refusal(goal((0.0, (1.0, 0.0))), MotionLimits()).message


@given(st.floats(-50.0, 50.0), st.floats(-3.0, 3.0))
def test_a_joint_that_turns_without_end_takes_the_nearest_turn(start: float, target: float) -> None:
    joints = {"wheel": JointRules(MotionLimits(), is_continuous=True)}
    trajectory_goal = TrajectoryGoal(("wheel",), points((1.0, (target,))))
    plan = plan_trajectory(trajectory_goal, 0.0, {"wheel": JointSample(start)}, joints, POLICY)
    assert isinstance(plan, TrajectoryPlan)
    last = plan.curves["wheel"].last
    assert abs(last - start) <= math.pi + 1e-9
    assert math.remainder(last - target, math.tau) == pytest.approx(0.0, abs=1e-9)
