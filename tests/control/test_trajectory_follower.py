"""Promises of what follows trajectories."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.servos.curves import JointSample
from rbxcompose.domains.servos.limits import Limiter, MotionLimits
from rbxcompose.domains.servos.trajectory import (
    TrajectoryCode,
    TrajectoryGoal,
    TrajectoryPlan,
    TrajectoryPolicy,
    TrajectoryRefusal,
    TrajectoryTolerance,
)
from rbxcompose.domains.servos.trajectory_follower import FollowStep, TrajectoryFollower, TrajectoryOutcome
from tests.control.trajectories import FREE, NAMES, TIGHT, goal, goals, points, rules

DT = 0.01
POLICY = TrajectoryPolicy()


@dataclass
class Arm:
    """Two joints behind limiters, which do just what is commanded, or stand still if they are `blocked`."""

    policy: TrajectoryPolicy = POLICY
    limits: MotionLimits = TIGHT
    now: float = 0.0
    blocked: set[str] = field(default_factory=set)
    steps: list[FollowStep] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.follower = TrajectoryFollower(rules(self.limits), self.policy)
        self.limiters = {name: Limiter(self.limits, 0.0) for name in NAMES}
        self.measured = {name: JointSample(0.0) for name in NAMES}

    @property
    def commanded(self) -> dict[str, JointSample]:
        return {name: JointSample(limiter.position, limiter.velocity) for name, limiter in self.limiters.items()}

    def send(self, trajectory_goal: TrajectoryGoal) -> TrajectoryPlan | TrajectoryRefusal:
        return self.follower.accept(trajectory_goal, self.now, self.commanded)

    def step(self) -> FollowStep:
        """Let a cycle pass."""
        self.now += DT
        step = self.follower.step(self.now, self.measured, self.commanded)
        for name, desired in step.desired.items():
            before = self.limiters[name].position
            self.limiters[name].want(desired.position, (desired.position - before) / DT)
        for name, limiter in self.limiters.items():
            limiter.step(DT)
            if name not in self.blocked:
                self.measured[name] = JointSample(limiter.position, limiter.velocity)
        self.steps.append(step)
        return step

    def run(self, seconds: float) -> TrajectoryOutcome | None:
        """Let time pass until there is an outcome; return it."""
        for _ in range(round(seconds / DT)):
            outcome = self.step().outcome
            if outcome is not None:
                return outcome
        return None


def test_a_trajectory_within_the_limits_arrives_at_its_time() -> None:
    arm = Arm()
    arm.send(goal((2.0, (0.5, -0.5)), (5.0, (0.0, 0.5))))
    outcome = arm.run(6.0)
    assert outcome is not None
    assert (outcome.code, outcome.message) == (TrajectoryCode.SUCCESSFUL, "arrived")
    assert arm.now == pytest.approx(5.0, abs=0.03)
    assert arm.measured["tilt"].position == pytest.approx(0.5, abs=1e-3)
    arm.step()
    assert not arm.follower.is_moving
    assert arm.step() == FollowStep()


@given(goals(), goals(), st.floats(0.0, 3.0), st.floats(0.0, 1.0))
def test_a_replacement_continues_position_and_velocity(
    first: TrajectoryGoal, second: TrajectoryGoal, at: float, ahead: float
) -> None:
    arm = Arm(limits=FREE)
    arm.send(first)
    arm.run(at)
    new = replace(second, start=arm.now + ahead if ahead > 0.1 else 0.0)
    plan = arm.send(new)
    assert isinstance(plan, TrajectoryPlan)
    eps = 1e-7
    assert plan.begin == (new.start or arm.now)
    before = arm.follower.step(plan.begin - eps, arm.measured, arm.commanded).desired if new.start else None
    arm.follower.step(plan.begin, arm.measured, arm.commanded)
    after = arm.follower.step(plan.begin + eps, arm.measured, arm.commanded).desired
    for name, sample in (before or {}).items():
        assert sample.position == pytest.approx(after[name].position, abs=1e-4)
        assert sample.velocity == pytest.approx(after[name].velocity, abs=1e-3)
    for point in second.points:
        desired = arm.follower.step(plan.begin + point.time, arm.measured, arm.commanded).desired
        assert [desired[name].position for name in NAMES] == pytest.approx(point.positions, abs=1e-9)


def test_joints_that_a_replacement_leaves_out_come_to_rest_within_their_limits() -> None:
    arm = Arm()
    arm.send(goal((2.0, (1.0, 1.0))))
    arm.run(1.0)
    speed = arm.measured["tilt"].velocity
    assert speed > 0.7
    position = arm.measured["tilt"].position
    arm.send(TrajectoryGoal(("pan",), points((2.0, (0.0,)))))
    outcome = arm.run(4.0)
    assert outcome is not None
    assert outcome.code == TrajectoryCode.SUCCESSFUL
    assert arm.measured["tilt"].position - position == pytest.approx(speed**2 / (2 * 4.0), abs=0.02)


@pytest.mark.parametrize("how", ["cancel", "abort"])
def test_who_ends_a_trajectory_lets_its_joints_decelerate_and_hold(how: str) -> None:
    arm = Arm()
    arm.send(goal((2.0, (1.0, 1.0))))
    arm.run(1.0)
    position, speed = arm.measured["pan"].position, arm.measured["pan"].velocity
    outcome = arm.follower.cancel(arm.now) if how == "cancel" else arm.follower.abort(arm.now, "tilt is hot")
    assert outcome is not None
    assert outcome.message == ("canceled" if how == "cancel" else "tilt is hot")
    assert not arm.follower.is_following
    assert arm.run(1.0) is None
    assert arm.measured["pan"].velocity == pytest.approx(0.0, abs=1e-9)
    assert arm.measured["pan"].position - position == pytest.approx(speed**2 / (2 * 4.0), abs=0.02)
    assert not arm.follower.is_moving
    assert arm.follower.cancel(arm.now) is None


def test_a_blocked_joint_ends_the_trajectory_with_its_name_error_and_tolerance() -> None:
    arm = Arm(TrajectoryPolicy(tolerance=TrajectoryTolerance(path=0.1)))
    arm.blocked = {"tilt"}
    arm.send(goal((2.0, (1.0, 1.0))))
    outcome = arm.run(3.0)
    assert outcome is not None
    assert outcome.code == TrajectoryCode.PATH_TOLERANCE_VIOLATED
    assert 0.0 < arm.now < 1.0
    assert outcome.message.startswith("joint 'tilt' is 0.10")
    assert outcome.message.endswith("from its path, more than 0.1")
    arm.run(1.0)
    assert all(limiter.velocity == pytest.approx(0.0, abs=1e-9) for limiter in arm.limiters.values())


def test_who_never_arrives_fails_after_the_goal_time_which_is_finite() -> None:
    arm = Arm()
    arm.blocked = {"pan"}
    arm.send(goal((1.0, (0.5, 0.5))))
    outcome = arm.run(10.0)
    assert outcome is not None
    assert outcome.code == TrajectoryCode.GOAL_TOLERANCE_VIOLATED
    assert arm.now == pytest.approx(2.0, abs=0.03)
    assert outcome.message == "joint 'pan' is 0.5 from its goal, more than 0.05"


def test_tolerances_of_the_goal_take_the_place_of_those_of_the_policy() -> None:
    arm = Arm()
    arm.blocked = {"pan"}
    lenient = {"pan": TrajectoryTolerance(goal=0.6)}
    arm.send(replace(goal((1.0, (0.5, 0.5))), tolerances=lenient, goal_time=math.inf))
    outcome = arm.run(3.0)
    assert outcome is not None
    assert outcome.code == TrajectoryCode.SUCCESSFUL


def test_a_joint_that_is_not_at_rest_has_not_arrived() -> None:
    arm = Arm()
    arm.send(goal((1.0, (0.5, 0.5))))
    arm.run(0.99)
    arm.blocked = {"pan"}
    arm.measured["pan"] = JointSample(0.5, 0.2)
    outcome = arm.run(3.0)
    assert outcome is not None
    assert outcome.message == "joint 'pan' is 0.2 per second fast at its goal, more than 0.01"


def test_a_measurement_that_is_no_number_violates_any_tolerance() -> None:
    arm = Arm(TrajectoryPolicy(tolerance=TrajectoryTolerance(path=10.0)))
    arm.send(goal((1.0, (0.5, 0.5))))
    arm.measured["pan"] = JointSample(math.nan)
    step = arm.follower.step(0.1, arm.measured, arm.commanded)
    assert step.outcome is not None
    assert step.outcome.message.startswith("joint 'pan'")


def test_a_refused_goal_leaves_the_running_one_alone() -> None:
    arm = Arm()
    arm.send(goal((1.0, (0.5, 0.5))))
    arm.run(0.3)
    assert isinstance(arm.send(goal((1.0, (9.0, 9.0)))), TrajectoryRefusal)
    outcome = arm.run(2.0)
    assert outcome is not None
    assert outcome.code == TrajectoryCode.SUCCESSFUL


def test_a_trajectory_starts_from_the_command() -> None:
    arm = Arm()
    arm.measured["pan"] = JointSample(0.2)
    plan = arm.send(goal((2.0, (0.5, 0.5))))
    assert isinstance(plan, TrajectoryPlan)
    assert plan.curves["pan"].first == 0.0


def test_who_is_nowhere_does_not_start() -> None:
    arm = Arm()
    nowhere = arm.commanded | {"pan": JointSample(math.nan)}
    answer = arm.follower.accept(goal((2.0, (0.5, 0.5))), arm.now, nowhere)
    assert isinstance(answer, TrajectoryRefusal)
    assert answer.message == "it is not known where joint 'pan' is"


def test_a_trajectory_of_the_future_waits_at_rest() -> None:
    arm = Arm()
    arm.send(replace(goal((1.0, (0.5, 0.5))), start=1.0))
    assert arm.run(0.95) is None
    assert arm.measured["pan"].position == 0.0
    assert arm.follower.is_following
    outcome = arm.run(3.0)
    assert outcome is not None
    assert arm.now == pytest.approx(2.0, abs=0.03)


def test_a_joint_that_loses_its_torque_ends_the_trajectory_of_all_and_is_not_led_any_more() -> None:
    arm = Arm()
    arm.send(goal((1.0, (0.5, 0.5))))
    arm.run(0.3)
    outcome = arm.follower.lose("pan", arm.now, "pan was relaxed")
    assert outcome is not None
    assert outcome.message == "pan was relaxed"
    assert arm.step().desired.keys() == {"tilt"}
    assert arm.follower.lose("tilt", arm.now, "so was tilt") is None
    assert arm.step() == FollowStep()


def test_a_joint_that_holds_may_lose_its_torque_while_others_go_on() -> None:
    arm = Arm()
    arm.send(TrajectoryGoal(("pan",), points((1.0, (0.5,)))))
    arm.run(0.3)
    assert arm.follower.lose("tilt", arm.now, "tilt was relaxed") is None
    outcome = arm.run(2.0)
    assert outcome is not None
    assert outcome.code == TrajectoryCode.SUCCESSFUL
