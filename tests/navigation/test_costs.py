"""What it costs to be somewhere on a map."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from rbxcompose.base.geometry import Pose2, Velocity2
from rbxcompose.domains.navigation.costs import INSCRIBED, LETHAL, NO_INFORMATION, CostSettings, CostZone, LayeredCosts
from rbxcompose.domains.worlds.ray_casting import Rays
from rbxcompose.domains.worlds.shapes import WorldBox, WorldCylinder, WorldShape
from tests.navigation.houses import HOUSE, ONE_WALL, SIDE, is_blocked, room

SETTINGS = CostSettings(radius=0.2, inflation=0.5)
ANGLES = np.linspace(-math.pi, math.pi, 360, endpoint=False)
FREE = np.full(360, math.inf)


def test_costs_fall_with_the_distance_to_a_wall() -> None:
    costs = LayeredCosts(ONE_WALL, SETTINGS)
    along = [costs.value_at(0.025 + step * SIDE, 0.0) for step in range(20)]
    assert along[:2] == [LETHAL, LETHAL]
    assert along[2:7] == [INSCRIBED] * 5
    assert all(before >= after for before, after in pairwise(along))
    assert along[-1] == 0
    assert costs.value_at(99, 0) == NO_INFORMATION


def test_zones_keep_out_and_slow_down() -> None:
    square = ((1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0))
    slow = tuple((-x, y) for x, y in square)
    costs = LayeredCosts(room(), SETTINGS, [CostZone("stairs", square), CostZone("hall", slow, 0.3)])
    assert is_blocked(costs, 1.5, 1.5)
    assert not is_blocked(costs, -1.5, 1.5)
    assert [costs.share_at(*at) for at in ((-1.5, 1.5), (0.0, 0.0), (99.0, 0.0))] == [0.3, 1.0, 1.0]


def test_a_scan_marks_what_it_hits_and_clears_what_it_passes() -> None:
    costs = LayeredCosts(room(), SETTINGS)
    ranges = FREE.copy()
    ranges[180] = 1.0  # straight ahead
    costs.see(Pose2(), ANGLES, ranges, 3.0)
    assert costs.value_at(1.02, 0.0) == LETHAL
    assert is_blocked(costs, 0.9, 0.0)
    costs.see(Pose2(), ANGLES, FREE, 3.0)
    assert costs.value_at(1.02, 0.0) == 0
    costs.see(Pose2(), ANGLES, ranges, 3.0)
    costs.clear()
    assert costs.value_at(1.02, 0.0) == 0


def test_a_scanner_may_turn_either_way() -> None:
    ranges = np.linspace(0.5, 2.5, 360)
    left, right = (LayeredCosts(room(), SETTINGS) for _ in range(2))
    left.see(Pose2(0.3, 0.2, 0.7), ANGLES, ranges, 3.0)
    right.see(Pose2(0.3, 0.2, 0.7), ANGLES[::-1], ranges[::-1], 3.0)
    assert (left.values == right.values).all()


def test_a_map_is_not_cleared_by_scans() -> None:
    costs = LayeredCosts(ONE_WALL, SETTINGS)
    costs.see(Pose2(-1.0, 0.0), ANGLES, FREE, 3.0)
    assert costs.value_at(0.0, 0.0) == LETHAL


@pytest.mark.parametrize("value", [math.nan, -1.0, -math.inf, 0.0])
def test_a_range_that_is_none_changes_nothing(value: float) -> None:
    costs = LayeredCosts(room(), SETTINGS)
    before = costs.values.copy()
    assert not costs.see(Pose2(), ANGLES, np.full(360, value), 3.0)
    assert (costs.values == before).all()


@given(
    st.floats(width=32),
    st.floats(width=32),
    st.lists(st.floats(width=32) | st.sampled_from([math.nan, math.inf, 1.0]), max_size=20),
    st.floats(0, 4),
)
def test_whatever_a_scan_says_only_distances_change_costs(
    first: float, step: float, ranges: list[float], most: float
) -> None:
    with np.errstate(all="ignore"):
        angles = first + step * np.arange(len(ranges))
    costs = LayeredCosts(room(), SETTINGS)
    before = costs.values.copy()
    says = costs.see(Pose2(0.5, 0.0, 0.3), angles, ranges, most)
    is_sound = bool((np.abs(angles) < 1000 * math.tau).all())
    assert says == (most > 0 and is_sound and any(value > 0 for value in ranges))
    if not says or not any(0 < value <= most for value in ranges):
        assert (costs.values == before).all()


CHEST = WorldShape("chest", WorldBox((0.5, 0.4, 0.5)), Pose2(0.2, 0.3, 0.4))


@given(st.floats(-1.8, 1.8), st.floats(-1.8, 1.8), st.floats(-math.pi, math.pi), st.floats(-0.8, 0.8))
@settings(max_examples=settings().max_examples // 2)
def test_what_stands_does_not_move_because_the_robot_does(x: float, y: float, heading: float, turns: float) -> None:
    poses = [Pose2(x, y, heading).moved(Velocity2(0.4, turns), step / 10) for step in range(20)]
    assume(all(at.distance(CHEST.pose) > 0.6 and max(abs(at.x), abs(at.y)) < 2.6 for at in poses))
    costs, rays, random = LayeredCosts(room(), SETTINGS), Rays(room()), np.random.default_rng(1)
    for step, at in enumerate(poses):
        ranges = rays.cast((at.x, at.y), ANGLES + at.heading, 5.0, [CHEST]) + random.normal(0.0, 0.01, 360)
        costs.see(at, ANGLES, ranges, 4.0, step / 10)
        assert not len(costs.moving)


@given(st.floats(0.4, 1.5), st.floats(-math.pi, math.pi))
@settings(max_examples=4)
def test_who_walks_is_seen_to_move_and_nothing_else_is(speed: float, heading: float) -> None:
    costs, rays, seen = LayeredCosts(room(), SETTINGS), Rays(room()), 0
    for step in range(5, 25):
        way = Pose2(0.0, 0.0, heading).compose(Pose2(0.8, speed * (step / 10 - 1.4)))
        shape = WorldShape("person", WorldCylinder(0.25, 1.7), way)
        costs.see(Pose2(), ANGLES, rays.cast((0.0, 0.0), ANGLES, 5.0, [shape]), 4.0, step / 10)
        away = np.hypot(*(costs.moving - (way.x, way.y)).T)
        assert (away < 0.25 + 3 * SIDE + speed / 10).all()
        seen += bool(len(away)) and step >= 20
    assert seen >= 4  # of five; along the rows of the grid, a scan may show what the one before did
    for more in range(20):
        costs.see(Pose2(), ANGLES, rays.cast((0.0, 0.0), ANGLES, 5.0, [shape]), 4.0, 2.4 + more / 10)
    assert not len(costs.moving)


@given(st.floats(-2.5, 2.5), st.floats(-2.5, 2.5), st.floats(-4, 4), st.integers(0, 359), st.floats(0.3, 2.9))
def test_a_part_that_is_computed_again_is_as_the_whole(x: float, y: float, heading: float, ray: int, at: float) -> None:
    costs = LayeredCosts(HOUSE, SETTINGS)
    ranges = FREE.copy()
    ranges[ray] = at
    costs.see(Pose2(x, y, heading), ANGLES, ranges, 3.0)
    partly = costs.values.copy()
    costs.set(SETTINGS)
    assert (costs.values == partly).all()
