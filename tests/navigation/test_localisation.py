"""Where a robot is: particles that a laser weighs, in the furnished house of the examples, whose map has only walls."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from rbxcompose.base.findings import Report, Span
from rbxcompose.base.geometry import Pose2, Velocity2, wrap_angle
from rbxcompose.domains.navigation.localisation import LocalisationSettings, ParticleFilter
from rbxcompose.domains.navigation.localiser import RecallPlace
from rbxcompose.domains.worlds.grid_map import GridMap
from rbxcompose.domains.worlds.shapes import WorldShape
from rbxcompose.domains.worlds.world import SimulatedWorld
from rbxcompose.domains.worlds.world_file import PERSON, read_world
from rbxcompose.manifest.documents import Documents
from tests.navigation.houses import ONE_WALL

ANGLES = np.linspace(-math.pi, math.pi, 180, endpoint=False)
LASER = Pose2(0.1, 0.0, 0.0)
DOCK = Pose2(1.0, 0.7, math.pi / 2)
LIVING = ((0.9, 2.2), (0.9, 4.2), (3.2, 4.2), (3.3, 1.7))
KITCHEN = ((4.7, 1.5), (4.7, 4.8), (6.5, 5.0), (4.7, 4.8))
BATH = ((4.7, 1.5), (6.5, 1.2), (4.7, 1.5))
ROUND = (*LIVING, *KITCHEN, *BATH, (1.2, 1.2))
"""Through all rooms, around the furniture."""
RECOVERS = LocalisationSettings(slow=0.05, fast=0.4)
POSES = st.builds(Pose2, st.floats(-5, 5), st.floats(-5, 5), st.floats(-math.pi, math.pi))


@cache
def house() -> SimulatedWorld:
    read = read_world(Path("worlds/house.yaml").resolve(), Documents(Report(), {}), Span("", 1, 1, 1, 1))
    assert read is not None
    return SimulatedWorld("house", read.grid, tuple(one.placed(name) for name, one in read.objects.items()))


class Ride:
    """A robot in the house whose odometry drifts: 5 % in ways and 8 % in turns; its scans are off by 1.5 cm."""

    def __init__(self, core: ParticleFilter, at: Pose2, people: Sequence[Pose2] = ()) -> None:
        self.core, self.at, self.people = core, at, people
        self.odometry = self.first = Pose2(3.0, -2.0, 1.0)
        self.begin = at
        self.random = np.random.default_rng(7)
        self.errors: list[float] = []
        core.move(self.odometry)

    def through(self, places: Sequence[tuple[float, float]]) -> None:
        for x, y in places:
            place = Pose2(x, y)
            self._go(Velocity2(0.0, self.at.bearing(place)), math.ceil(abs(self.at.bearing(place)) / 0.2))
            self._go(Velocity2(self.at.distance(place)), math.ceil(self.at.distance(place) / 0.1))

    def _go(self, motion: Velocity2, steps: int) -> None:
        wrong = Velocity2(1.05 * motion.linear, 1.08 * motion.angular)
        for _ in range(steps):
            self.at = self.at.moved(motion, 1 / steps)
            self.odometry = self.odometry.moved(wrong, 1 / steps)
            self.core.move(self.odometry)
            self.core.see(LASER, ANGLES, self.scan())
            self.errors.append(self.core.pose.distance(self.at))

    def scan(self) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        laser = self.at.compose(LASER)
        around = [WorldShape(str(number), PERSON, self.at.compose(one)) for number, one in enumerate(self.people)]
        shapes = [*house().shapes, *around]
        found = house().rays.cast((laser.x, laser.y), ANGLES + laser.heading, 10.0, shapes, 0.2)
        return found + self.random.normal(0.0, 0.015, found.shape)

    def is_found(self) -> bool:
        turned = wrap_angle(self.core.pose.heading - self.at.heading)
        return self.core.pose.distance(self.at) < 0.1 and abs(turned) < math.radians(3)


def from_dock(settings: LocalisationSettings | None = None, people: Sequence[Pose2] = ()) -> Ride:
    core = ParticleFilter(house().grid, settings)
    core.start(DOCK, 0.15, 0.15)
    return Ride(core, Pose2(1.05, 0.65, math.pi / 2 + 0.05), people)


def test_a_pose_is_known_through_all_rooms_though_odometry_drifts() -> None:
    ride = from_dock()
    ride.through(ROUND)
    by_odometry = ride.begin.compose(ride.first.inverse().compose(ride.odometry))
    assert by_odometry.distance(ride.at) > 0.5
    assert ride.is_found()
    assert max(ride.errors[10:]) < 0.1
    assert ride.core.quality > 0.5
    assert math.sqrt(ride.core.covariance[0, 0]) < 0.05
    assert len(ride.core.poses) == ride.core.settings.least


def test_people_around_the_robot_do_not_push_it_off() -> None:
    ride = from_dock(people=[Pose2(0.8, 0.3), Pose2(-0.5, -0.8)])
    ride.through(ROUND[:5])
    assert ride.is_found()
    assert max(ride.errors[10:]) < 0.25


@pytest.mark.soak  # one that was carried away does so, too
@pytest.mark.parametrize("at", [Pose2(3.0, 3.9, 2.0), Pose2(4.7, 4.0, -1.0), Pose2(6.5, 1.2, 3.0)])
def test_a_robot_finds_itself_from_anywhere_after_some_metres(at: Pose2) -> None:
    core = ParticleFilter(house().grid, RECOVERS)
    assert core.quality == 0.0
    ride = Ride(core, at)
    ride.through(ROUND[4:6] if at.x > 4 else ROUND[3:6])
    assert ride.is_found()


def test_a_robot_that_was_carried_away_notices_and_finds_itself_again() -> None:
    ride = from_dock(RECOVERS)
    ride.through(ROUND[:1])
    known = ride.core.quality
    ride.at = Pose2(6.5, 1.2, 3.0)
    ride.core.see(LASER, ANGLES, ride.scan())
    assert ride.core.quality < min(0.5, known)
    ride.through((*KITCHEN, *BATH))
    assert ride.is_found()


def test_scans_from_one_place_decide_between_two_where_the_robot_may_be() -> None:
    ride = from_dock()
    ride.at = Pose2(7.03, 1.83, 0.03)
    ride.core.start(Pose2(6.5, 4.8, 1.0), 0.2, math.radians(10), ride.at)
    for _ in range(4):
        assert ride.core.see(LASER, ANGLES, ride.scan(), anew=True)
    assert ride.is_found()
    assert math.sqrt(ride.core.covariance[0, 0]) < 0.1


@given(POSES, st.lists(POSES, min_size=1, max_size=8))
def test_without_scans_the_particles_follow_odometry_in_any_direction(first: Pose2, steps: list[Pose2]) -> None:
    core = ParticleFilter(ONE_WALL, LocalisationSettings(turn_from_way=0.01, turn_from_turn=0.01, way_from_way=0.01))
    core.move(first)
    core.start(Pose2(1.0, 1.0, 3.0), 0.01, 0.01)
    odometry, truth, length, before = first, Pose2(1.0, 1.0, 3.0), 0.0, core.correction
    for step in steps:
        odometry, truth = odometry.compose(step), truth.compose(step)
        length += 1 + math.hypot(step.x, step.y)
        core.move(odometry)
    assert core.correction == before
    assert core.pose.distance(truth) < 1e-9 * length
    x, y = core.poses[:, :2].mean(0)
    assert math.hypot(x - truth.x, y - truth.y) < 0.01 * length
    turned = np.angle(np.exp(1j * (core.poses[:, 2] - truth.heading)).mean())
    assert abs(turned) < 0.01 * length


def test_the_noise_of_a_way_does_not_depend_on_how_often_odometry_comes() -> None:
    found = []
    for count in (19, 950):
        core = ParticleFilter(ONE_WALL)
        core.start(Pose2(), 0.0, 0.0)
        for x in np.linspace(0.0, 4.0, count + 1).tolist():
            core.move(Pose2(x))
        found.append(np.sqrt(np.diag(core.covariance)))
    assert found[0] == pytest.approx(found[1], rel=0.15)
    assert found[0][2] == pytest.approx(0.1 * 0.2 * math.sqrt(20), rel=0.15)


def test_a_scan_corrects_and_what_odometry_tells_meanwhile_does_not() -> None:
    ride = from_dock()
    before = ride.core.correction
    assert ride.core.see(LASER, ANGLES, ride.scan())
    after = ride.core.correction
    assert after != before
    ride.core.move(ride.odometry.compose(Pose2(0.1)))
    assert not ride.core.see(LASER, ANGLES, ride.scan())
    assert ride.core.correction == after
    assert ride.core.pose == after.compose(ride.odometry.compose(Pose2(0.1)))
    ride.core.move(ride.odometry.compose(Pose2(0.25)))
    assert ride.core.see(LASER, ANGLES, ride.scan())


@pytest.mark.parametrize("ranges", [[], [math.inf] * 9, [math.nan] * 9, [-math.inf] * 9, [0.0] * 9, [50.0] * 9])
def test_a_scan_without_echoes_changes_nothing(ranges: ArrayLike) -> None:
    ride = from_dock()
    before, quality = ride.core.poses, ride.core.quality
    assert not ride.core.see(LASER, np.arange(len(np.asarray(ranges))), ranges)
    assert np.array_equal(ride.core.poses, before)
    assert ride.core.quality is quality
    assert ride.core.see(LASER, ANGLES, ride.scan())


def test_rays_without_echoes_are_left_out_of_a_scan() -> None:
    rides = [from_dock(), from_dock()]
    scan = rides[0].scan()
    keeps = np.arange(len(scan)) % 4 > 0
    rides[0].core.see(LASER, ANGLES[keeps], scan[keeps])
    rides[1].core.see(LASER, ANGLES, np.where(keeps, scan, np.resize([math.nan, math.inf, -math.inf], len(scan))))
    assert np.array_equal(rides[0].core.poses, rides[1].core.poses)


def test_the_same_seed_gives_the_same_poses() -> None:
    rides = [from_dock(RECOVERS), from_dock(RECOVERS)]
    for ride in rides:
        ride.through(ROUND[:1])
    assert np.array_equal(rides[0].core.poses, rides[1].core.poses)
    assert rides[0].core.correction == rides[1].core.correction


def test_anywhere_is_on_all_free_cells_alike() -> None:
    poses = ParticleFilter(ONE_WALL).poses
    assert not ONE_WALL.occupied_at(poses[:, :2]).any()
    free = float((ONE_WALL.cells == 0).mean())
    assert (poses[:, 0] > 1.0).mean() == pytest.approx(1.9 * 5.8 / 36 / free, abs=0.01)
    assert (poses[:, 2] > 0).mean() == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize("corner", [Pose2(1.0, -2.0, 0.7), Pose2(-4.0, 1.0, -2.5)])
def test_a_map_may_lie_and_turn_anywhere(corner: Pose2) -> None:
    plain = house().grid
    core = ParticleFilter(GridMap(plain.cells, plain.resolution, corner))
    core.start(corner.compose(DOCK), 0.15, 0.15)
    ride = from_dock()
    core.move(ride.odometry)
    assert core.see(LASER, ANGLES, ride.scan())
    assert core.pose.distance(corner.compose(ride.at)) < 0.1


@pytest.mark.parametrize(
    ("pose", "spread"), [(Pose2(9.0, 1.0), 0.1), (Pose2(math.nan, 1.0), 0.1), (Pose2(1.0, 1.0, math.inf), 0.1)]
)
def test_a_start_outside_of_the_map_is_refused(pose: Pose2, spread: float) -> None:
    core = ParticleFilter(house().grid)
    before = core.poses
    with pytest.raises(ValueError, match="a start"):
        core.start(pose, spread, 0.1)
    assert np.array_equal(core.poses, before)


@pytest.mark.parametrize(
    ("before", "now", "follows", "outlives"),
    [
        (Pose2(5.0, 3.0, 1.0), Pose2(5.1, 3.1, 1.2), True, True),
        (Pose2(5.0, 3.0, 1.0), Pose2(5.4, 3.4, 0.8), True, True),  # it was driving
        (Pose2(5.0, 3.0, 1.0), Pose2(5.0, 3.0, -1.5), False, True),  # it was turning
        (Pose2(5.0, 3.0, 1.0), Pose2(4.0, 3.0, 1.0), True, False),
        (Pose2(5.0, 3.0, 1.0), Pose2(0.1, 0.0, 0.0), False, False),
        (Pose2(0.1, 0.1, 3.0), Pose2(0.0, 0.0, 0.0), False, False),
        (Pose2(0.5, 0.0, 0.0), Pose2(0.1, 0.0, 0.0), True, False),  # through the origin, or again from it
    ],
)
def test_odometry_has_begun_again_if_no_base_can_have_moved_so_or_a_restart_finds_it_elsewhere_or_at_its_origin(
    before: Pose2, now: Pose2, *, follows: bool, outlives: bool
) -> None:
    known = RecallPlace(Pose2(1.0), before, 0.1, 0.1, 10.0)
    assert (known.follows(now, 10.4), known.outlives(now)) == (follows, outlives)


def test_what_is_no_number_and_a_map_without_room_are_refused() -> None:
    with pytest.raises(ValueError, match="three finite numbers"):
        from_dock().core.move(Pose2(math.nan))
    with pytest.raises(ValueError, match="at least zero"):
        from_dock().core.start(DOCK, -0.1, 0.1)
    with pytest.raises(ValueError, match="no free cell"):
        ParticleFilter(GridMap(np.full((3, 3), 100, np.int8), 0.05))
