"""A base docks at a tag: from anywhere around, with noise and drift; and through camera and detector."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rbxcompose.base.geometry import AT_REST, Pose2, Velocity2, wrap_angle
from rbxcompose.domains.vision.components.tag_docking import OVER, Docking, DockingState, DockPlace, TagDockingConfig
from rbxcompose.msgs.geometry_msgs import Twist
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.poses import pose_in
from rbxcompose.msgs.rbxcompose_msgs import DockAt
from rbxcompose.msgs.std_msgs import String
from rbxcompose.sdk.bound import Ended, Outcome
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench
from tests.navigation.test_eyes import LEVEL
from tests.navigation.test_robot import Room
from tests.navigation.test_sensors import SELDOM_PHYSICS, skip_without_pictures
from tests.soak import Soak

DT, RATE, VIEW = 0.05, 8.0, math.radians(30)  # [s], pictures in a second [Hz], half the view
STARTS, MANY = 40, 400


class Simulated:
    """A base whose odometry drifts, and a camera with noise before a tag."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        self.tag = Pose2(0.0, 0.0, self.random.uniform(-3, 3))
        away, beside = self.random.uniform(0.5, 3.0), self.random.uniform(-1.0, 1.0)
        start = Pose2(away * math.cos(beside), away * math.sin(beside), self.random.uniform(-3, 3))
        self.at = self.odometry = self.tag.compose(start)
        self.docking, self.velocity, self.time = Docking(TagDockingConfig(), 0.0), AT_REST, 0.0

    def look(self) -> None:
        seen = self.at.inverse().compose(self.tag)
        away, bearing = math.hypot(seen.x, seen.y), math.atan2(seen.y, seen.x)
        slant = abs(wrap_angle(seen.heading + math.pi - bearing))
        if abs(bearing) > VIEW or slant > math.radians(65):
            return
        noise = self.random.normal(0.0, (0.002 + 0.01 * away, (0.002 + 0.01 * away) / 3, 0.02 + 0.04 * away))
        is_square = slant > 0.2 or self.random.uniform() < 1 / away
        heading = seen.heading + noise[2] if is_square else bearing + math.pi
        measured = Pose2(seen.x + noise[0], seen.y + noise[1], heading)
        self.docking.see(self.odometry.compose(measured), away, self.time, is_square=is_square)

    def run(self, most: float = 60.0) -> DockingState:
        while self.docking.state not in OVER and self.time < most:
            if int(self.time * RATE) != int((self.time - DT) * RATE):
                self.look()
            asked = self.docking.update(self.odometry, self.time, DT)
            self.velocity = Velocity2(
                self.velocity.linear + min(max(asked.linear - self.velocity.linear, -DT), DT),
                self.velocity.angular + min(max(asked.angular - self.velocity.angular, -4 * DT), 4 * DT),
            )
            self.at = self.at.moved(self.velocity, DT)
            drifting = Velocity2(self.velocity.linear * 1.02, self.velocity.angular * 1.02)
            self.odometry = self.odometry.moved(drifting, DT)
            self.time += DT
        return self.docking.state

    @property
    def errors(self) -> tuple[float, float]:
        """Return how far it is from where it should be [m], and by how much it is turned [rad]."""
        at = self.tag.inverse().compose(self.at)
        return math.hypot(at.x - self.docking.settings.distance, at.y), abs(wrap_angle(at.heading - math.pi))


def test_from_anywhere_around_it_ends_within_two_centimetres_and_three_degrees(soak: Soak) -> None:
    good, starts = 0, soak.examples(STARTS, MANY)
    for seed in range(starts):
        simulated = Simulated(seed)
        if simulated.run() is DockingState.DOCKED:
            away, turned = simulated.errors
            good += away <= 0.02 and turned <= math.radians(3)
    assert good >= 0.99 * starts


def test_a_tag_that_is_nowhere_is_searched_once_around() -> None:
    simulated = Simulated(1)
    simulated.look = lambda: None  # type: ignore[method-assign]
    turned = abs(wrap_angle(0.0))
    while simulated.docking.state not in OVER:
        turned += abs(simulated.docking.update(simulated.odometry, simulated.time, DT).angular) * DT
        simulated.time += DT
    assert simulated.docking.state is DockingState.NOT_SEEN
    assert math.tau < turned < 1.3 * math.tau


def test_without_its_tag_it_waits_where_it_would_drive_in_and_then_gives_up(soak: Soak) -> None:
    for seed in range(soak.examples(5, 50)):
        simulated = Simulated(seed)
        see = simulated.look

        def look(simulated: Simulated = simulated, see: Callable[[], None] = see) -> None:
            if simulated.docking.state is not DockingState.APPROACHES:  # there the camera looks elsewhere, or died
                see()

        simulated.look = look  # type: ignore[method-assign]
        assert simulated.run() is DockingState.LOST
        settings, at = simulated.docking.settings, simulated.tag.inverse().compose(simulated.at)
        assert math.hypot(at.x, at.y) > settings.distance + settings.room / 2


def test_a_base_that_does_not_move_is_stuck() -> None:
    simulated = Simulated(2)
    docking, tag = simulated.docking, Pose2(1.0, 0.0, math.pi)
    for cycle in range(400):
        docking.see(tag, 1.0, cycle * DT, is_square=True)
        docking.update(Pose2(), cycle * DT, DT)
    assert docking.state is DockingState.STUCK


def test_a_tag_that_somebody_moves_is_where_it_is_now() -> None:
    place = DockPlace()
    for time in range(10):
        place.see(Pose2(1.0, 0.0, math.pi), 1.0, time / 10, is_square=True)
    for time in range(10, 16):
        place.see(Pose2(1.0, 1.0, math.pi), 1.0, time / 10, is_square=True)
    assert place.pose is not None
    assert (place.pose.x, place.pose.y) == pytest.approx((1.0, 1.0))


ROBOT = """body: {urdf: eye.urdf}
world: ../../room.yaml
simulator: SIMULATOR
cameras:
  front: {frame: camera_link, size: [320, 240], rate: 5 Hz}
tags: {size: 16 cm, names: {dock: 3}}
components:
  base: {type: diff_drive_sim, rate: 25 Hz}
  dock_at: {type: tag_docking, frame: camera_optical_frame, distance: 60 cm}
"""
WORLD = """rbx: 1
kind: World
name: room
objects:
  charger:
    box: [30 cm, 30 cm, 60 cm]
    at: {x: 1.6 m, y: 60 cm, heading: 200 deg}
    tags: {front: {number: 3, size: 16 cm}}
spawn:
  away: {heading: -90 deg}
"""


class Docker:
    """A robot with a camera in a room with a dock."""

    def __init__(self, folder: Path, simulator: str) -> None:
        (folder / "robots/one").mkdir(parents=True)
        (folder / "robots/one/eye.urdf").write_text(LEVEL)
        self.bench: Bench = Room(folder, ROBOT.replace("SIMULATOR", simulator), WORLD).bench
        self.truth = self.bench.collect("/ground_truth", Odometry)
        self.contacts = self.bench.collect("/contact", String)
        self.sent = self.bench.collect("/cmd_vel", Twist, Qos.COMMAND)
        self.ends: list[Ended[Any]] = []
        self.client = self.bench.bus.action_client("me", "/dock_at", DockAt)

    def ask(self, tag: str, **goal: Any) -> None:
        self.client(DockAt.Goal(tag=tag, **goal), self.ends.append)
        self.bench.run_until(lambda: bool(self.ends), 60.0)


@SELDOM_PHYSICS
def test_a_robot_that_looks_away_finds_its_dock_and_faces_it(tmp_path: Path, simulator: str) -> None:
    pytest.importorskip("cv2", reason="OpenCV is not installed")
    if simulator == "physics":
        pytest.importorskip("mujoco", reason="mujoco is not installed")
    docker = Docker(tmp_path, simulator)
    docker.ask("3")  # the number of its tag is as good as its name
    (end,) = docker.ends
    skip_without_pictures(docker.bench, simulator, end.outcome is Outcome.SUCCEEDED)
    assert end.outcome is Outcome.SUCCEEDED, end.message
    face = Pose2(1.6, 0.6, math.radians(200)).compose(Pose2(0.15, 0.0))
    at = face.inverse().compose(pose_in(docker.truth[-1].pose.pose))
    assert math.hypot(at.x - 0.6, at.y) < 0.03
    assert abs(wrap_angle(at.heading - math.pi)) < math.radians(3)
    assert end.result is not None
    assert end.result.distance == pytest.approx(0.6, abs=0.02)
    assert docker.sent[-1] == Twist()
    assert not docker.contacts


def test_a_dock_that_is_not_there_is_not_seen(tmp_path: Path) -> None:
    pytest.importorskip("cv2", reason="OpenCV is not installed")
    docker = Docker(tmp_path, "ideal")
    docker.ask("charger", patience=2.0)
    (end,) = docker.ends
    assert end.result is not None
    assert (end.outcome, end.result.outcome) == (Outcome.ABORTED, "not_seen")
    assert end.result.message == "'charger' was seen nowhere around"
    docker.ends.clear()
    docker.ask("")
    assert docker.ends[0].outcome is Outcome.REJECTED
