"""Joints and links that the manifest names: those of the body, with the prefix of the part that has them."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.sdk import Component, Config, JointName, LinkName, component
from rbxcompose.testing.golden import Golden
from rbxcompose.testing.manifests import Checked, check_text

HEAD = "rbx: 1\nkind: Robot\nname: cart\n"
NECK = """<robot name="neck">
  <link name="base"/>
  <link name="top"/>
  <joint name="pan" type="continuous">
    <parent link="base"/><child link="top"/><axis xyz="0 0 1"/>
  </joint>
</robot>
"""
PARTS = {
    "neck.urdf": NECK,
    "neck.yaml": (
        "rbx: 1\nkind: Part\nname: neck\nbody: {urdf: neck.urdf}\n"
        "components: {aim: {type: toy_aimer, joint: pan, seen_from: top}}\n"
    ),
    "aim.yaml": (
        "rbx: 1\nkind: Part\nname: aim\nargs: {joint: {type: text}}\n"
        "components: {aim: {type: toy_aimer, joint: '${args.joint}', seen_from: front_top}}\n"
    ),
}
WRONG = {
    "a misspelt joint": "body: {urdf: neck.urdf}\ncomponents: {aim: {type: toy_aimer, joint: pen}}\n",
    "a misspelt link": "body: {urdf: neck.urdf}\ncomponents: {aim: {type: toy_aimer, joint: pan, seen_from: tap}}\n",
    "one of a part": "include: {front: neck.yaml}\ncomponents: {aim: {type: toy_aimer, joint: front_pen}}\n",
    "no body": "components: {aim: {type: toy_aimer, joint: pan}}\n",
}


class AimerConfig(Config):
    """What turns."""

    joint: JointName
    """The joint."""
    seen_from: LinkName = "base"
    """A link."""


@component("toy_aimer")
class Aimer(Component[AimerConfig]):
    """Aims."""


def check(folder: Path, robot: str) -> Checked:
    return check_text(HEAD + robot, folder, others=PARTS)


def config_of(checked: Checked, name: str) -> AimerConfig:
    [found] = [instance.config for instance in checked.plan.instances if instance.name == name]
    assert isinstance(found, AimerConfig)
    return found


def test_names_in_a_part_with_a_body_are_its_own(tmp_path: Path) -> None:
    checked = check(tmp_path, "include: {front: neck.yaml}\n")
    assert config_of(checked, "front_aim") == AimerConfig(joint="front_pan", seen_from="front_top")


def test_other_parts_name_those_of_the_robot(tmp_path: Path) -> None:
    checked = check(tmp_path, "include: {front: neck.yaml, aim: {part: aim.yaml, with: {joint: front_pan}}}\n")
    assert config_of(checked, "aim_aim") == AimerConfig(joint="front_pan", seen_from="front_top")


def test_a_body_with_mistakes_hides_no_names(tmp_path: Path) -> None:
    broken = PARTS | {"neck.urdf": NECK.replace("</robot>", "")}
    robot = f"{HEAD}body: {{urdf: neck.urdf}}\ncomponents: {{aim: {{type: toy_aimer, joint: pan}}}}\n"
    assert check_text(robot, tmp_path, others=broken).codes == ["RBX2001"]


def test_a_name_that_does_not_exist_is_told_with_the_nearest_and_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, golden: Golden
) -> None:
    monkeypatch.chdir(tmp_path)
    told = {name: check(tmp_path, text).text for name, text in WRONG.items()}
    golden.check("named_joints.txt", "\n".join(f"--- {name}\n{text}" for name, text in told.items()))
