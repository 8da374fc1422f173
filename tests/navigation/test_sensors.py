"""Cameras and inertial sensors tell the same in both simulators, and what they should."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from rbxcompose.base.levels import Level
from rbxcompose.domains.worlds.physics.engine import PhysicsWorld
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.sensor_msgs import CameraInfo, Image, Imu
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench
from tests.navigation.test_robot import Room
from tests.soak import rare

pytestmark = pytest.mark.timeout(120)
pytest.importorskip("mujoco", reason="mujoco is not installed")
pytest.importorskip("cv2", reason="OpenCV is not installed")

EYE = """<robot name="eye"><link name="base_footprint"/><link name="base_link"><visual><origin xyz="0 0 0.1"/><geometry>
<cylinder radius="0.17" length="0.18"/></geometry></visual><collision><origin xyz="0 0 0.1"/><geometry>
<cylinder radius="0.17" length="0.18"/></geometry></collision></link><link name="camera_link"/>
<joint name="body" type="fixed"><parent link="base_footprint"/><child link="base_link"/></joint>
<joint name="mount" type="fixed"><parent link="base_link"/><child link="camera_link"/>
<origin xyz="0.18 0 0.4" rpy="0 0.2 0.1"/></joint></robot>"""
ROBOT = """body: {urdf: eye.urdf}
world: ../../room.yaml
simulator: SIMULATOR
components:
  base: {type: diff_drive_sim}
  camera: {type: camera_sim, frame: camera_link, size: [160, 120], depth: true, nearest: 5 cm, distortion: LENS}
  imu: {type: imu_sim, frame: base_link}
"""
WORLD = """rbx: 1
kind: World
name: room
objects:
  box: {box: [40 cm, 60 cm, 90 cm], at: {x: 2 m, y: 30 cm, heading: 20 deg}, colour: red}
  can: {cylinder: {radius: 20 cm, length: 80 cm}, at: {x: 1.5 m, y: -50 cm}, colour: blue}
"""
SIMULATORS = pytest.mark.parametrize("simulator", ["ideal", "physics"])
SELDOM_PHYSICS = pytest.mark.parametrize("simulator", ["ideal", *rare("physics")])
"""Where pictures are those of the engine, and all else as elsewhere."""


def without_camera(robot: str) -> str:
    """Return a robot that sees nothing: the first picture of the engine takes long."""
    return "".join(line for line in robot.splitlines(keepends=True) if "type: camera_sim" not in line)


def bench_in(folder: Path, simulator: str, lens: str = "[]", robot: str = ROBOT) -> Bench:
    (folder / "robots/one").mkdir(parents=True)
    (folder / "robots/one/eye.urdf").write_text(EYE)
    return Room(folder, robot.replace("SIMULATOR", simulator).replace("LENS", lens), WORLD).bench


def skip_without_pictures(bench: Bench, simulator: str, seen: object) -> None:
    """Skip the test if nothing is seen since the engine cannot draw on this machine, for the reason that it gives."""
    if simulator == "physics" and not seen:
        statuses = bench.statuses("physics: pictures")
        bench.advance(1.5)
        if statuses[-1].level == Level.ERROR:
            pytest.skip(statuses[-1].message)


def seen(folder: Path, simulator: str, lens: str) -> tuple[Image, np.ndarray[tuple[int, ...], np.dtype[np.float32]]]:
    """Return the colours and the depths that a camera sees."""
    bench = bench_in(folder, simulator, lens)
    colours = bench.collect("/camera/image_raw", Image)
    depths = bench.collect("/camera/depth/image_raw", Image)
    bench.advance(0.5)
    skip_without_pictures(bench, simulator, depths)
    return colours[-1], np.frombuffer(depths[-1].data, np.float32).reshape(120, 160)


@pytest.mark.parametrize("lens", ["[-0.2, 0.03, 0, 0]", *rare("[]")])
def test_both_simulators_show_the_same_depths(tmp_path: Path, lens: str) -> None:
    (tmp_path / "one").mkdir()
    (tmp_path / "two").mkdir()
    picture, ideal = seen(tmp_path / "one", "ideal", lens)
    other, physics = seen(tmp_path / "two", "physics", lens)
    steep = np.hypot(*np.gradient(np.where(np.isfinite(ideal), ideal, 50.0))) > 0.05
    edge = np.zeros_like(steep)
    for down in range(-2, 3):
        for across in range(-2, 3):
            edge |= np.roll(steep, (down, across), (0, 1))
    both = np.isfinite(ideal) & np.isfinite(physics) & ~edge
    assert both.mean() > 0.3
    assert (np.abs(ideal[both] - physics[both]) > 0.01 + 0.01 * ideal[both]).mean() < 0.01
    reds = [
        (pixels[..., 0] > 2 * pixels[..., 1]).sum()
        for pixels in (np.frombuffer(one.data, np.uint8).reshape(120, 160, 3).astype(int) for one in (picture, other))
    ]
    assert reds[0] > 500
    assert reds[1] == pytest.approx(reds[0], rel=0.05)


def test_an_engine_that_cannot_draw_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def picture(engine: PhysicsWorld, camera: str) -> None:
        raise ImportError("cameras need EGL")

    monkeypatch.setattr(PhysicsWorld, "picture", picture)
    bench = bench_in(tmp_path, "physics")
    infos, images = bench.collect("/camera/camera_info", CameraInfo), bench.collect("/camera/image_raw", Image)
    bench.advance(1.0)
    assert infos
    assert not images
    statuses = bench.statuses("physics: pictures")
    bench.advance(1.5)
    assert (statuses[-1].level, statuses[-1].message) == (Level.ERROR, "cameras need EGL")


@SIMULATORS
def test_an_inertial_sensor_feels_gravity_turns_and_starts(tmp_path: Path, simulator: str) -> None:
    bench = bench_in(tmp_path, simulator, robot=without_camera(ROBOT))
    felt = bench.collect("/imu", Imu)
    bench.advance(1.0)
    at_rest = felt[-1].linear_acceleration
    assert (at_rest.x, at_rest.y, at_rest.z) == pytest.approx((0, 0, 9.81), abs=0.1)
    felt.clear()
    for _ in range(20):
        bench.publish("/cmd_vel", Twist(linear=Vector3(x=0.2), angular=Vector3(z=0.5)), Qos.COMMAND)
        bench.advance(0.1)
    assert max(one.linear_acceleration.x for one in felt) > 0.2
    assert felt[-1].angular_velocity.z == pytest.approx(0.5, abs=0.05)
    aside = np.mean([one.linear_acceleration.y for one in felt[-20:]])
    assert aside == pytest.approx(0.2 * 0.5, abs=0.05)
    turn = felt[-1].orientation
    assert 2 * math.atan2(turn.z, turn.w) > 0.5
