"""The section `body`: where its file is, what is refused in it, and what of it the robot runs."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from rbxcompose.base.findings import Finding
from rbxcompose.commands.finding_pages import body_of, kind_of
from rbxcompose.compiler.composition.dump import dump_robot
from rbxcompose.compiler.plan.diff import difference
from rbxcompose.compiler.plan.dump import dump, load
from rbxcompose.domains.body.xml_reader import read_urdf
from rbxcompose.manifest.tree import DEPTH, URDF_BYTES, URDF_ELEMENTS
from rbxcompose.testing.golden import Golden
from rbxcompose.testing.manifests import Checked, check_text

HEAD = "rbx: 1\nkind: Robot\nname: cart\n"
ROBOT = f"{HEAD}body:\n  urdf: cart.urdf\n"
CART = '<?xml version="1.0"?>\n<robot name="cart">\n  <link name="base"/>\n</robot>\n'
OTHER = '<robot name="other"><link name="base"/></robot>'
PART = "rbx: 1\nkind: Part\nname: shell\nbody:\n  urdf: cart.urdf\n"
MISTAKES = {
    "not closed": '<robot name="cart">\n  <link name="base">\n</robot>\n',
    "cut short": '<robot name="cart">\n  <link name="base"/>\n',
    "empty": "\n",
    "no quotes": "<robot name=cart/>\n",
    "doctype": '<?xml version="1.0"?>\n<!DOCTYPE robot [<!ENTITY a "aaaa">]>\n<robot name="&a;"/>\n',
    "another encoding": '<?xml version="1.0" encoding="iso-8859-1"?>\n<robot/>\n',
    "another root": '<sdf version="1.11">\n  <model name="cart"/>\n</sdf>\n',
    "xacro": '<robot name="cart" xmlns:xacro="x">\n  <xacro:include filename="wheel.xacro"/>\n</robot>\n',
    "text behind": '<robot name="cart"/>\nand more\n',
    "twice": '<robot name="cart" name="car"/>\n',
    "an entity": '<robot name="&wheel;"/>\n',
    "a tag without an end": '<robot name="cart"\n',
    "a line before all": '\n<?xml version="1.0"?>\n<robot/>\n',
    "behind letters of two bytes": '<robot name="wägelchen"><link name="größe"></robot>\n',
}
WRONG_SECTIONS = {
    "a path out of the project": "body: {urdf: ../../../../../../etc/passwd}\n",
    "a misspelt path": "body: {urdf: cart.udrf}\n",
    "no path": "body: {}\n",
    "a word": "body: cart.urdf\n",
    "both": "body: {urdf: cart.urdf, xacro: cart.urdf}\n",
    "a package with a name too long for the system": f"body: {{xacro: cart.urdf, packages: {{wheels: {'x' * 300}}}}}\n",
    "a package elsewhere": "body: {xacro: cart.urdf, packages: {wheels: ../../..}}\n",
    "a component of its name": "body: {urdf: cart.urdf}\ncomponents:\n  robot_description: {type: transforms}\n",
}


def mistake_in(text: str, file: str) -> Finding | None:
    read = read_urdf(text, file)
    return read if isinstance(read, Finding) else None


EXAMPLES = re.compile(r"^(Bad|Good):\n```xml\n(.*?)^```", re.MULTILINE | re.DOTALL)


def check(folder: Path, robot: str = ROBOT, **files: str) -> Checked:
    others = {name.replace("_", "."): text for name, text in ({"cart_urdf": CART} | files).items()}
    return check_text(robot, folder, others=others)


def urdf_of(checked: Checked) -> object:
    [instance] = [candidate for candidate in checked.plan.instances if candidate.name == "robot_description"]
    return getattr(instance.config, "urdf")  # noqa: B009 - the type of the configuration is that of a plug-in


def test_the_robot_runs_a_component_that_has_the_text(tmp_path: Path) -> None:
    checked = check(tmp_path)
    assert checked.codes == []
    assert urdf_of(checked) == CART


def test_a_robot_without_a_body_runs_none(tmp_path: Path) -> None:
    for section in ("", "body:\n"):
        checked = check(tmp_path, HEAD + section)
        assert "robot_description" not in {instance.name for instance in checked.plan.instances}


def test_each_mistake_in_a_file_is_told_at_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, golden: Golden
) -> None:
    monkeypatch.chdir(tmp_path)
    told = {name: check(tmp_path, cart_urdf=text).text for name, text in MISTAKES.items()}
    golden.check("urdf.txt", "\n".join(f"--- {name}\n{text}" for name, text in told.items()))


def test_each_mistake_in_the_section_is_told_at_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, golden: Golden
) -> None:
    monkeypatch.chdir(tmp_path)
    told = {name: check(tmp_path, HEAD + text).text for name, text in WRONG_SECTIONS.items()}
    golden.check("body.txt", "\n".join(f"--- {name}\n{text}" for name, text in told.items()))


@pytest.mark.parametrize("number", range(1, 8))
def test_the_page_of_a_kind_shows_the_mistake_and_its_cure(number: int, tmp_path: Path) -> None:
    kind = kind_of(code := f"RBX200{number}")
    assert kind is not None
    shown = dict(EXAMPLES.findall(body_of(kind)))
    robot = ROBOT.replace("urdf: cart.urdf", "xacro: cart.urdf") if code == "RBX2007" else ROBOT
    assert check(tmp_path, robot, cart_urdf=whole(shown["Bad"])).codes == [code]
    assert check(tmp_path, robot, cart_urdf=whole(shown["Good"])).codes == []


def whole(example: str) -> str:
    """Return a robot around an example that is only a part of one, with the links that its joints name."""
    if "<robot" in example:
        return example
    named = set(re.findall(r'(?:parent|child) link="(\w+)"', example)) - set(re.findall(r'<link name="(\w+)"', example))
    links = "".join(f'<link name="{name}"/>' for name in sorted(named - {"bsae"}))
    joints = re.findall(r'<link name="(\w+)"', example)
    tied = (
        ""
        if "<joint" in example or len(set(joints)) < 2 or joints == ["base", "head"]
        else (f'<joint name="tie" type="fixed"><parent link="{joints[0]}"/><child link="{joints[1]}"/></joint>')
    )
    return f'<robot name="cart">{links}{example}{tied}</robot>'


def nested(depth: int) -> str:
    return "<robot>" + "<a>" * (depth - 1) + "</a>" * (depth - 1) + "</robot>"


def wide(count: int) -> str:
    return f"<robot>{'<a/>' * (count - 1)}</robot>"


LIMITS = [(nested, DEPTH, 8 + 3 * (DEPTH - 1)), (wide, URDF_ELEMENTS, 4 + 4 * URDF_ELEMENTS)]


@pytest.mark.parametrize(("text", "most", "column"), [LIMITS[0], pytest.param(*LIMITS[1], marks=pytest.mark.soak)])
def test_the_limits_are_those_that_are_told(text: Callable[[int], str], most: int, column: int) -> None:
    assert mistake_in(text(most), "cart.urdf") is None
    mistake = mistake_in(text(most + 1), "cart.urdf")
    assert mistake
    assert (mistake.code, mistake.span and mistake.span[:3]) == ("RBX1103", ("cart.urdf", 1, column))


def test_a_file_may_be_as_large_as_its_limit_and_no_larger(tmp_path: Path) -> None:
    padding = " " * (URDF_BYTES - len(CART))
    assert check(tmp_path, cart_urdf=CART + padding).codes == []
    larger = check(tmp_path, cart_urdf=CART + padding + " ")
    assert larger.codes == ["RBX1103"]
    assert "robot.yaml:5:9" in larger.text


def test_the_text_may_be_that_of_windows_with_a_mark_at_its_beginning(tmp_path: Path) -> None:
    checked = check(tmp_path, cart_urdf="\ufeff" + CART.replace("\n", "\r\n"))
    assert urdf_of(checked) == CART


def test_the_file_of_a_part_lies_beside_the_part(tmp_path: Path) -> None:
    home = tmp_path / "robots/cart"
    others = {"../../parts/shell.yaml": PART, "../../parts/cart.urdf": CART}
    checked = check_text(f"{HEAD}include:\n  shell: ../../parts/shell.yaml\n", home, others=others)
    assert '<link name="shell_base"/>' in str(urdf_of(checked))
    composed = checked.compilation.robot
    assert composed
    whole = dump_robot(composed.manifest)
    assert "urdf: ../../parts/cart.urdf\n" in whole
    assert urdf_of(check_text(whole, home)) == urdf_of(checked)


def test_a_value_of_the_command_line_is_relative_to_the_robot(tmp_path: Path) -> None:
    files = {"cart.urdf": CART, "other.urdf": OTHER}
    checked = check_text(ROBOT, tmp_path, others=files, sets=["body.urdf=other.urdf"])
    assert urdf_of(checked) == OTHER


def test_a_plan_holds_the_text_as_it_was_checked(tmp_path: Path) -> None:
    plan = check(tmp_path).plan
    (tmp_path / "cart.urdf").write_text("gone")
    assert load(dump(plan)) == plan


def test_another_text_is_a_change_of_the_plan_that_can_be_read(tmp_path: Path) -> None:
    before = check(tmp_path, cart_urdf=CART + "<!--" + "a" * 2000 + "-->").plan
    after = check(tmp_path, cart_urdf=CART + "<!--" + "b" * 2000 + "-->").plan
    changed = difference(before, after).changed
    assert sorted(changed) == ["robot_description", "transforms"]
    for [change] in changed.values():
        assert change.key == "urdf"
        assert change.before != change.after
        assert len(str(change)) < 120


@pytest.mark.parametrize(("present", "code"), [(False, "RBX2012"), (True, "RBX2015")])
def test_a_bad_mesh_is_one_finding_with_all_places_that_name_it(present: bool, code: str, tmp_path: Path) -> None:
    mesh = '<geometry><mesh filename="wheel.stl"/></geometry>'
    shapes = f"\n<visual>{mesh}</visual>\n<collision>{mesh}</collision>\n"
    joint = '<joint name="j" type="fixed"><parent link="base"/><child link="wheel"/></joint>'
    text = (
        f'<robot name="cart">\n<link name="base">{shapes}</link>\n<link name="wheel">{shapes}</link>\n{joint}</robot>'
    )
    if present:
        (tmp_path / "wheel.stl").write_text("no mesh", encoding="utf-8")
    checked = check_text(ROBOT, tmp_path, others={"cart.urdf": text})
    [finding] = [finding for finding in checked.compilation.report if finding.code in ("RBX2012", "RBX2015")]
    assert finding.code == code
    assert finding.span
    assert finding.span.line == 3
    assert [related.span.line for related in finding.related] == [4, 7, 8]


def test_of_very_many_places_of_a_mesh_the_first_are_shown(tmp_path: Path) -> None:
    shapes = '<visual><geometry><mesh filename="bolt.stl"/></geometry></visual>\n' * 12
    checked = check_text(
        ROBOT, tmp_path, others={"cart.urdf": f'<robot name="cart"><link name="l">{shapes}</link></robot>'}
    )
    [finding] = [finding for finding in checked.compilation.report if finding.code == "RBX2012"]
    assert len(finding.related) == 8
    assert finding.related[-1].message == "and here, and 3 more"
