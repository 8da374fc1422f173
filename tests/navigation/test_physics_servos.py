"""Servos whose joints a physics engine moves, in virtual time."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from rbxcompose.msgs.geometry_msgs import Twist, Vector3
from rbxcompose.msgs.nav_msgs import Odometry
from rbxcompose.msgs.poses import pose_in
from rbxcompose.msgs.sensor_msgs import JointState
from rbxcompose.msgs.std_msgs import Float64
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench
from rbxcompose.testing.bench import run_robot
from tests.parts.project import Project
from tests.shipped import compiled
from tests.soak import rare

pytestmark = pytest.mark.timeout(120)
mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed")

URDF = """<robot name="arm">
  <link name="base"/>
  <joint name="lift" type="revolute">
    <parent link="base"/> <child link="arm"/> <origin xyz="0 0 0.5"/> <axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="10" velocity="5"/>
  </joint>
  <link name="arm">
    <inertial>
      <origin xyz="0.2 0 0"/> <mass value="MASS"/> <inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
</robot>"""
ROBOT = """body: {urdf: arm.urdf}
world: rbx:worlds/blank.yaml
simulator: SIMULATOR
buses:
  servos: {type: dynamixel}
actuators:
  motor: {bus: servos, model: AX-12, id: 1, invert: true, torque: TORQUE}
joints:
  lift: {actuator: motor}
"""
STALL = 1.5  # [Nm] of an AX-12


class Arm:
    """An arm that one servo turns about a level axis, with its weight 20 cm from there."""

    def __init__(self, folder: Path, mass: float, torque: str = "100 %", simulator: str = "physics") -> None:
        robot = ROBOT.replace("TORQUE", torque).replace("SIMULATOR", simulator)
        files = {"robots/one/arm.urdf": URDF.replace("MASS", str(mass))}
        checked = Project(folder).check(robot, files=files)
        assert checked.compilation.plan, checked.text
        self.bench = Bench(plan=checked.compilation.plan)
        self.states = self.bench.collect("/joint_states", JointState)

    def held(self, angle: float) -> float:
        """Return where the arm is after 1.2 s of holding an angle [rad], down being positive."""
        self.bench.publish("/lift/command", Float64(data=angle), Qos.COMMAND)
        self.bench.advance(1.2)
        return self.angle

    @property
    def angle(self) -> float:
        return float(self.states[-1].position[0])


def test_an_arm_sags_by_its_load_and_reports_it(tmp_path: Path) -> None:
    masses = (0.0001, 0.2, 0.5)
    arms = [Arm(tmp_path, mass) for mass in masses]
    sags = [arm.held(-0.3) + 0.3 for arm in arms]
    assert sags == sorted(sags)
    assert abs(sags[0]) < math.radians(0.5)
    assert math.radians(0.5) < sags[-1] < math.radians(4.0)
    for mass, sag, arm in zip(masses, sags, arms, strict=True):
        load = mass * 9.81 * 0.2 * math.cos(sag - 0.3) / STALL
        assert -arm.states[-1].effort[0] == pytest.approx(load, abs=0.02)


def test_an_arm_with_too_little_torque_sinks_and_a_relaxed_one_hangs(tmp_path: Path) -> None:
    weak, strong = (Arm(tmp_path, 0.5, torque) for torque in ("30 %", "100 %"))
    assert weak.held(-0.3) > 0.5
    assert strong.held(-0.3) < -0.2
    strong.bench.component("servos").let_go("lift")  # type: ignore[attr-defined]
    strong.bench.advance(3.0)
    assert strong.angle == pytest.approx(math.pi / 2, abs=0.2)
    assert strong.held(0.0) == pytest.approx(0.0, abs=math.radians(4.0))


def test_only_physics_has_ports_between_servos_and_the_engine(tmp_path: Path) -> None:
    ports = {
        simulator: Arm(tmp_path, 0.5, simulator=simulator).bench.component("servos").bound.keys()
        for simulator in ("ideal", "physics")
    }
    assert ports["physics"] - ports["ideal"] == {"set_points", "moved"}
    assert ports["ideal"] <= ports["physics"]


@pytest.mark.parametrize("simulator", ["physics", "ideal"])
def test_servos_that_turn_wheels_drive_the_base_from_where_its_world_puts_it(repository: Path, simulator: str) -> None:
    sets = ("world=rbx:worlds/house.yaml", f"simulator={simulator}", "start=")
    compilation = compiled(str(repository / "robots/rover"), sets=sets, environment={})
    assert not list(compilation.report)
    assert compilation.plan is not None
    bench = Bench(plan=compilation.plan)
    told, truth = bench.collect("/odom", Odometry), bench.collect("/ground_truth", Odometry)
    for _ in range(20):
        bench.publish("/cmd_vel", Twist(linear=Vector3(x=0.2)), Qos.COMMAND)
        bench.advance(0.1)
    pose = pose_in(told[-1].pose.pose)
    assert (pose.x, pose.y, pose.heading) == pytest.approx((1.0, 0.7 + 0.35, math.pi / 2), abs=0.05)
    if truth:
        true = pose_in(truth[-1].pose.pose)
        assert (pose.x, pose.y) == pytest.approx((true.x, true.y), abs=0.02)
    assert bool(truth) == (simulator == "physics")


@pytest.mark.parametrize("robot", rare("pi_robot", "porter"))
def test_missions_that_move_arms_and_grippers_succeed(repository: Path, robot: str) -> None:
    sets = ("world=rbx:worlds/blank.yaml", "simulator=physics", "start=open_and_close")
    plan = compiled(str(repository / "robots" / robot), sets=sets, environment={}).plan
    assert plan is not None
    assert run_robot(plan).outcome == "success"


@pytest.mark.soak  # the engine alone grips a box in `test_physics_arms`
def test_a_block_is_grasped_and_lifted_and_its_gripper_feels_it(repository: Path) -> None:
    porter, chosen = str(repository / "robots/porter"), ["table", "heavy"]
    plan = compiled(porter, profiles=chosen, sets=("start=pick_and_place",), environment={}).plan
    assert plan is not None
    bench = Bench(plan=plan)
    moved, states = bench.collect("/world/moved", TFMessage), bench.collect("/joint_states", JointState)
    assert bench.run_until(lambda: bool(moved) and moved[-1].transforms[0].transform.translation.z > 0.70, most=30.0)
    finger = states[-1].name.index("right_gripper_left_finger_joint")
    assert states[-1].position[finger] == pytest.approx(0.02, abs=0.002)  # it is to be at 15 mm
    assert states[-1].effort[finger] < -0.5
