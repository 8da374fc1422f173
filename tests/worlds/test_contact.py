"""A robot that stops where it first touches overlaps nothing, and can get away again."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rbxcompose.base.geometry import Pose2, wrap_angle
from rbxcompose.domains.worlds.contact import MAP, FirstContact, first_contact, pose_between, touching
from rbxcompose.domains.worlds.grid_map import GridMap
from rbxcompose.domains.worlds.shapes import (
    CircleFootprint,
    Footprint,
    PolygonFootprint,
    WorldBox,
    WorldCylinder,
    WorldShape,
)
from tests.worlds.scenes import ANGLES, HEIGHT, Points, grids, inside, moved_into, shapes

EMPTY = GridMap(np.zeros((1, 1), np.int8), 0.05, Pose2(50.0, 50.0))
BOX = PolygonFootprint(((0.3, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.3, -0.2)))
FOOTPRINTS = st.one_of(
    st.builds(CircleFootprint, st.floats(0.0, 0.4)),
    st.sampled_from((BOX, PolygonFootprint(((0.3, 0.0), (-0.1, 0.15), (-0.1, -0.15))))),
)


def outline(footprint: Footprint, grown: float) -> Points:
    """Return points around a footprint, 2 mm apart or less, which has grown towards the outside by a length [m]."""
    if isinstance(footprint, CircleFootprint):
        turns = np.linspace(0, math.tau, 1300)
        return np.stack((np.cos(turns), np.sin(turns)), -1) * max(footprint.radius + grown, 0.0)
    corners = np.array(footprint.points)
    corners = corners * (1 + grown / 0.1)
    parts = np.linspace(0.0, 1.0, 300)[:, None]
    return np.concatenate([a + (b - a) * parts for a, b in zip(corners, np.roll(corners, -1, 0), strict=True)])


def overlaps(grid: GridMap, found: tuple[WorldShape, ...], footprint: Footprint, pose: Pose2, grown: float) -> bool:
    """Return whether the footprint, grown by a length, has points in something solid, or the other way round."""
    around = outline(footprint, grown)
    placed = moved_into(pose.inverse(), around)
    if inside(grid, found, placed, 0.0).any():
        return True
    rows, columns = np.nonzero(grid.cells == 100)
    middles = [*grid.to_points(np.stack((columns + 0.5, rows + 0.5), -1)), *([s.pose.x, s.pose.y] for s in found)]
    local = moved_into(pose, np.array(middles).reshape(-1, 2))
    if isinstance(footprint, CircleFootprint):
        return bool((np.hypot(local[:, 0], local[:, 1]) < footprint.radius + grown).any())
    corners = np.array(footprint.points) * (1 + grown / 0.1)
    along = np.roll(corners, -1, 0) - corners
    away = local[:, None] - corners
    return bool((along[:, 0] * away[..., 1] - along[:, 1] * away[..., 0] > 0).all(-1).any())


class Drive(NamedTuple):
    """A robot that begins to move clear of everything."""

    grid: GridMap
    found: tuple[WorldShape, ...]
    footprint: Footprint
    start: Pose2
    goal: Pose2

    @property
    def length(self) -> float:
        """Return how far its points move at most [m]."""
        turned = abs(wrap_angle(self.goal.heading - self.start.heading))
        return self.start.distance(self.goal) + turned * self.footprint.reach

    def contact(self, start: Pose2, goal: Pose2) -> FirstContact | None:
        return first_contact(self.grid, self.found, self.footprint, start, goal)


@st.composite
def drives(draw: st.DrawFn) -> Drive:
    grid, found, footprint = draw(grids()), draw(shapes()), draw(FOOTPRINTS)
    rows, columns = grid.cells.shape
    x, y = grid.to_points((draw(st.floats(-0.2, 1.2)) * columns, draw(st.floats(-0.2, 1.2)) * rows)).tolist()
    start = Pose2(x, y, draw(ANGLES))
    middles = np.moveaxis(np.mgrid[:rows, :columns], 0, -1)[..., ::-1] + 0.5
    away = np.linalg.norm(grid.to_points(middles) - (x, y), axis=-1) - grid.resolution * 0.71
    cells = np.where(away < footprint.reach, 0, grid.cells).astype(np.int8)
    clear = tuple(s for s in found if start.distance(s.pose) > footprint.reach + s.solid.reach)
    step, turn = draw(st.floats(-0.4, 0.4)), draw(st.floats(-0.8, 0.8))
    direction = draw(ANGLES)
    goal = Pose2(x + step * math.cos(direction), y + step * math.sin(direction), start.heading + turn)
    return Drive(GridMap(cells, grid.resolution, grid.origin), clear, footprint, start, goal)


@given(drives())
def test_it_stops_before_it_overlaps_where_something_is(drive: Drive) -> None:
    grid, found, footprint, start, goal = drive
    contact = drive.contact(start, goal)
    part, pose = (contact.part, contact.pose) if contact else (1.0, pose_between(start, goal, 1.0))
    assert not overlaps(grid, found, footprint, pose, -1e-6)
    assert pose == pose_between(start, goal, part)
    if contact:
        what = (MAP, *(shape.name for shape in found)).index(contact.what)
        only = () if what == 0 else (found[what - 1],)
        assert overlaps(grid if what == 0 else EMPTY, only, footprint, pose, 5e-3)


@given(drives(), st.floats(0.0, 1.0))
def test_the_part_is_free_the_rest_is_not_and_the_way_back_is(drive: Drive, part: float) -> None:
    grid, found, footprint, start, goal = drive
    contact = drive.contact(start, goal)
    if contact is None:
        assert drive.contact(goal, start) is None or drive.length > 0
        return
    graze = 2e-3 / drive.length  # between two poses that are examined, so much may be touched or not
    on_the_way = drive.contact(start, pose_between(start, goal, part * contact.part))
    assert on_the_way is None or part * contact.part * (1 - on_the_way.part) < graze
    again = drive.contact(contact.pose, goal)
    assert again is not None
    assert again.part * (1 - contact.part) < graze
    back = drive.contact(contact.pose, start)
    assert back is None or contact.part * (1 - back.part) < graze
    more = (*found, WorldShape("more", WorldCylinder(0.1, HEIGHT), goal))
    sooner = first_contact(grid, more, footprint, start, goal)
    assert sooner is not None
    assert sooner.part <= contact.part + graze


@given(drives(), st.floats(0.0, 0.3), ANGLES, st.floats(0.001, 0.02))
def test_a_bumper_is_pressed_just_where_there_is_no_room_for_its_travel(
    drive: Drive, radius: float, direction: float, travel: float
) -> None:
    grid, found, _, start, goal = drive
    footprint = CircleFootprint(radius)
    contact = first_contact(grid, found, footprint, start, goal)
    pose = contact.pose if contact else start
    assume(not overlaps(grid, found, footprint, pose, -1e-6))
    pressed = touching(grid, found, footprint, pose, travel)

    def hits(angle: float, way: float) -> bool:
        there = pose.compose(Pose2(way * math.cos(angle), way * math.sin(angle)))
        return first_contact(grid, found, footprint, pose, there) is not None

    assert all(hits(angle, travel + 1e-4) for angle in pressed)
    assert pressed.size or not hits(direction, travel - 1e-4)
    assert pressed.size or contact is None


@pytest.mark.parametrize("solid", [WorldBox((0.4, 0.4, HEIGHT)), WorldCylinder(0.2, HEIGHT)])
@pytest.mark.parametrize("footprint", [CircleFootprint(0.3), BOX])
@given(ANGLES, st.floats(0.0, 0.1))
def test_it_ends_where_the_side_that_is_ahead_touches(
    footprint: Footprint, solid: WorldBox | WorldCylinder, heading: float, deeper: float
) -> None:
    robot = Pose2(0.0, 0.0, heading)
    ahead = robot.compose(Pose2(0.6, 0.0))
    contact = first_contact(
        EMPTY, (WorldShape("post", solid, ahead),), footprint, robot, robot.compose(Pose2(0.15 + deeper))
    )
    assert contact is not None
    assert contact.what == "post"
    assert robot.distance(contact.pose) == pytest.approx(0.1, abs=1e-5)


@given(st.floats(-0.2, 0.2), st.floats(0.0, 0.1))
def test_a_robot_that_touches_may_move_away_along_and_turn_if_it_is_round(aside: float, deep: float) -> None:
    cells = np.zeros((40, 40), np.int8)
    cells[:, 30] = 100
    grid = GridMap(cells, 0.05, Pose2(-1.5, -1.0))
    for footprint in (CircleFootprint(0.3), BOX):
        touching = Pose2(-0.3 + deep, aside)
        for step in (Pose2(-0.02), Pose2(-0.01, 0.02), Pose2(0.0, 0.02)):
            assert first_contact(grid, (), footprint, touching, touching.compose(step)) is None
        pressed = first_contact(grid, (), footprint, touching, touching.compose(Pose2(0.02)))
        assert pressed is not None
        assert pressed.part == pytest.approx(0.0, abs=1e-3)
        turned = first_contact(grid, (), footprint, touching, touching.compose(Pose2(heading=0.1)))
        assert (turned is None) == isinstance(footprint, CircleFootprint)


def test_a_robot_with_a_corner_at_a_wall_may_turn_it_away() -> None:
    wall = WorldShape("wall", WorldBox((0.1, 4.0, HEIGHT)), Pose2(1.0, 0.0))
    turned = 0.3
    corner = 0.3 * math.cos(turned) + 0.2 * math.sin(turned)
    pose = Pose2(0.95 - corner, 0.0, turned)
    assert first_contact(EMPTY, (wall,), BOX, pose, Pose2(pose.x, 0.0, turned - 0.1)) is None
    assert first_contact(EMPTY, (wall,), BOX, pose, Pose2(pose.x, 0.0, turned + 0.1)) is not None


def test_a_robot_does_not_jump_through_a_wall() -> None:
    wall = WorldShape("wall", WorldBox((0.01, 4.0, HEIGHT)), Pose2(1.0, 0.0))
    contact = first_contact(EMPTY, (wall,), CircleFootprint(0.1), Pose2(), Pose2(50.0))
    assert contact is not None
    assert contact.pose.x == pytest.approx(0.895, abs=1e-5)
