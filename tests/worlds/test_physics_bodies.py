"""Any body becomes a model of MuJoCo, and what was changed for that is said."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import Transform3, Vector3, quaternion_from_rpy
from rbxcompose.domains.body.pinocchio_model import PinocchioModel
from rbxcompose.domains.worlds.physics.engine import PhysicsWorld
from rbxcompose.domains.worlds.physics.rigid import RigidPart
from rbxcompose.domains.worlds.physics.robot import PhysicsRobot, outline_body
from rbxcompose.domains.worlds.physics.solids import box_inertia, quaternion_of, rotation_matrix
from tests.soak import rare
from tests.worlds.physical import STEP, contacts, description, empty, from_urdf, shipped, shipped_robots, target

ANGLES = st.floats(-math.pi, math.pi)
SOLID = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'


def joint(name: str, kind: str, parent: str, child: str, *, more: str = "", xyz: str = "0 0 0") -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{more}</joint>'


def link(name: str, *content: str) -> str:
    return f'<link name="{name}">{"".join(content)}</link>'


def box(size: str) -> str:
    return f'<collision><geometry><box size="{size}"/></geometry></collision>'


def mesh(file: str) -> str:
    return f'<collision><geometry><mesh filename="{file}" scale="1 1 2"/></geometry></collision>'


def stl(*triangles: tuple[Vector3, Vector3, Vector3]) -> str:
    corners = ["".join("vertex {} {} {}\n".format(*corner) for corner in triangle) for triangle in triangles]
    facets = [f"facet normal 0 0 0\nouter loop\n{corner}endloop\nendfacet\n" for corner in corners]
    return f"solid test\n{''.join(facets)}endsolid test\n"


OFTEN = {"pi_robot", "porter", "rover", "turtlebot"}  # with arms, without, on a lift


@pytest.mark.parametrize("name", [*sorted(OFTEN), *rare(*(name for name in shipped_robots() if name not in OFTEN))])
def test_each_shipped_robot_stands_still_and_holds_its_joints(name: str) -> None:
    robot = shipped(name)
    physics = PhysicsWorld(robot, empty(robot))
    for _ in range(50):
        physics.step(STEP)
    assert math.hypot(physics.base_pose.x, physics.base_pose.y) < 1e-3
    assert abs(physics.base_pose.heading) < 1e-3
    for moving in robot.body.joints.values():
        if moving.moves:
            tolerance = 3e-3 if moving.slides else math.radians(3)
            assert physics.position(moving.name) == pytest.approx(robot.body.position(moving, {}), abs=tolerance)


def test_masses_and_axes_are_those_that_another_library_reads() -> None:
    found = description("pedestal_pi")
    assert found is not None
    other = PinocchioModel(found)
    import pinocchio

    random = np.random.default_rng(1)
    for _ in range(5):
        positions = {moving.name: float(random.uniform(-1, 1)) for moving in found.body.moving}
        physics = PhysicsWorld(shipped("pedestal_pi", positions=positions), empty(shipped("pedestal_pi")))
        q = other.q(positions)
        gravity = pinocchio.computeGeneralizedGravity(other.model, other.data, q)
        for name in positions:
            place = physics.converted.joints[name].velocity
            theirs = gravity[other.model.joints[other.model.getJointId(name)].idx_v]
            assert physics._data.qfrc_bias[place] == pytest.approx(theirs, abs=1e-6)
        for link, pose in found.body.poses(positions).items():
            there = physics.pose_of(link)
            assert there.translation == pytest.approx(pose.translation, abs=1e-9)


@given(ANGLES, ANGLES, ANGLES, st.lists(st.floats(0.1, 1.0), min_size=3, max_size=3))
def test_the_parts_of_a_box_have_its_inertia(roll: float, pitch: float, yaw: float, sides: list[float]) -> None:
    turn = rotation_matrix(quaternion_from_rpy(roll, pitch, yaw))
    high = np.array(sides)
    _, whole = box_inertia(3.0, -high, high)
    part = RigidPart(-1, None, Transform3())
    middle = high * (1.0, 1.0, 0.2)
    for low, up in ((-high, middle), (np.array((*-high[:2], middle[2])), high)):
        share = 3.0 * float((up - low)[2] / (2 * high[2]))
        centre, inertia = box_inertia(share, low, up)
        part.add_mass(share, turn @ np.array(centre), turn @ inertia @ turn.T)
    assert part.mass == pytest.approx(3.0)
    assert part.centre == pytest.approx(np.zeros(3), abs=1e-9)
    assert part.inertia == pytest.approx(turn @ whole @ turn.T)


@given(ANGLES, ANGLES, ANGLES)
def test_a_rotation_is_the_same_as_a_matrix(roll: float, pitch: float, yaw: float) -> None:
    rotation = quaternion_from_rpy(roll, pitch, yaw)
    assert abs(np.dot(quaternion_of(rotation_matrix(rotation)), rotation)) == pytest.approx(1.0)


@pytest.mark.parametrize(("radius", "distance"), [(0.05, 0.3), (0.2, 0.6)])
def test_what_has_no_wheels_gets_some_and_says_so(radius: float, distance: float) -> None:
    robot = from_urdf(
        link("body", SOLID, box("0.5 0.5 0.2")), drives=True, wheel_radius=radius, wheel_distance=distance
    )
    physics = PhysicsWorld(robot, empty(robot))
    for done in range(100):
        physics.drive(0.3 * min(1.0, done / 25), 0.0)
        physics.step(STEP)
    left, right = physics.wheel_angles
    assert left == pytest.approx(right, rel=1e-3)
    assert physics.base_pose.x == pytest.approx(left * radius, rel=0.03)
    assert 0.4 < physics.base_pose.x < 0.6
    words = [repair.what for repair in physics.repairs]
    assert words == [
        f"it has no joints of wheels: two with a radius of {radius:g} m, {distance:g} m apart, are added",
        "nothing but its wheels carries it: casters in front and behind are added",
    ]


def test_a_sensor_beside_the_axis_feels_that_the_robot_turns() -> None:
    mount = '<joint name="mount" type="fixed"><origin xyz="0.2 0 0"/><parent link="body"/><child link="imu"/></joint>'
    mass = '<inertial><mass value="4"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'
    robot = from_urdf(link("body", mass, box("0.5 0.5 0.2")) + link("imu") + mount, drives=True, wheel_distance=0.3)
    physics = PhysicsWorld(robot, empty(robot))
    for done in range(150):
        physics.drive(0.0, 2.0 * min(1.0, done / 50))
        physics.step(STEP)
    felt = physics.imu("imu")
    turning = felt.angular_velocity[2]
    assert turning == pytest.approx(2.0, rel=0.02)
    assert felt.acceleration == pytest.approx((-(turning**2) * 0.2, 0.0, 9.81), abs=0.03)
    assert felt.orientation == physics.pose_of("body").rotation


def test_links_that_overlap_at_the_start_do_not_push_each_other_away() -> None:
    limits = '<axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="9" velocity="9"/>'
    links = "".join(link(name, SOLID, box("0.3 0.1 0.1")) for name in ("first", "second", "third"))
    robot = from_urdf(
        link("base")
        + links
        + joint("one", "revolute", "base", "first", more=limits)
        + joint("two", "revolute", "first", "second", more=limits, xyz="0.1 0 0")
        + joint("three", "revolute", "second", "third", more=limits, xyz="0.1 0 0"),
        drives=False,
    )
    physics = PhysicsWorld(robot, empty(robot))
    physics.step(1.0)
    assert [physics.position(name) for name in ("one", "two", "three")] == pytest.approx([0.0] * 3, abs=1e-6)
    assert [f"{repair.link}: {repair.what}" for repair in physics.repairs] == [
        "base: it reaches 0.05 m below the ground: it is lifted by that",
        "first: it overlaps 'third' at the start: the two do not touch each other",
    ]


def test_a_robot_of_which_only_the_outline_is_known_drives() -> None:
    robot = PhysicsRobot(outline_body(0.2, 0.5), drives=True)
    physics = PhysicsWorld(robot, empty(robot))
    physics.drive(0.2, 0.0)
    physics.step(5.0)
    assert physics.base_pose.x == pytest.approx(1.0, abs=0.05)


def test_every_repair_is_reported_in_words(tmp_path: Path) -> None:
    flat = tmp_path / "flat.stl"
    flat.write_text(stl(((0, 0, 0), (1, 0, 0), (0, 1, 0))))
    mass = '<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="9" ixy="0" ixz="0" iyz="0"/></inertial>'
    robot = from_urdf(
        link("base", SOLID, mesh("flat.stl"), mesh("lost.stl"))
        + link("upper", mass, box("0.2 0.2 0.00001"))
        + link("lower")
        + link("hanging")
        + joint("shoulder", "revolute", "base", "upper", more='<limit lower="0" upper="0" effort="5" velocity="1"/>')
        + joint("elbow", "revolute", "upper", "lower", more='<limit lower="0" upper="1" effort="0" velocity="1"/>')
        + joint("cord", "floating", "base", "hanging"),
        meshes={"flat.stl": flat},
        drives=False,
    )
    repairs = PhysicsWorld(robot, empty(robot)).repairs
    assert [f"{repair.link}: {repair.what}" for repair in repairs] == [
        "hanging: its joint 'cord' is floating: it is fixed",
        "base: the mesh 'flat.stl' is flat: it collides as a box around it, at least 1 mm thick",
        "base: a mesh is left out, so nothing touches it: 'lost.stl' is not there",
        "upper: its box has no thickness: it is made 0.1 mm thick",
        "upper: its inertia is none of a solid: that of the box around its shapes counts",
        "lower: it has no mass: it is as heavy as a cube of 1 cm with 300 kg/m^3, 0.001 kg",
        "shoulder: its limits leave it no range: it has none",
        "elbow: its URDF says no effort: it has 0.00012 Nm",
    ]


def test_a_link_that_nothing_holds_falls_until_its_mesh_touches_the_ground(tmp_path: Path) -> None:
    pytest.importorskip("trimesh")
    file = tmp_path / "tip.stl"
    corners = ((0.0, 0.0, 0.0), (0.1, 0.0, 0.3), (-0.1, 0.1, 0.3), (-0.1, -0.1, 0.3))
    faces = ((0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2))
    file.write_text(stl(*((corners[a], corners[b], corners[c]) for a, b, c in faces)))
    limits = '<axis xyz="0 0 1"/><limit lower="-9" upper="9" effort="1" velocity="1"/>'
    robot = from_urdf(
        link("base")
        + link("tip", SOLID, mesh("tip.stl"))
        + joint("rail", "prismatic", "base", "tip", more=limits, xyz="0 0 0.4"),
        meshes={"tip.stl": file},
        drives=False,
    )
    physics = PhysicsWorld(robot, empty(robot))
    physics.limit("rail", 0.0)
    physics.step(2.0)
    assert physics.position("rail") == pytest.approx(-0.4, abs=3e-3)
    assert {(touch.link, touch.what) for touch in contacts(physics)} == {("tip", "the ground")}
    assert sum(touch.force for touch in contacts(physics)) == pytest.approx(9.81, rel=0.05)


def test_a_joint_that_mimics_another_follows_it() -> None:
    limits = '<axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="9" velocity="1"/>'
    mimic = '<mimic joint="leader" multiplier="-0.5" offset="0.2"/>'
    robot = from_urdf(
        link("base")
        + link("first", SOLID)
        + link("second", SOLID)
        + joint("leader", "revolute", "base", "first", more=limits)
        + joint("follower", "revolute", "base", "second", more=limits + mimic),
        drives=False,
    )
    physics = PhysicsWorld(robot, empty(robot))
    target(physics, "leader", 1.0)
    for _ in range(200):
        physics.step(STEP)
        wanted = -0.5 * physics.position("leader") + 0.2
        assert physics.position("follower") == pytest.approx(wanted, abs=0.02)
    assert physics.position("leader") == pytest.approx(1.0, abs=0.01)
    with pytest.raises(ValueError, match="nothing drives a joint 'follower'"):
        physics.target("follower", 0.0, 0.0)


def test_wrong_names_are_refused() -> None:
    with pytest.raises(ValueError, match="'lost' is no joint"):
        PhysicsWorld(shipped("turtlebot", servos={"lost": None}), empty(shipped("turtlebot")))
    with pytest.raises(ValueError, match="'lost' is no shape"):
        PhysicsWorld(shipped("turtlebot"), empty(shipped("turtlebot")), {"lost": 1.0})


def test_nothing_imports_the_engine_before_a_robot_is_put_into_it() -> None:
    code = "import sys, rbxcompose.domains.worlds.physics.engine; sys.exit('mujoco' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
