"""Promises of tracking people in the scans of a simulated laser."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.navigation.people import KnownWalls, PeopleTracks, PersonSighting, TrackedPerson, sightings
from rbxcompose.domains.worlds.grid_map import GridMap
from rbxcompose.domains.worlds.shapes import ShapePath, WorldBox, WorldCylinder, WorldShape
from rbxcompose.domains.worlds.world import SimulatedWorld
from rbxcompose.domains.worlds.world_file import PERSON
from tests.navigation.houses import ONE_WALL, room

ANGLES = -math.pi + math.tau / 360 * np.arange(360, dtype=float)
OBLIQUE = Pose2(-2.0, 0.0, 0.5)
HEIGHT = 0.2  # [m] of the laser
Way = tuple[tuple[float, float, float], ...]


def walker(name: str, way: Way) -> WorldShape:
    return WorldShape(name, PERSON, Pose2(), path=ShapePath(way))


class Watch:
    """A laser that stands in a world and tracks who walks there."""

    def __init__(self, *shapes: WorldShape, grid: GridMap = ONE_WALL, at: Pose2 = OBLIQUE) -> None:
        self.world, self.at = SimulatedWorld("w", grid, shapes), at
        self.tracks, self.random = PeopleTracks(), np.random.default_rng(1)

    def scan(self, time: float) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        found = self.world.distances((self.at.x, self.at.y), ANGLES + self.at.heading, 8.0, time, HEIGHT)
        return found + self.random.normal(0.0, 0.01, found.shape)

    def run(self, duration: float, walls: KnownWalls | None) -> Iterator[tuple[float, list[TrackedPerson]]]:
        for step in range(round(10 * duration)):
            self.tracks.see(sightings(self.at, ANGLES, self.scan(step / 10), 8.0, walls), step / 10)
            yield step / 10, self.tracks.people(step / 10)


ACROSS: Way = ((0, -1.0, -2.0), (8, -1.0, 2.0))


def test_somebody_who_walks_is_tracked_to_a_few_centimetres_and_told_from_furniture() -> None:
    box = WorldShape("box", WorldBox((0.4, 0.4, 1.0)), Pose2(-2.0, -1.5, 0.3))
    watch = Watch(walker("visitor", ACROSS), box)
    names = set()
    for time, people in watch.run(7.0, KnownWalls(ONE_WALL, 0.15)):
        sure = [one for one in people if one.reliability >= 0.9]
        if time >= 1.5:
            assert len(people) == 2  # the box may be somebody who stands
            assert len(sure) == 1
            names.add(sure[0].name)
            at = watch.world.shapes[0].pose_at(time)
            assert math.hypot(sure[0].x - at.x, sure[0].y - at.y) < 0.08
            assert sure[0].speed == pytest.approx(0.5, abs=0.12)
    assert len(names) == 1


def test_walls_are_nobody_with_a_map_and_without() -> None:
    for walls in (KnownWalls(ONE_WALL, 0.15), None):
        assert [people for _, people in Watch().run(1.0, walls) if people] == []


def test_two_who_cross_keep_their_names() -> None:
    one: Way = ((0, -0.6, -2.0), (8, -0.6, 2.0))
    other: Way = ((0, 0.2, 2.0), (8, 0.2, -2.0))  # behind the first, seen from the laser, in the middle of the way
    grid = room()
    watch = Watch(walker("one", one), walker("other", other), grid=grid)
    seen: dict[str, set[str]] = {"one": set(), "other": set()}
    for time, people in watch.run(8.0, KnownWalls(grid, 0.15)):
        for person in people if time > 1.0 else ():
            shape = min(watch.world.shapes, key=lambda each: each.pose_at(time).distance(Pose2(person.x, person.y)))
            seen[shape.name].add(person.name)
    assert len(seen["one"]) == 1
    assert len(seen["other"]) == 1
    assert seen["one"] != seen["other"]


def test_two_legs_are_one_person_and_a_leg_alone_is_none() -> None:
    legs = [WorldShape(f"leg{y}", WorldCylinder(0.07, 1.0), Pose2(-0.5, y)) for y in (-0.2, 0.2)]
    found = sightings(
        Pose2(-2.0, 0.0), ANGLES, Watch(*legs, at=Pose2(-2.0, 0.0)).scan(0.0), 3.0, KnownWalls(ONE_WALL, 0.15)
    )
    assert [each.is_whole for each in found] == [True]
    assert math.hypot(found[0].x + 0.5, found[0].y) < 0.05
    alone = Watch(legs[0], at=Pose2(-2.0, 0.0)).scan(0.0)
    assert [each.is_whole for each in sightings(Pose2(-2.0, 0.0), ANGLES, alone, 3.0, KnownWalls(ONE_WALL, 0.15))] == [
        False
    ]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 0.0])
def test_a_laser_that_tells_nothing_shows_nobody(value: float) -> None:
    assert sightings(Pose2(), ANGLES, np.full(360, value), 8.0) == []
    assert sightings(Pose2(), ANGLES[:2], np.ones(2), 8.0) == []
    assert sightings(Pose2(), np.full(360, math.nan), np.ones(360), 8.0) == []


def test_who_is_hidden_keeps_the_name_for_a_while_and_is_not_told_meanwhile() -> None:
    tracks = PeopleTracks(forget=2.0)

    def see(start: float, end: float) -> None:
        for step in range(round(10 * start), round(10 * end)):
            tracks.see([PersonSighting(0.05 * step, 0.0)], step / 10)

    see(0.0, 2.0)
    name = tracks.people(2.0)[0].name
    tracks.see([], 3.0)
    assert tracks.people(3.0) == []
    see(3.5, 4.0)
    assert [one.name for one in tracks.people(4.0)] == [name]
    tracks.see([], 9.0)
    see(9.0, 10.0)
    assert [one.name != name for one in tracks.people(10.0)] == [True]
