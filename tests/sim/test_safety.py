"""What protects a robot: it backs off for a while and no longer, turns away, and stands while it cannot know."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import AT_REST, Velocity2
from rbxcompose.domains.bases.checks import REACTION, lead_of, speed_within
from rbxcompose.domains.bases.components.safety_controller import SafetyControllerConfig, SafetyCore, SafetyPhase

DT = 0.05  # [s]
SETTINGS = st.builds(
    SafetyControllerConfig,
    pause=st.floats(0.0, 0.5),
    back_time=st.floats(0.0, 1.0),
    longest=st.floats(0.1, 3.0),
    turn=st.floats(0.0, math.pi).map("{!r} rad".format),
    settle=st.floats(0.0, 1.0),
)
AHEAD = st.floats(-math.pi / 2 + 0.01, math.pi / 2 - 0.01)
FELT = st.lists(st.lists(AHEAD, max_size=2), min_size=1, max_size=120)
"""Angles of bumpers that are pressed, step by step."""


class Felt:
    """A core that hears all its sensors at each step."""

    def __init__(self, settings: SafetyControllerConfig | None = None) -> None:
        self.core = SafetyCore(settings or SafetyControllerConfig())
        self.now = 0.0

    def step(self, *angles: float, dropped: bool = False, silent: str = "") -> Velocity2 | None:
        """Let a step pass with bumpers pressed at these angles [rad]; return what is commanded."""
        self.now += DT
        on = {"bumper": angles, "cliff": (), "wheel_drop": (1.5,) * dropped}
        for kind, there in on.items():
            if kind != silent:
                self.core.feel(kind, {str(number): angle for number, angle in enumerate(there)}, self.now)
        return self.core.command(self.now)

    def until_over(self, most: float = 20.0) -> list[Velocity2]:
        """Return what is commanded from now on while nothing is felt, until others may command."""
        found: list[Velocity2] = []
        while (one := self.step()) is not None:
            found.append(one)
            assert len(found) * DT < most
        return found


@given(SETTINGS, FELT)
def test_it_never_drives_towards_what_it_feels_and_never_backs_off_for_too_long(
    settings: SafetyControllerConfig, felt: list[list[float]]
) -> None:
    robot, backing = Felt(settings), 0.0
    for angles in felt:
        velocity = robot.step(*angles)
        assert velocity is not None or not angles
        if velocity is not None:
            assert velocity.linear <= 0
            assert velocity.linear == 0 or velocity.angular == 0
        backing = backing + DT if velocity is not None and velocity.linear < 0 else 0.0
        assert backing <= settings.longest + DT + 1e-9


@given(SETTINGS, FELT)
def test_it_always_lets_others_command_again_when_nothing_is_felt_any_more(
    settings: SafetyControllerConfig, felt: list[list[float]]
) -> None:
    robot = Felt(settings)
    for angles in felt:
        robot.step(*angles)
    longest = settings.pause + settings.back_time + settings.turn / settings.turn_rate
    robot.until_over(longest + 4 * DT)
    assert robot.step() is None


@given(SETTINGS, AHEAD.filter(lambda angle: abs(math.sin(angle)) > 0.11))
def test_it_stops_first_then_backs_off_then_turns_to_the_other_side(
    settings: SafetyControllerConfig, angle: float
) -> None:
    robot = Felt(settings)
    robot.step()
    found = [robot.step(angle), *robot.until_over()]
    kinds = [0 if one == AT_REST else 1 if one and one.linear < 0 else 2 for one in found]
    assert kinds == sorted(kinds)
    assert kinds.count(0) * DT >= settings.pause - 1e-9
    turning = [one.angular for one in found if one and one.angular]
    assert all(turn * angle < 0 for turn in turning)
    assert sum(map(abs, turning)) * DT == pytest.approx(settings.turn, abs=1.1 * DT * settings.turn_rate)


@given(SETTINGS, FELT, st.sampled_from(("bumper", "cliff", "wheel_drop")))
def test_it_stands_while_a_sensor_is_silent_or_a_wheel_hangs(
    settings: SafetyControllerConfig, felt: list[list[float]], kind: str
) -> None:
    robot = Felt(settings)
    assert robot.core.command(0.0) == AT_REST  # none was heard yet
    for angles in felt:
        robot.step(*angles)
    for number, angles in enumerate(felt):
        velocity = robot.step(*angles, silent=kind)
        assert velocity == AT_REST or (number + 1) * DT <= settings.silence + 1e-9
    for angles in felt:
        assert robot.step(*angles, dropped=True) == AT_REST
    assert all(one == AT_REST for one in robot.until_over()[: int(settings.settle / DT) - 1])


def test_what_it_cannot_get_away_from_ends_in_a_stand_until_somebody_helps() -> None:
    robot = Felt(SafetyControllerConfig(longest=1.0))
    found = [robot.step(0.0) for _ in range(100)]
    assert found[-1] == AT_REST
    assert robot.core.phase is SafetyPhase.STUCK
    assert sum(one.linear for one in found if one) * DT == pytest.approx(-0.1, abs=0.011)
    assert robot.until_over()[-1].angular > 0  # somebody has pushed it away: it turns, and goes on


def test_a_robot_that_is_touched_from_behind_drives_forwards_and_one_from_both_ends_stands() -> None:
    robot = Felt(SafetyControllerConfig(pause=0.0))
    assert robot.step(math.pi) == Velocity2(0.1)
    assert robot.step(math.pi, 0.0) == AT_REST
    assert robot.step(0.3) == Velocity2(-0.1)


def test_in_a_corner_it_goes_on_turning_to_the_same_side() -> None:
    robot = Felt()
    robot.step(1.0)
    assert robot.until_over()[-1].angular < 0
    robot.step(-1.0)
    assert robot.until_over()[-1].angular < 0
    for _ in range(100):
        robot.step()
    robot.step(-1.0)
    assert robot.until_over()[-1].angular > 0


def test_the_lead_of_sensors_is_that_at_the_worst_angle() -> None:
    kobuki = [(0.156, 0.0), (0.087, 0.136), (0.087, -0.136)]
    assert lead_of(kobuki, 0.23) == pytest.approx(0.156 - 0.115 * 0.507, abs=1e-3)
    assert lead_of([(0.1, 0.0)], 0.2) == pytest.approx(0.1 - 0.1 * math.tan(math.radians(60)))
    assert lead_of([(0.1, 0.2), (0.1, -0.2)], 0.2) == pytest.approx(0.1)


@given(st.floats(0.001, 1.0), st.floats(0.1, 5.0))
def test_a_base_at_the_speed_for_a_way_just_needs_that_way(way: float, acceleration: float) -> None:
    speed = speed_within(way, acceleration)
    assert speed * REACTION + speed**2 / (2 * acceleration) == pytest.approx(way)
    assert speed_within(-way, acceleration) == 0.0


def test_it_backs_off_as_long_as_it_feels_something_even_without_more_time() -> None:
    robot = Felt(SafetyControllerConfig(pause=0.0, back_time=0.0, turn="0 rad"))
    assert [robot.step(0.0) for _ in range(10)] == [Velocity2(-0.1)] * 10
    assert robot.step() is None
