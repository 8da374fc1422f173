"""Robots that a physics engine moves through worlds, in virtual time."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from rbxcompose.compiler.compile import compile_robot
from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.rbxcompose_msgs import Switches
from rbxcompose.msgs.sensor_msgs import LaserScan
from rbxcompose.msgs.stamps import to_nanoseconds
from rbxcompose.msgs.std_msgs import String
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench
from rbxcompose.testing.bench import run_robot
from tests.navigation.test_robot import Room
from tests.soak import rare

pytestmark = pytest.mark.timeout(120)
mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed")

ROBOT = """body: {urdf: rbx:robots/turtlebot/turtlebot.urdf}
world: ../../room.yaml
simulator: physics
components:
  base: {type: diff_drive_sim}
  laser: {type: laser_sim, frame: base_link}
cameras: {front: {frame: base_link, size: [32, 24]}}
"""
CRATE = """rbx: 1
kind: World
name: room
objects:
  NAME: {box: [30 cm, 60 cm, 40 cm], at: {x: 60 cm}, mass: MASS}
"""


def pushed(folder: Path, mass: str, name: str = "crate") -> tuple[float, float, list[str]]:
    """Return how far a robot that pushes a crate gets [m], how far ahead its laser sees that, and what it touched.

    Its odometry and its summary agree with that.
    """
    bench = Room(folder, ROBOT, CRATE.replace("MASS", mass).replace("NAME", name)).bench
    truth, scans = bench.collect("/ground_truth", Odometry), bench.collect("/scan", LaserScan)
    told = bench.collect("/odom", Odometry)
    touched = bench.collect("/contact", String, Qos.EVENT)
    for _ in range(45):
        bench.publish("/cmd_vel", Twist(linear=Vector3(x=0.3)), Qos.COMMAND)
        bench.advance(0.1)
    driven = float(bench.host.summary()["base"]["distance driven"].removesuffix(" m"))
    assert driven == pytest.approx(truth[-1].pose.pose.position.x, abs=0.05)
    passed = (to_nanoseconds(told[-1].header.stamp) - to_nanoseconds(told[-101].header.stamp)) * 1e-9
    rolled = (told[-1].pose.pose.position.x - told[-101].pose.pose.position.x) / passed
    assert np.mean([one.twist.twist.linear.x for one in told[-100:]]) == pytest.approx(rolled, rel=0.01)
    ahead = float(np.asarray(scans[-1].ranges)[len(scans[-1].ranges) // 2])
    return truth[-1].pose.pose.position.x, ahead, [message.data for message in touched]


def test_a_robot_pushes_what_is_light(tmp_path: Path) -> None:
    light, seen, touched = pushed(tmp_path, "1 kg")
    assert light > 0.9
    assert seen < 0.4  # its laser sees the crate where it is now
    assert touched[0] == "crate"


@pytest.mark.parametrize("name", ["base_link", *rare("ground")])
def test_a_robot_stalls_before_what_stands_fast_and_feels_it_whatever_its_name(tmp_path: Path, name: str) -> None:
    far, _, touched = pushed(tmp_path, "0 kg", name)
    assert far < 0.45
    assert set(touched) == {name}


@pytest.mark.soak
def test_a_kobuki_bumps_backs_off_and_goes_on(repository: Path) -> None:
    sets = ("simulator=physics",)
    plan = compile_robot("robots/kobuki", sets=sets, environment={}).plan
    assert plan is not None
    bench = Bench(plan=plan)
    bumps, drops = bench.collect("/bumper", Switches), bench.collect("/wheel_drop", Switches)
    driven = bench.collect("/ground_truth", Odometry)
    bench.advance(25.0)
    pressed = [any(message.is_on) for message in bumps]
    began = sum(now and not before for before, now in pairwise(pressed))
    assert began >= 3
    assert not any(any(message.is_on) for message in drops)
    ahead = [message.twist.twist.linear.x for message in driven]
    assert min(ahead) < -0.05
    assert max(ahead[-len(ahead) // 4 :]) > 0.1


@pytest.mark.soak
def test_the_house_is_cleaned_without_a_touch(repository: Path) -> None:
    plan = compile_robot("robots/house", sets=("simulator=physics",), environment={}).plan
    assert plan is not None
    ran = run_robot(plan)
    assert ran.outcome == "success"
    assert ran.bench.component("physics").summary() == {"contacts": "0"}
