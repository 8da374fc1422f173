"""Maps from scans at known poses."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.navigation.components.mapper import OccupancyMapper
from rbxcompose.domains.navigation.costs import CostSettings, LayeredCosts
from rbxcompose.domains.navigation.planner import plan
from rbxcompose.domains.worlds.grid_map import SOLID, GridMap, map_files, read_map
from rbxcompose.domains.worlds.ray_casting import Rays
from rbxcompose.domains.worlds.world import grid_of
from rbxcompose.msgs.nav_msgs import OccupancyGrid
from rbxcompose.sdk.ports import Qos
from tests.navigation.houses import HOUSE, ONE_WALL, SIDE, length_of
from tests.navigation.test_robot import ROBOT, WORLD, Room

ANGLES = np.linspace(-math.pi, math.pi, 360, endpoint=False)
TOUR = """rbx: 1
kind: Mission
name: tour
do:
  - go_to: north
  - go_to: east
"""
PLACES = "places: {north: {x: 0 m, y: 2.2 m}, east: {x: 2 m, y: 0 m}, south: {x: 0 m, y: -2.2 m, heading: 180 deg}}\n"
MAPPED = """  localisation: {type: fake}
missions: {tour: ../../tour.yaml}
start: tour
"""


def agreement(made: GridMap, true: GridMap) -> tuple[float, int]:
    """Return which share of the known cells of a map is right, and how many are known."""
    rows, columns = np.nonzero(made.cells >= 0)
    middles = made.to_points(np.stack((columns + 0.5, rows + 0.5), -1))
    right = true.occupied_at(middles) == (made.cells[rows, columns] >= SOLID)
    return float(right.mean()), len(right)


@pytest.mark.soak  # what a robot maps on its way agrees, too
@given(st.floats(-math.pi, math.pi), st.floats(0.0, 0.01), st.floats(-SIDE / 2, SIDE / 2))
@settings(max_examples=2, deadline=None)
def test_a_map_from_known_poses_agrees_with_the_world(heading: float, noise: float, shift: float) -> None:
    mapper, rays, random = OccupancyMapper(), Rays(HOUSE), np.random.default_rng(1)
    for step in range(40):
        at = Pose2(2.0 * math.cos(step / 6), 2.0 * math.sin(step / 6) + shift, heading + step / 7)
        if not HOUSE.occupied_at((at.x, at.y)):
            ranges = rays.cast((at.x, at.y), ANGLES + at.heading, 8.0) + random.normal(0.0, noise, 360)
            mapper.see(at, ANGLES, ranges)
    assert mapper.grid is not None
    right, known = agreement(mapper.grid, HOUSE)
    assert right >= 0.97
    assert known > 0.8 * HOUSE.cells.size


def test_a_scan_from_the_same_place_does_not_count_again_and_one_that_says_nothing_never_does() -> None:
    mapper = OccupancyMapper()
    assert not mapper.see(Pose2(), ANGLES, np.full(360, math.nan))
    assert mapper.see(Pose2(), ANGLES, np.full(360, 1.0))
    assert not mapper.see(Pose2(0.05), ANGLES, np.full(360, 1.0))
    assert mapper.see(Pose2(0.05, 0.0, 0.2), ANGLES, np.full(360, 1.0))
    assert mapper.grid is not None
    assert max(mapper.grid.cells.shape) * SIDE < 2.3  # only what is known


def test_a_ray_without_an_echo_clears_only_as_far_as_the_sensor_sees() -> None:
    mapper = OccupancyMapper()
    for step in range(4):
        mapper.see(Pose2(0.0, 0.0, step * 0.3), ANGLES, np.full(360, math.inf), 2.0)
    assert mapper.grid is not None
    assert max(mapper.grid.cells.shape) * SIDE < 4.1
    assert (mapper.grid.cells <= 0).all()


def test_a_map_that_would_be_too_large_is_refused_and_stays() -> None:
    mapper = OccupancyMapper()
    mapper.see(Pose2(), ANGLES, np.full(360, 1.0))
    with pytest.raises(ValueError, match="the map would have"):
        mapper.see(Pose2(1e6, 1e6), ANGLES, np.full(360, 1.0))
    assert mapper.grid is not None
    assert mapper.grid.cells.size < 10_000


def test_a_robot_that_drives_around_makes_a_map_by_which_another_one_drives(tmp_path: Path) -> None:
    (tmp_path / "tour.yaml").write_text(TOUR, encoding="utf-8")
    robot = (
        ROBOT.replace("0.4 m/s", "0.6 m/s")
        .replace("diff_drive_sim}", "diff_drive_sim, drift: 5 %}")
        .replace("navigation:", "  mapper: {type: mapper, frame: base_link}\nnavigation:")
    )
    room = Room(tmp_path, f"{PLACES}{robot}{MAPPED}", WORLD)
    maps = room.bench.collect("/mapped", OccupancyGrid, Qos.LATCHED)
    assert room.bench.run_until(lambda: any("mission tour: success" in text for text in room.bench.texts()), 120.0)
    room.bench.advance(3.0)
    made = grid_of(maps[-1])
    right, known = agreement(made, ONE_WALL)
    assert right >= 0.97
    assert known > 0.85 * ONE_WALL.cells.size
    for name, data in map_files(made, "made").items():
        (tmp_path / name).write_bytes(data)
    saved = read_map(tmp_path / "made.yaml")
    way, best = (
        plan(LayeredCosts(grid, CostSettings()), Pose2(-2.0, 0.0), Pose2(2.0, 0.3), 0.1) for grid in (saved, ONE_WALL)
    )
    assert length_of(way) < 1.1 * length_of(best)
    assert not any(ONE_WALL.occupied_at((pose.x, pose.y)) for pose in way.poses)
