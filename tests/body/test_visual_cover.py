"""What is seen, among what nothing may be within: as another library reads it, each shape once."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pinocchio
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.body.description import covering, to_xml
from rbxcompose.domains.body.link_pairs import digest_of
from rbxcompose.domains.body.urdf import read_body
from rbxcompose.domains.body.xml_reader import XmlElement, read_urdf
from tests.body.described import described
from tests.parts.project import Project

SIZES = st.sampled_from(("0.1", "0.25", "0.5"))
SHAPES = st.one_of(
    st.builds('<box size="{} {} {}"/>'.format, SIZES, SIZES, SIZES),
    st.builds('<sphere radius="{}"/>'.format, SIZES),
    st.builds('<cylinder radius="{}" length="{}"/>'.format, SIZES, SIZES),
)
POSES = st.builds('<origin xyz="{} 0 0" rpy="0 {} 0"/>'.format, SIZES, SIZES) | st.just("")
ELEMENTS = st.lists(st.tuples(st.sampled_from(("visual", "collision")), POSES, SHAPES), max_size=6)
COMPONENTS = ("arm", "robot_description", "scene")
LAMP = (
    '<robot name="lamp"><link name="bulb"><visual><geometry><sphere radius="0.04"/></geometry></visual></link></robot>'
)
ROBOT = """
body: {{pieces: {{lamp: {{urdf: lamp.urdf, attach: {{to: arm_tip}}}}}}, cover: {cover}}}
buses: {{servos: {{type: dynamixel}}}}
include: {{arm: {{part: rbx:parts/servo_arm.yaml, with: {{bus: servos}}}}}}
"""


@given(st.lists(ELEMENTS, min_size=1, max_size=3))
def test_collision_shapes_are_all_shapes_that_there_are_each_once(links: list[list[tuple[str, str, str]]]) -> None:
    text = "".join(_link(number, elements) for number, elements in enumerate(links))
    joints = "".join(_joint(number) for number in range(1, len(links)))
    root = read_urdf(f'<robot name="r">{text}{joints}</robot>', "r.urdf")
    assert isinstance(root, XmlElement)
    body, findings = read_body(root)
    assert not findings
    covered = to_xml(covering(root, body))
    seen, hit = (set(_shapes(to_xml(root), kind)) for kind in (pinocchio.VISUAL, pinocchio.COLLISION))
    found = Counter(_shapes(covered, pinocchio.COLLISION))
    assert set(found) == seen | hit
    assert found.total() == len(seen - hit) + Counter(_shapes(to_xml(root), pinocchio.COLLISION)).total()
    assert Counter(_shapes(covered, pinocchio.VISUAL)) == Counter(_shapes(to_xml(root), pinocchio.VISUAL))


def _link(number: int, elements: list[tuple[str, str, str]]) -> str:
    shapes = "".join(f"<{tag}>{pose}<geometry>{shape}</geometry></{tag}>" for tag, pose, shape in elements)
    return f'<link name="l{number}">{shapes}</link>'


def _joint(number: int) -> str:
    ends = f'<parent link="l{number - 1}"/><child link="l{number}"/>'
    return f'<joint name="j{number}" type="continuous">{ends}<axis xyz="0 0 1"/></joint>'


def _shapes(text: str, kind: object) -> Iterator[tuple[str, str, str]]:
    model = pinocchio.buildModelFromXML(text)
    for geometry_object in pinocchio.buildGeomFromUrdfString(model, text, kind).geometryObjects:
        shape = geometry_object.geometry
        size = next(str(getattr(shape, name)) for name in ("halfSide", "halfLength", "radius") if hasattr(shape, name))
        size += str(getattr(shape, "radius", ""))
        yield (
            model.frames[geometry_object.parentFrame].name,
            f"{type(shape).__name__} {size}",
            str(geometry_object.placement.homogeneous.round(9)),
        )


def test_a_robot_that_covers_what_is_seen_says_so_to_everybody(tmp_path: Path) -> None:
    project = Project(tmp_path)
    bodies = []
    for cover, codes in (("collision", ["RBX2354"]), ("visual", [])):
        project.check(ROBOT.format(cover=cover), files={"robots/one/lamp.urdf": LAMP})
        assert [finding.code for finding in project.findings] == codes
        bodies.append(described(project.manifest))
        assert project.checked is not None
        assert project.checked.compilation.robot is not None
        configs = (project.checked.compilation.robot.components[component].config for component in COMPONENTS)
        assert {getattr(config, "urdf", "") for config in configs} == {bodies[-1].text}
    assert bodies[1].text.count("<collision>") == bodies[0].text.count("<collision>") + 1
    assert [collision.geometry.size for collision in bodies[1].body.links["lamp_bulb"].collisions] == [(0.04,)]


def test_pairs_that_were_tried_on_other_shapes_do_not_count_and_check_says_so(tmp_path: Path) -> None:
    project = Project(tmp_path)
    project.check(ROBOT.format(cover="collision"), files={"robots/one/lamp.urdf": LAMP})
    digest = digest_of(described(project.manifest).body, {})
    pairs = f"body: {digest}\nsamples: 100\nseed: 1\npairs:\n- [arm_tip, lamp_bulb, adjacent]\n"
    files = {"robots/one/lamp.urdf": LAMP, "robots/one/pairs.yaml": pairs}
    for cover, codes in (("collision", ["RBX2354"]), ("visual", ["RBX2307"])):
        project.check(ROBOT.format(cover=f"{cover}, collisions: pairs.yaml"), files=files)
        assert [finding.code for finding in project.findings] == codes
