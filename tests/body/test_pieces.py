"""A body of several pieces: their names, where they are attached, and what keeps them from being one body."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.findings import Span
from rbxcompose.base.geometry import Transform3
from rbxcompose.compiler.composition.dump import dump_robot
from rbxcompose.domains.body.description import BodyPart, Piece, assembled, prefixed, to_xml
from rbxcompose.domains.body.files import BodyFile
from rbxcompose.domains.body.model import Body
from rbxcompose.domains.body.urdf import read_body
from rbxcompose.domains.body.xml_reader import XmlElement, read_urdf
from rbxcompose.manifest.fields import FramePose, PieceAttachment
from rbxcompose.testing.golden import Golden
from rbxcompose.testing.manifests import Checked, check_text
from tests.body.described import described

HEAD = "rbx: 1\nkind: Robot\nname: cart\n"
BASE = '<robot name="base"><link name="link"/></robot>\n'
NECK = """<robot name="neck">
  <material name="red"><color rgba="1 0 0 1"/></material>
  <link name="base"><visual><geometry><box size="0.1 0.1 0.1"/></geometry><material name="red"/></visual>
    <inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <link name="top"/>
  <link name="side"/>
  <joint name="pan" type="continuous">
    <origin xyz="0.1 0.2 0.3" rpy="0.1 0.2 0.3"/>
    <parent link="base"/><child link="top"/><axis xyz="0 0 1"/>
  </joint>
  <joint name="tilt" type="continuous">
    <parent link="base"/><child link="side"/><axis xyz="0 1 0"/><mimic joint="pan" multiplier="2"/>
  </joint>
  <transmission name="drive"><joint name="pan"/></transmission>
  <gazebo reference="top"><left>pan</left><speed>pan 1</speed></gazebo>
</robot>
"""
PARTS = {
    "base.urdf": BASE,
    "neck.urdf": NECK,
    "own.urdf": '<robot name="own"><link name="neck_base"/></robot>\n',
    "base.yaml": "rbx: 1\nkind: Part\nname: base\nbody: {urdf: base.urdf}\n",
    "neck.yaml": "rbx: 1\nkind: Part\nname: neck\nbody: {urdf: neck.urdf}\n",
    "bare.yaml": "rbx: 1\nkind: Part\nname: bare\n",
    "long_neck.yaml": (
        "rbx: 1\nkind: Part\nname: long_neck\nargs:\n  up: {type: length}\nbody: {urdf: neck.urdf}\n"
        "include:\n  more: {part: neck.yaml, attach: {to: top, at: {z: '${args.up}'}}}\n"
    ),
}
WHOLE = f"""{HEAD}args:
  height: {{type: length, default: 40 cm}}
include:
  base: base.yaml
  neck:
    part: long_neck.yaml
    with: {{up: 1 cm}}
    attach: {{to: base_link, at: {{z: "${{args.height}}", yaw: 90 deg}}}}
"""
WRONG = {
    "nothing to attach it to": "include: {base: base.yaml, neck: neck.yaml}\n",
    "a link that does not exist": "include: {base: base.yaml, neck: {part: neck.yaml, attach: {to: base_lnk}}}\n",
    "no base": "include: {neck: {part: neck.yaml, attach: {to: neck_top}}}\n",
    "a circle": (
        "include: {base: base.yaml, a: {part: neck.yaml, attach: {to: b_top}}, "
        "b: {part: neck.yaml, attach: {to: a_top}}}\n"
    ),
    "a part without a body": "include: {base: base.yaml, bare: {part: bare.yaml, attach: {to: base_link}}}\n",
    "a misspelt key": "include: {base: base.yaml, neck: {part: neck.yaml, attach: {to: base_link, al: {x: 1 m}}}}\n",
    "a link of the same name": "body: {urdf: own.urdf}\ninclude: {neck: {part: neck.yaml, attach: {to: neck_base}}}\n",
}
numbers = st.floats(-3, 3)


def check(folder: Path, robot: str, *sets: str) -> Checked:
    return check_text(robot, folder, others=PARTS, sets=sets)


def body_of(checked: Checked) -> Body:
    robot = checked.compilation.robot
    assert robot, checked.text
    return described(robot.manifest).body


def piece(name: str, text: str, attachment: PieceAttachment | None = None) -> Piece:
    root = read_urdf(text, f"{name}.urdf")
    assert isinstance(root, XmlElement)
    here = Span("robot.yaml", 1, 1, 1, 2)
    return BodyPart(name, BodyFile(Path(f"{name}.urdf"), here), attachment, here, here), root


def read(root: object) -> Body:
    assert isinstance(root, XmlElement)
    body, findings = read_body(root)
    assert findings == []
    return body


def test_parts_bring_their_pieces_under_their_names(tmp_path: Path) -> None:
    checked = check(tmp_path, WHOLE)
    body = body_of(checked)
    assert checked.codes == []
    assert body.name == "cart"
    assert body.root == "base_link"
    assert {joint.name: (joint.parent, joint.child) for joint in body.joints.values() if joint.kind == "fixed"} == {
        "neck_mount": ("base_link", "neck_base"),
        "neck_more_mount": ("neck_top", "neck_more_base"),
    }
    assert body.joints["neck_mount"].origin.translation == (0.0, 0.0, 0.4)
    assert body.joints["neck_more_mount"].origin.translation == (0.0, 0.0, 0.01)


def test_layers_change_where_a_piece_is_attached(tmp_path: Path) -> None:
    attached = body_of(check(tmp_path, WHOLE, "include.neck.attach.at.z=1 m")).joints["neck_mount"]
    assert attached.origin.translation == (0.0, 0.0, 1.0)
    changed = body_of(check(tmp_path, WHOLE, "body.pieces.neck_more.attach.to=neck_side"))
    assert changed.joints["neck_more_mount"].parent == "neck_side"


def test_the_composed_robot_reads_back_as_the_same_body(tmp_path: Path) -> None:
    checked = check(tmp_path, WHOLE)
    assert checked.compilation.robot
    again = check(tmp_path, dump_robot(checked.compilation.robot.manifest))
    robots = [one.compilation.robot for one in (checked, again)]
    texts = [described(robot.manifest).text for robot in robots if robot]
    assert len(texts) == 2
    assert texts[0] == texts[1]


def test_each_mistake_is_told_at_its_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, golden: Golden) -> None:
    monkeypatch.chdir(tmp_path)
    told = {name: check(tmp_path, HEAD + text).text for name, text in WRONG.items()}
    golden.check("pieces.txt", "\n".join(f"--- {name}\n{text}" for name, text in told.items()))


def test_every_use_of_a_name_gets_the_prefix() -> None:
    text = to_xml(prefixed(piece("", NECK)[1], "my_"))
    for named in (
        'transmission name="drive"',
        'joint name="my_pan"',
        'gazebo reference="my_top"',
        "<left>my_pan</left>",
    ):
        assert named in text
    assert "<speed>pan 1</speed>" in text  # no name, but a text with one in it
    assert text.count('"my_red"') == 2


@given(at=st.tuples(numbers, numbers, numbers, numbers, numbers, numbers), pan=numbers)
def test_a_link_is_where_its_piece_has_it_in_the_frame_that_carries_the_piece(
    at: tuple[float, ...], pan: float
) -> None:
    x, y, z, roll, pitch, yaw = at
    pose = FramePose.model_construct(x=x, y=y, z=z, roll=roll, pitch=pitch, yaw=yaw)  # in SI units
    own = read(piece("", NECK)[1]).poses({"pan": pan})
    pieces = [piece("base", NECK), piece("neck", NECK, PieceAttachment(to="base_top", at=pose))]
    whole = read(assembled("cart", pieces)).poses({"base_pan": pan, "neck_pan": pan})
    for name, alone in own.items():
        expected = whole["base_top"].compose(pose.to_transform()).compose(alone)
        assert difference(whole[f"neck_{name}"], expected) < 1e-9


def difference(one: Transform3, other: Transform3) -> float:
    between = one.inverse().compose(other)
    return max(map(abs, (*between.translation, *between.rotation[:3])))


@given(text=st.text(st.characters(min_codepoint=32, max_codepoint=0x2FF), max_size=20))
def test_what_is_written_reads_back(text: str) -> None:
    here = Span("a", 1, 1, 1, 2)
    word = text.strip()
    root = XmlElement("robot", {"name": text}, here, [XmlElement("note", {"a": text}, here, [], word)])
    again = read_urdf(to_xml(root), "a")
    assert isinstance(again, XmlElement)
    assert (again.attributes["name"], again.children[0].attributes["a"], again.children[0].text) == (text, text, word)


def test_an_argument_that_is_wrong_is_told_once_where_it_was_given(tmp_path: Path) -> None:
    robot = f"{HEAD}include:\n  post: {{part: rbx:parts/torso.yaml, with: {{height: 60 kg}}}}\n"
    checked = check(tmp_path, robot)
    assert checked.codes == ["RBX1003"]
    assert "robot.yaml:5:" in checked.text
