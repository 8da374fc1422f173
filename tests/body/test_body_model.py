"""Links and joints read from URDF: what is in them, where they are, and each mistake at its place."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.findings import Finding, Span
from rbxcompose.base.geometry import Transform3, quaternion_about, quaternion_from_rpy, rotate
from rbxcompose.domains.body.commands.body import joints_of, links_of, tree_of
from rbxcompose.domains.body.model import Body, BodyJoint
from rbxcompose.domains.body.urdf import read_body
from rbxcompose.domains.body.xml_reader import XmlElement, read_urdf
from tests.loops import for_all

ARM = """<robot name="arm">
  <material name="red"><color rgba="1 0 0 1"/></material>
  <link name="base">
    <inertial><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <visual><geometry><box size="1 2 3"/></geometry><material name="red"/></visual>
  </link>
  <link name="upper"/>
  <link name="lower"/>
  <link name="hand"/>
  <joint name="shoulder" type="revolute">
    <origin xyz="0 0 1"/> <parent link="base"/> <child link="upper"/> <axis xyz="0 2 0"/>
    <limit lower="0.5" upper="1.5" effort="3" velocity="2"/>
  </joint>
  <joint name="slide" type="prismatic">
    <origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/> <parent link="upper"/> <child link="lower"/>
    <limit lower="-1" upper="1" effort="3" velocity="2"/>
  </joint>
  <joint name="finger" type="continuous">
    <parent link="lower"/> <child link="hand"/> <axis xyz="0 0 1"/> <mimic joint="slide" multiplier="2" offset="0.25"/>
  </joint>
</robot>
"""


def read(text: str) -> tuple[Body, list[Finding]]:
    root = read_urdf(text, "arm.urdf")
    assert isinstance(root, XmlElement), root
    return read_body(root)


@pytest.fixture(scope="module")
def arm() -> Body:
    body, findings = read(ARM)
    assert not findings
    return body


def test_links_and_joints_are_read_with_their_values(arm: Body) -> None:
    base, shoulder = arm.links["base"], arm.joints["shoulder"]
    assert base.inertial
    assert (base.inertial.mass, base.visuals[0].geometry.size, base.visuals[0].colour) == (2, (1, 2, 3), (1, 0, 0, 1))
    assert (shoulder.axis, shoulder.origin.translation, shoulder.rest) == ((0, 1, 0), (0, 0, 1), 0.5)
    assert (arm.root, [joint.name for joint in arm.moving]) == ("base", ["shoulder", "slide"])
    assert arm.joints["finger"].span[:3] == ("arm.urdf", 18, 3)


@pytest.mark.parametrize(
    ("mimic", "expected"),
    [
        ('multiplier="4" offset="0.5"', (-0.875, 0.625, 0.5)),
        ('multiplier="-4" offset="0.5"', (-0.625, 0.875, 0.5)),
        ('multiplier="0" offset="9"', (-1.0, 1.0, 2.0)),
        ('multiplier="2.9999999999"', (-1.0, 1.0, 2.0 / 3)),  # rounded
        ('offset="9"', (-1.0, 1.0, 2.0)),  # which is told
    ],
)
@pytest.mark.parametrize("kind", ["revolute", "continuous"])
def test_a_joint_keeps_those_that_mimic_it_within_their_limits(
    mimic: str, expected: tuple[float, float, float], kind: str
) -> None:
    limit = '<limit lower="-3" upper="3" effort="3" velocity="2"/>'
    finger = f'<joint name="finger" type="{kind}">{limit}'
    text = ARM.replace('<joint name="finger" type="continuous">', finger).replace('multiplier="2" offset="0.25"', mimic)
    body, findings = read(text)
    assert not findings
    limits = body.joints["slide"].limits
    assert limits
    lower, upper, velocity = expected
    wanted = (lower, upper, velocity) if kind == "revolute" else (-1.0, 1.0, velocity)
    assert (limits.lower, limits.upper, limits.velocity) == pytest.approx(wanted, rel=1e-9)


def test_each_link_is_where_its_joints_put_it(arm: Body) -> None:
    poses = arm.poses({"shoulder": 1.0, "slide": 0.5})
    cos, sin = math.cos(1.0), math.sin(1.0)
    # A turn by 1 about y takes x to (cos, 0, -sin); the slide goes along its own x, which is the upper link's y.
    assert poses["lower"].translation == pytest.approx((cos, 0.5, 1 - sin))
    turned = rotate(poses["hand"].rotation, (1.0, 0.0, 0.0))
    expected = rotate(poses["lower"].rotation, (math.cos(1.25), math.sin(1.25), 0.0))
    assert turned == pytest.approx(expected)


def test_a_joint_that_nobody_has_moved_is_at_rest(arm: Body) -> None:
    assert arm.poses({}) == arm.poses({"shoulder": 0.5, "slide": 0.0})


@given(st.tuples(*3 * [st.floats(-math.pi, math.pi)]))
def test_angles_of_urdf_are_about_fixed_axes(rpy: tuple[float, float, float]) -> None:
    roll, pitch, yaw = rpy
    about_x = np.array([[1, 0, 0], [0, math.cos(roll), -math.sin(roll)], [0, math.sin(roll), math.cos(roll)]])
    about_y = np.array([[math.cos(pitch), 0, math.sin(pitch)], [0, 1, 0], [-math.sin(pitch), 0, math.cos(pitch)]])
    about_z = np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
    turned = [rotate(quaternion_from_rpy(*rpy), tuple(axis)) for axis in np.eye(3)]
    assert pytest.approx(about_z @ about_y @ about_x, abs=1e-9) == np.array(turned).T


def test_it_is_shown_as_tables_and_as_a_tree(arm: Body) -> None:
    assert next(iter(links_of(arm))) == ("base", "", "", "2 kg", "box")
    assert next(iter(joints_of(arm))) == ("shoulder", "revolute", "28.65 deg", "85.94 deg", "3 Nm", "114.6 deg/s")
    assert list(tree_of(arm)) == [
        "base",
        "  upper  (shoulder: revolute)",
        "    lower  (slide: prismatic)",
        "      hand  (finger: continuous)",
    ]


JOINT = '<joint name="neck" type="fixed"><parent link="a"/><child link="b"/>'
TWO = '<link name="a"/><link name="b"/>'
MISTAKES = {
    "a number that is none": (TWO + JOINT + '<origin xyz="0 0 nan"/></joint>', "RBX2003", "3 finite numbers"),
    "too few numbers": (TWO + JOINT + '<origin xyz="0 0"/></joint>', "RBX2003", "3 finite numbers"),
    "an axis of no length": (
        TWO + JOINT.replace("fixed", "continuous") + '<axis xyz="0 0 0"/></joint>',
        "RBX2003",
        "length zero",
    ),
    "an unknown type": (TWO + JOINT.replace("fixed", "revolut") + "</joint>", "RBX2003", "type 'revolut'"),
    "no limits": (TWO + JOINT.replace("fixed", "revolute") + "</joint>", "RBX2003", "needs '<limit>'"),
    "limits the wrong way round": (
        TWO + JOINT.replace("fixed", "revolute") + '<limit lower="1" upper="-1"/></joint>',
        "RBX2003",
        "above its upper",
    ),
    "a negative speed": (
        TWO + JOINT.replace("fixed", "continuous") + '<limit effort="1" velocity="-3"/></joint>',
        "RBX2003",
        "velocity limit of joint 'neck'",
    ),
    "a negative effort": (
        TWO + JOINT.replace("fixed", "continuous") + '<limit effort="-1" velocity="3"/></joint>',
        "RBX2003",
        "effort limit of joint 'neck'",
    ),
    "no name": ("<link/>", "RBX2003", "needs the attribute 'name'"),
    "no child": (TWO + '<joint name="neck" type="fixed"><parent link="a"/></joint>', "RBX2003", "needs '<child>'"),
    "a shape of no size": (
        '<link name="a"><visual><geometry><sphere radius="0"/></geometry></visual></link>',
        "RBX2003",
        "must be positive",
    ),
    "no shape": ('<link name="a"><visual><geometry/></visual></link>', "RBX2003", "a geometry is one of"),
    "a link twice": ('<link name="a"/><link name="a"/>', "RBX2004", "two links are named 'a'"),
    "a joint twice": (TWO + JOINT + "</joint>" + JOINT + "</joint>", "RBX2004", "two joints are named 'neck'"),
    "an unknown link": (TWO + JOINT.replace('"b"', '"c"') + "</joint>", "RBX2005", "child of joint 'neck'"),
    "an unknown joint": (TWO + JOINT + '<mimic joint="nack"/></joint>', "RBX2005", "mimics a joint"),
    "a mimic of what does not move": (TWO + JOINT + '<mimic joint="neck"/></joint>', "RBX2005", "mimics 'neck'"),
    "two roots": (TWO, "RBX2006", "connected to nothing"),
    "two parents": (
        TWO + '<link name="c"/>' + JOINT + "</joint>" + JOINT.replace("neck", "n2").replace('"a"', '"c"') + "</joint>",
        "RBX2006",
        "child of two joints",
    ),
    "a circle": (
        TWO + JOINT + "</joint>" + '<joint name="n" type="fixed"><parent link="b"/><child link="a"/></joint>',
        "RBX2006",
        "form a circle",
    ),
    "a circle beside a tree": (
        TWO
        + '<link name="c"/>'
        + '<joint name="m" type="fixed"><parent link="b"/><child link="c"/></joint>'
        + '<joint name="n" type="fixed"><parent link="c"/><child link="b"/></joint>',
        "RBX2006",
        "cannot be reached",
    ),
}


@for_all("name", MISTAKES)
def test_each_mistake_is_a_finding_at_its_element(name: str) -> None:
    inside, code, words = MISTAKES[name]
    _, findings = read(f'<robot name="r">\n{inside}\n</robot>')
    assert [(finding.code, finding.span and finding.span.line) for finding in findings] == [(code, 2)] * len(findings)
    assert any(words in finding.message for finding in findings), findings


def test_a_robot_without_links_is_told() -> None:
    _, findings = read('<robot name="r"/>')
    assert [(finding.code, finding.message) for finding in findings] == [("RBX2006", "this robot has no links")]


@given(st.recursive(st.just(""), lambda inner: st.lists(inner, max_size=3).map("".join).map("<link>{}</link>".format)))
def test_whatever_elements_there_are_reading_ends_in_findings(inside: str) -> None:
    read(f"<robot>{inside}</robot>")


def test_a_transform_of_a_fixed_joint_is_its_origin(arm: Body) -> None:
    assert arm.joints["slide"].at(0.0) == arm.joints["slide"].origin
    assert arm.poses({})["base"] == Transform3()


@given(position=st.floats(-3.1, 3.1), turn=st.floats(-3, 3), kind=st.sampled_from(["revolute", "prismatic"]))
def test_a_position_is_read_from_the_frame_that_it_leads_to(position: float, turn: float, kind: str) -> None:
    origin = Transform3((0.1, 0.2, 0.3), quaternion_about((0.6, 0.0, 0.8), turn))
    here = Span("", 1, 1, 1, 1)
    joint = BodyJoint("a", kind, "b", "c", origin, (0.0, 0.8, 0.6), here)
    assert joint.position_of(joint.at(position)) == pytest.approx(position, abs=1e-9)
