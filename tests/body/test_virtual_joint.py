"""A virtual joint: its frame is the root of the body if it is fixed, and outside of the body if it moves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.findings import Span
from rbxcompose.domains.body.description import VirtualJoint
from rbxcompose.domains.body.link_pairs import digest_of
from rbxcompose.domains.body.model import Body
from rbxcompose.msgs.tf2_msgs import TFMessage
from rbxcompose.sdk.ports import Qos
from rbxcompose.testing import Bench, instance
from tests.body.kinematics import Three, description_of
from tests.body.random_bodies import positions, urdfs
from tests.loops import for_all
from tests.parts.project import Project

ARM = """
buses: {servos: {type: dynamixel}}
include:
  arm: {part: "rbx:parts/servo_arm.yaml", with: {bus: servos}}
"""
IN_WORLD = """
scene:
  objects:
    floor: {plane: below, link: world}
    wall: {box: [2 cm, 2 cm, 2 cm], frame: world, at: {x: 1 m}}
missions: {go: ../../go.yaml}
start: go
"""
MISSION = """\
rbx: 1
kind: Mission
name: go
do:
- reach_arm: {x: 20 cm, z: 20 cm, frame: world}
- trace_arm: {points: [{x: 22 cm, z: 22 cm}], frame: world, any_orientation: true}
"""
BASE = """
include:
  base: {part: "rbx:parts/cylinder_base.yaml"}
muxes:
  cmd_vel: {inputs: {teleop: {priority: 1, timeout: 0.5 s}}}
"""
HERE = Span("robot.yaml", 1, 1, 1, 1)
WORLD = VirtualJoint("world_joint", "fixed", "world", HERE, HERE)


def config(project: Project, kind: str) -> Any:
    assert project.checked
    [found] = [one for one in project.checked.plan.instances if one.type == kind]
    return found.config


def without_places(body: Body) -> tuple[object, ...]:
    joints = {
        name: (joint.kind, joint.parent, joint.child, joint.origin, joint.axis, joint.mimic and joint.mimic.joint)
        for name, joint in body.joints.items()
    }
    return {*body.links}, joints


@given(st.data())
def test_a_fixed_one_moves_no_link_and_needs_no_new_file_of_pairs(data: st.DataObject) -> None:
    before = description_of(data.draw(urdfs()))
    after = before.with_virtual(WORLD)
    assert (after.body.root, after.body.own_root) == ("world", before.body.root)
    assert without_places(description_of(after.text).body) == without_places(after.body)
    at = data.draw(positions(before.body))
    assert after.body.poses(at) == {"world": before.body.poses({})[before.body.root], **before.body.poses(at)}
    assert Three(after).largest_difference(at) < 1e-6
    assert digest_of(after.body, {}) == digest_of(before.body, {})


@given(st.data())
def test_what_is_still_is_where_it_is_at_all_positions(data: st.DataObject) -> None:
    body = description_of(data.draw(urdfs())).body
    poses = body.poses(data.draw(positions(body)))
    assert {link: poses[link] for link in body.still} == body.still


def test_its_frame_is_one_of_links_and_others_get_the_urdf_as_it_was(tmp_path: Path) -> None:
    project = Project(tmp_path)
    project.check(ARM)
    before = config(project, "robot_description").urdf
    checked = project.check(f"{ARM}body: {{virtual_joint: {{frame: world}}}}\n{IN_WORLD}", files={"go.yaml": MISSION})
    assert checked.codes == [], checked.text
    assert config(project, "robot_description").urdf == before
    assert config(project, "scene").frames == ()
    bench = Bench(instance("frames", "transforms", {"urdf": config(project, "arm").urdf}))
    told: list[TFMessage] = []
    bench.bus.subscribe("listener", "/tf_static", TFMessage, Qos.LATCHED, told.append)
    bench.advance(0.1)
    pairs = {
        (transform.header.frame_id, transform.child_frame_id) for message in told for transform in message.transforms
    }
    assert ("world", "arm_base_link") in pairs


@for_all(
    "robot, joint, codes, cure",
    [
        (ARM, "{frame: arm_base_link}", ["RBX2249"], "leave the virtual joint out"),
        (ARM, "{frame: world, name: arm_mount}", [], ""),
        (ARM, "{frame: world, name: arm_wrist_flex_joint}", ["RBX2249"], "write another 'name'"),
        (ARM, "{frame: /world}", ["RBX1006"], "such as 'world'"),
        (ARM, "{frame: world, type: plnar}", ["RBX1004"], "did you mean 'planar'"),
        (ARM, "{frame: world, type: floating}", ["RBX2352"], "write 'type: fixed' if it stands still"),
        (BASE, "{frame: world}", ["RBX3014"], "write 'type: planar' and 'frame: odom' there"),
        (BASE, "{frame: world, type: planar}", ["RBX2352"], "write 'frame: odom' or 'frame: map'"),
        (BASE, "{frame: odom, type: planar}", [], ""),
        (BASE, "{frame: map, type: planar}", [], ""),
    ],
)
def test_what_does_not_fit_is_told_with_the_cure(
    robot: str, joint: str, codes: list[str], cure: str, tmp_path: Path
) -> None:
    checked = Project(tmp_path).check(f"{robot}body: {{virtual_joint: {joint}}}\n")
    assert [code for code in checked.codes if code != "RBX5002"] == codes, checked.text
    assert cure in checked.text


def test_a_frame_in_which_the_body_moves_is_one_of_the_scene(tmp_path: Path) -> None:
    project = Project(tmp_path)
    project.check(f"{ARM}body: {{virtual_joint: {{frame: odom, type: planar}}}}\n")
    assert config(project, "scene").frames == ("odom",)
    assert "odom" not in config(project, "arm").urdf


def test_a_base_may_move_the_child_of_a_planar_joint_of_the_urdf(tmp_path: Path) -> None:
    ends = '<parent link="odom"/><child link="base_footprint"/>'
    joint = f'<joint name="ground" type="planar">{ends}<axis xyz="0 0 1"/></joint>'
    urdf = f'<robot name="r"><link name="odom"/><link name="base_footprint"/>{joint}</robot>'
    robot = "body: {urdf: r.urdf}\ncomponents: {base: {type: diff_drive_sim}}\n" + BASE[BASE.index("muxes") :]
    checked = Project(tmp_path).check(robot, files={"robots/one/r.urdf": urdf})
    assert [code for code in checked.codes if code != "RBX5002"] == ["RBX2024"], checked.text


def test_a_part_places_no_robot(tmp_path: Path) -> None:
    part = {"it": "body: {virtual_joint: {frame: world}}\n"}
    checked = Project(tmp_path).check("include: {it: ../../parts/it.yaml}\n", part)
    assert "unknown key 'virtual_joint'" in checked.text


def test_joints_with_the_same_words_are_the_same() -> None:
    assert replace(WORLD, span=Span("other.yaml", 2, 2, 2, 2)) == WORLD
