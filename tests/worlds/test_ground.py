"""Holes in the ground: what is over them, and what is none."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.worlds.contact import in_polygon
from rbxcompose.domains.worlds.grid_map import GridMap
from rbxcompose.domains.worlds.shapes import Point2, WorldHole
from rbxcompose.domains.worlds.world import SimulatedWorld, world_message, world_of
from rbxcompose.msgs.std_msgs import Header
from tests.worlds.scenes import ANGLES

PLACES = st.floats(-3, 3)


@given(PLACES, PLACES, ANGLES, st.integers(3, 9), st.floats(0.2, 2.0), st.floats(0.0, 3.0), ANGLES)
def test_what_is_near_to_the_middle_of_a_polygon_is_in_it_and_what_is_far_is_not(
    x: float, y: float, turn: float, sides: int, radius: float, away: float, direction: float
) -> None:
    angles = [turn + math.tau * side / sides for side in range(sides)]
    corners = [(x + radius * math.cos(angle), y + radius * math.sin(angle)) for angle in angles]
    at = x + away * math.cos(direction), y + away * math.sin(direction)
    for around in (corners, corners[::-1]):
        found = bool(in_polygon(around, *at))
        assert found or away >= radius * math.cos(math.pi / sides) - 1e-9
        assert not found or away <= radius + 1e-9


@given(st.floats(-0.5, 1.5), st.floats(-0.5, 1.5), ANGLES)
def test_a_robot_is_over_a_hole_with_those_of_its_points_that_are(x: float, y: float, heading: float) -> None:
    square: tuple[Point2, ...] = ((0, 0), (1, 0), (1, 1), (0, 1))
    sent = world_message(SimulatedWorld("x", holes=(WorldHole("stairs", square),)), Header())
    world, pose = world_of(sent), Pose2(x, y, heading)
    points = [(0.2, 0.1), (0.2, -0.1), (0.0, 0.0)]
    placed = [pose.compose(Pose2(*point)) for point in points]
    assume(all(min(abs(side - n) for side in (at.x, at.y) for n in (0, 1)) > 1e-9 for at in placed))
    expected = [0 < at.x < 1 and 0 < at.y < 1 for at in placed]
    assert world.over_holes(pose, points).tolist() == expected
    assert not SimulatedWorld().over_holes(pose, points).any()


@pytest.mark.parametrize("corners", [(), ((0, 0), (1, 1)), ((0, 0), (1, 1), (2, 2)), ((0, 0), (1, 1), (1, 0), (0, 1))])
def test_a_hole_that_encloses_nothing_is_refused(corners: tuple[Point2, ...]) -> None:
    with pytest.raises(ValueError, match="corners"):
        WorldHole("stairs", corners)


def test_a_wall_ahead_presses_what_is_ahead_and_follows_the_robot_as_it_turns() -> None:
    grid = np.zeros((40, 40), np.int8)
    grid[:, 30:] = 100
    world = SimulatedWorld(grid=GridMap(grid, 0.05, Pose2(-1.0, -1.0)), radius=0.177)
    for heading in (0.0, 1.0, -2.0):
        pressed = world.touching(Pose2(0.5 - 0.178, 0.0, heading), 0.002, 0.0)
        assert np.angle(np.exp(1j * (pressed + heading))) == pytest.approx(0.0, abs=0.15)
        assert pressed.size
        assert not world.touching(Pose2(0.5 - 0.18, 0.0, heading), 0.002, 0.0).size
