"""Promises of driving to a pose, with the simulated base below."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import AT_REST, Pose2, wrap_angle
from rbxcompose.domains.bases.components.diff_drive_sim import DiffDriveCore, DiffDriveSimConfig
from rbxcompose.domains.bases.driving import GoToCore, GoToSettings

SETTINGS = GoToSettings()
LENGTHS = st.one_of(st.floats(-0.1, 0.1), st.floats(-3, 3))
POSES = st.builds(Pose2, LENGTHS, LENGTHS, st.floats(-math.pi, math.pi))


@dataclass(frozen=True, slots=True)
class Drive:
    """What came of one drive, after the base has come to rest."""

    done: bool
    duration: float
    base: DiffDriveCore

    def misses(self, goal: Pose2) -> tuple[float, float]:
        return self.base.pose.distance(goal), abs(wrap_angle(self.base.pose.heading - goal.heading))


def drive(start: Pose2, goal: Pose2, *, dt: float = 0.05, limit: float = 60.0) -> Drive:
    base, core = DiffDriveCore(DiffDriveSimConfig(), start), GoToCore(SETTINGS)
    core.start(goal)
    now, done = 0.0, False
    while not done and now < limit:
        velocity, done = core.update(base.pose, dt)
        base.command(velocity, now)
        now += dt
        base.step(now, dt)
    base.brake()
    base.step(now + 1.0, 1.0)
    return Drive(done, now, base)


@given(POSES, POSES, st.sampled_from([0.02, 0.05, 0.1]))
def test_it_arrives_from_anywhere_in_time_and_stays_there(start: Pose2, goal: Pose2, dt: float) -> None:
    result = drive(start, goal, dt=dt)
    distance, heading = result.misses(goal)
    assert result.done
    assert distance <= SETTINGS.distance_tolerance
    assert heading <= SETTINGS.heading_tolerance
    one_turn = math.tau / SETTINGS.turn_rate
    assert result.duration <= start.distance(goal) / SETTINGS.speed + one_turn + 1.5
    assert result.base.distance <= start.distance(goal) + 0.02  # hardly any overshoot or detour


@pytest.mark.parametrize(
    "start", [Pose2(0.0, 0.0, 0.0), Pose2(0.0, 0.0, math.pi / 2)], ids=["turn at the end", "turn at the start"]
)
def test_a_leg_of_one_metre_with_a_quarter_turn_takes_between_five_and_six_seconds(start: Pose2) -> None:
    assert 5.0 <= drive(start, Pose2(1.0, 0.0, math.pi / 2 - start.heading)).duration <= 6.0


def test_who_is_there_already_is_done_at_once() -> None:
    core = GoToCore(SETTINGS)
    core.start(Pose2(1.0, 1.0, 3.13))
    assert core.update(Pose2(1.03, 0.98, -3.13), 0.05) == (AT_REST, True)


def test_who_is_there_but_looks_elsewhere_only_turns() -> None:
    result = drive(Pose2(0.03, 0.0, 0.0), Pose2(0.0, 0.0, math.pi))
    assert result.done
    assert result.base.distance == 0.0


def test_passing_a_new_goal_at_speed_is_not_arriving() -> None:
    core = GoToCore(SETTINGS)
    core.start(Pose2(2.0, 0.0, 0.0))
    core.update(Pose2(0.985, 0.0, 0.0), 0.05)
    core.start(Pose2(1.0, 0.0, 0.0))
    _, done = core.update(Pose2(1.0, 0.0, 0.0), 0.05)
    assert not done


def test_a_newer_goal_replaces_the_older_one() -> None:
    core = GoToCore(SETTINGS)
    core.start(Pose2(1.0, 0.0, 0.0))
    core.update(Pose2(), 0.05)
    core.start(Pose2(-1.0, 0.0, 0.0))
    velocity, _ = core.update(Pose2(), 0.05)
    assert velocity.linear == 0.0
    assert velocity.angular > 0.0


def test_the_distance_that_is_left_can_be_told() -> None:
    core = GoToCore(SETTINGS)
    core.start(Pose2(3.0, 4.0, 0.0))
    core.update(Pose2(), 0.05)
    assert core.distance == 5.0


@given(POSES, POSES)
def test_commands_keep_to_the_limits_and_never_go_backwards(pose: Pose2, goal: Pose2) -> None:
    core = GoToCore(SETTINGS)
    core.start(goal)
    velocity, _ = core.update(pose, 0.05)
    assert 0.0 <= velocity.linear <= SETTINGS.speed
    assert abs(velocity.angular) <= SETTINGS.turn_rate


def test_it_slows_down_so_that_it_can_stop_at_the_goal() -> None:
    core = GoToCore(SETTINGS)
    core.start(Pose2(1.0, 0.0, 0.0))
    core.update(Pose2(0.0, 0.0, 0.0), 0.05)
    for left in (0.09, 0.06, 0.03):
        velocity, _ = core.update(Pose2(1.0 - left, 0.0, 0.0), 0.05)
        assert velocity.linear**2 / (2 * SETTINGS.deceleration) <= left + 1e-9


def test_a_base_that_does_not_move_is_stuck_after_a_while_and_a_new_goal_gives_it_another() -> None:
    core = GoToCore(SETTINGS)
    core.start(Pose2(1.0, 0.0, 0.0))
    seen = []
    for _ in range(103):
        core.update(Pose2(), 0.1)
        seen.append(core.stuck)
    core.start(Pose2(1.0, 0.0, 0.0))
    assert not any(seen[:100])
    assert seen[-1]
    assert not core.stuck


def test_a_base_that_creeps_is_not_stuck() -> None:
    core = GoToCore(SETTINGS)
    core.start(Pose2(1.0, 0.0, 0.0))
    for step in range(300):
        core.update(Pose2(step * 0.001, 0.0, 0.0), 0.1)
    assert not core.stuck


def test_updating_without_a_goal_is_a_mistake_of_the_caller() -> None:
    with pytest.raises(RuntimeError, match="before start"):
        GoToCore(SETTINGS).update(Pose2(), 0.05)
