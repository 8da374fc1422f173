"""Robots that see: the same manifest in both simulators, and what happens if a camera is nowhere."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from rbxcompose.base.levels import Level
from rbxcompose.domains.worlds.physics.engine import PhysicsWorld
from rbxcompose.domains.worlds.physics.looks import DepthPicture
from rbxcompose.msgs.sensor_msgs import Image, Imu, LaserScan, PointCloud2
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench
from tests.navigation.test_robot import Room
from tests.navigation.test_sensors import EYE, SELDOM_PHYSICS, skip_without_pictures, without_camera
from tests.parts.project import Project
from tests.soak import rare

pytestmark = pytest.mark.timeout(120)
pytest.importorskip("mujoco", reason="mujoco is not installed")
pytest.importorskip("cv2", reason="OpenCV is not installed")

ROBOT = """body: {urdf: eye.urdf}
world: ../../room.yaml
simulator: SIMULATOR
components:
  base: {type: diff_drive_sim}
  camera: {type: camera_sim, frame: FRAME, size: [160, 120], depth: true, farthest: 20 m, cloud: CLOUD}
  imu: {type: imu_sim, frame: base_link, noise: 0.05 m/s^2, bias: 0.1 m/s^2, turn_noise: 1 deg/s, turn_bias: 2 deg/s}
  laser: {type: laser_sim, frame: base_link, latency: 120 ms}
"""
WALL = 2.0  # where the front of a wall is, seen from the camera along its axis [m]
WORLD = """rbx: 1
kind: World
name: room
objects:
  wall: {box: [20 cm, 6 m, 4 m], at: {x: 2.28 m}, colour: red}
"""
LEVEL = EYE.replace('rpy="0 0.2 0.1"', 'rpy="0 0 0"')


def text(simulator: str, frame: str = "camera_link", cloud: bool = True) -> str:
    return ROBOT.replace("SIMULATOR", simulator).replace("FRAME", frame).replace("CLOUD", str(cloud).lower())


def bench_in(folder: Path, simulator: str, frame: str = "camera_link", cloud: bool = True) -> Bench:
    (folder / "robots/one").mkdir(parents=True)
    (folder / "robots/one/eye.urdf").write_text(LEVEL)
    return Room(folder, text(simulator, frame, cloud), WORLD).bench


@SELDOM_PHYSICS  # which `test_sensors` compares
def test_a_wall_is_as_far_away_as_it_is_to_a_centimetre(tmp_path: Path, simulator: str) -> None:
    bench = bench_in(tmp_path, simulator)
    taken = bench.collect("/camera/depth/image_raw", Image)
    bench.advance(0.5)
    skip_without_pictures(bench, simulator, taken)
    depths = np.frombuffer(taken[-1].data, np.float32).reshape(120, 160)
    on_wall = depths[5:60, 5:155]
    assert np.abs(on_wall - WALL).max() < 0.01


@pytest.mark.parametrize("simulator", ["physics", *rare("ideal")])
def test_a_camera_on_no_frame_is_found_and_the_robot_still_runs(tmp_path: Path, simulator: str) -> None:
    bench = bench_in(tmp_path, simulator, "nose")
    said = Project(tmp_path).check(text(simulator, "nose")).text
    assert said.count("RBX2019") == 1
    assert "looks up the frame 'nose'" in said
    assert "physics/camera" not in said
    pictures, scans = bench.collect("/camera/image_raw", Image), bench.collect("/scan", LaserScan)
    statuses = bench.statuses("camera")
    bench.advance(2.0)
    assert scans
    if simulator == "physics":
        assert bench.run_until(lambda: statuses[-1].level == Level.WARN, 5.0)
    assert not pictures


def test_a_camera_without_cloud_has_no_topic_for_it(tmp_path: Path) -> None:
    bench = bench_in(tmp_path, "ideal", cloud=False)
    clouds = bench.collect("/camera/points", PointCloud2)
    depths = bench.collect("/camera/depth/image_raw", Image)
    bench.advance(0.5)
    assert depths
    assert not clouds


def test_the_engine_draws_only_what_somebody_wants(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[float] = []

    def picture(engine: PhysicsWorld, camera: str) -> DepthPicture:
        drawn.append(engine.time)
        return DepthPicture(np.zeros((120, 160, 3), np.uint8), np.ones((120, 160), np.float32))

    monkeypatch.setattr(PhysicsWorld, "picture", picture)
    bench = bench_in(tmp_path, "physics")
    bench.advance(5.0)
    assert len(drawn) == 1  # the first one, which takes long, before the robot drives
    statuses = bench.statuses("camera")
    pictures = bench.collect("/camera/image_raw", Image)
    bench.advance(1.0)
    assert len(pictures) == pytest.approx(10, abs=1)
    assert len(drawn) == pytest.approx(11, abs=1)
    assert not [one for one in statuses if one.level != Level.OK]  # nobody had asked for long


def test_scans_come_as_late_as_they_say_with_the_time_when_they_were_taken(tmp_path: Path) -> None:
    bench = bench_in(tmp_path, "ideal")
    late: list[float] = []
    bench.bus.subscribe(
        "me",
        "/scan",
        LaserScan,
        Qos.STATE,
        lambda scan: late.append((bench.clock.stamp() - to_nanoseconds(scan.header.stamp)) / 1e9),
    )
    bench.advance(1.0)
    assert len(late) == pytest.approx(10, abs=2)
    assert late == pytest.approx([0.12] * len(late), abs=1e-6)


@SELDOM_PHYSICS  # which `test_sensors` has
def test_an_inertial_sensor_is_as_wrong_as_it_says_and_the_same_again(tmp_path: Path, simulator: str) -> None:
    def felt(folder: Path, time: float) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        (folder / "robots/one").mkdir(parents=True)
        (folder / "robots/one/eye.urdf").write_text(LEVEL)
        bench = Room(folder, without_camera(text(simulator)), WORLD).bench
        bench.advance(1.0)  # until the robot stands on its wheels
        found = bench.collect("/imu", Imu)
        bench.advance(time)
        vectors = [(one.linear_acceleration, one.angular_velocity) for one in found]
        return np.array([(a.x, a.y, a.z, w.x, w.y, w.z) for a, w in vectors])

    first, again = felt(tmp_path / "one", 2.0), felt(tmp_path / "two", 0.2)
    assert len(again) > 1
    assert (first[: len(again)] == again).all()
    noise, bias = np.repeat((0.05, math.radians(1)), 3), np.repeat((0.1, math.radians(2)), 3)
    assert first.std(0) == pytest.approx(noise, rel=0.25)
    off = np.abs(first.mean(0) - (0, 0, 9.81, 0, 0, 0))
    assert (off < 3 * bias).all()
    assert (off > 0).all()
