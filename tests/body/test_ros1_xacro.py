"""xacro files of ROS 1, whose tags have no prefix: they load, each file is told once, and the fix writes the prefix."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rbxcompose.base.findings import KINDS, Finding, Span, apply_fixes
from rbxcompose.commands.finding_pages import body_of
from rbxcompose.domains.body.xacro import Expanded
from rbxcompose.manifest.files import library_root, shown_name
from rbxcompose.testing.manifests import Checked, check_file, check_text
from rbxcompose.tools.commands.check import fix
from tests.body.described import described, expand
from tests.soak import Soak, rare

ROBOT = "rbx: 1\nkind: Robot\nname: cart\nbody:\n  xacro: cart.xacro\n"
BOUND = '<robot name="cart" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
CART = """<?xml version="1.0"?>
<robot name="cart">
  <arg name="side" default="left"/>
  <include filename="wheel.xacro"/>
  <property name="height" value="${2 * 0.1}"/>
  <link name="base"/>
  <if value="${height > 0.1}"><wheel side="$(arg side)"><origin xyz="0 0 ${height}"/></wheel></if>
  <unless value="true"><wheel side="none"><origin xyz="0 0 0"/></wheel></unless>
  <gazebo reference="base"><include filename="a"/><wheel/><property name="a" value="${height}"/></gazebo>
</robot>
"""
WHEEL = """<robot>
  <macro name="wheel" params="side *origin">
    <joint name="${side}_joint" type="fixed">
      <insert_block name="origin"/><parent link="base"/><child link="${side}"/>
    </joint>
    <link name="${side}"><mass_of kilograms="2"></mass_of></link>
  </macro>
  <macro name="mass_of" params="kilograms"><inertial>
    <mass value="${kilograms}"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>
  </inertial></macro>
</robot>
"""
SPAN = Span("robot.yaml", 5, 10, 5, 20)


def write(folder: Path, **files: str) -> None:
    for name, text in files.items():
        (folder / f"{name}.xacro").write_text(text)


def urdf_of(checked: Checked) -> str:
    robot = checked.compilation.robot
    assert robot
    return described(robot.manifest).text


def fixed(folder: Path) -> list[str]:
    """Do what `check --fix` does and return what it says."""
    said: list[str] = []
    fix(lambda: check_file(folder / "robot.yaml").compilation, said.append)
    return said


def check(folder: Path, **files: str) -> Checked:
    write(folder, **files)
    return check_text(ROBOT, folder)


def notes(checked: Checked) -> list[tuple[str, int, int, str]]:
    found = [(finding.span, finding.message) for finding in checked.compilation.report if finding.code == "RBX2014"]
    return [(Path(span.file).name, span.line, span.column, message) for span, message in found if span]


def test_bare_tags_are_read_as_they_were_meant_and_told_once_for_each_file(tmp_path: Path) -> None:
    checked = check(tmp_path, cart=CART, wheel=WHEEL)
    assert notes(checked) == [
        ("cart.xacro", 3, 3, "'<arg>' lacks the prefix 'xacro:', like 6 other tags of this file"),
        ("wheel.xacro", 2, 3, "'<macro>' lacks the prefix 'xacro:', like 3 other tags of this file"),
    ]
    assert set(checked.codes) == {"RBX2014"}
    assert checked.compilation.robot
    body = described(checked.compilation.robot.manifest)
    assert list(body.body.links) == ["base", "left"]
    assert body.body.joints["left_joint"].origin.translation == (0.0, 0.0, 0.2)
    assert body.body.links["left"].inertial
    assert '<include filename="a"/><wheel/><property name="a" value="0.2"/>' in body.text


def test_the_fix_writes_the_prefixes_and_the_expansion_stays_the_same(tmp_path: Path) -> None:
    before = urdf_of(check(tmp_path, cart=CART, wheel=WHEEL))
    assert len(fixed(tmp_path)) == 2
    after = check_file(tmp_path / "robot.yaml")
    assert (after.codes, urdf_of(after)) == ([], before)
    assert fixed(tmp_path) == []
    assert (tmp_path / "cart.xacro").read_text() == (
        CART.replace("<robot name=", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name=')
        .replace("<arg", "<xacro:arg")
        .replace('<include filename="wheel', '<xacro:include filename="wheel')
        .replace("  <property", "  <xacro:property")
        .replace("<if", "<xacro:if")
        .replace("</if", "</xacro:if")
        .replace("unless", "xacro:unless")
        .replace("wheel side", "xacro:wheel side")
        .replace("</wheel", "</xacro:wheel")
    )


def test_the_text_may_be_that_of_windows_with_a_mark_and_long_letters_before_a_tag(tmp_path: Path) -> None:
    text = "\ufeff" + BOUND + '<!-- größe --><property name="a" value="größe"/><link name="${a}"/>\n</robot>'
    (tmp_path / "cart.xacro").write_bytes(text.replace("\n", "\r\n").encode())
    before = urdf_of(check_text(ROBOT, tmp_path))
    fixed(tmp_path)
    assert urdf_of(check_text(ROBOT, tmp_path)) == before
    expected = text.replace("<property", "<xacro:property").replace("\n", "\r\n")
    assert (tmp_path / "cart.xacro").read_bytes() == expected.encode()


URDF = (
    '<link name="base"><origin xyz="0 0 0"/><wheel/></link><transmission name="t"><arm/></transmission>'
    '<gazebo><sensor name="s"><camera name="c"/></sensor></gazebo><odd><camera/></odd>'
)


@pytest.mark.parametrize("name", ["link", *rare("sensor", "arm", "origin", "camera", "gazebo")])
def test_plain_urdf_is_never_taken_for_a_call(name: str, tmp_path: Path) -> None:
    macro = f'<xacro:macro name="{name}"><link name="wrong"/></xacro:macro>'
    checked = check(tmp_path, cart=f"{BOUND}{macro}{URDF}</robot>")
    assert checked.codes == []
    assert "wrong" not in urdf_of(checked)
    assert URDF in urdf_of(checked).replace("\n", "")


def test_a_call_is_known_if_its_macro_is_included_later_than_its_file_was_read(tmp_path: Path) -> None:
    cart = '<robot name="cart"><include filename="${\'wheel\'}.xacro"/><link name="base"/><one/><two/></robot>'
    wheel = '<robot><macro name="one"><two/></macro><macro name="two"><xacro_like/></macro></robot>'
    checked = check(tmp_path, cart=cart, wheel=wheel)
    assert [(name, message.partition(", ")[2]) for name, _, _, message in notes(checked)] == [
        ("cart.xacro", "like 2 other tags of this file"),
        ("wheel.xacro", "like 2 other tags of this file"),
    ]


def test_files_of_the_library_are_read_like_that_but_not_fixed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path, cart='<robot name="cart"><property name="a" value="b"/><link name="${a}"/></robot>')
    monkeypatch.setattr("rbxcompose.domains.body.xacro.library_root", lambda: tmp_path)
    found, _ = expand(tmp_path / "cart.xacro", {}, {}, [tmp_path, library_root()], SPAN)
    assert isinstance(found, Expanded)
    assert [(note.code, note.fix) for note in found.notes] == [("RBX2014", None)]


def test_the_page_shows_the_mistake_and_its_cure(tmp_path: Path) -> None:
    examples = dict(re.findall(r"^(Bad|Good):\n```xml\n(.*?)^```", body_of(KINDS["RBX2014"]), re.MULTILINE | re.DOTALL))
    bad = check(tmp_path, cart=examples["Bad"])
    good = check(tmp_path, cart=examples["Good"])
    assert (bad.codes, good.codes) == (["RBX2014"], [])
    assert urdf_of(bad) == urdf_of(good)


def tag(name: str, attributes: str, inside: str, is_bare: bool) -> str:
    shown = f"[{name}]" if is_bare else f"xacro:{name}"
    return f"<{shown} {attributes}>{inside}</{shown}>" if inside else f"<{shown} {attributes}/>"


@st.composite
def marked(draw: st.DrawFn, depth: int = 0) -> str:
    """Return the inside of a robot; `[name]` are names of tags whose prefix may be missing."""
    parts = []
    for number in range(draw(st.integers(1, 3))):
        inside = draw(marked(depth + 1)) if depth < 2 else " "
        is_bare = draw(st.booleans())
        name = f"m{depth}{number}"
        parts.append(draw(st.sampled_from([
            tag("property", f'name="p{number}" value="1"', "", is_bare),
            tag("if", f'value="{draw(st.integers(0, 1))}"', inside, is_bare),
            tag("macro", f'name="{name}" params="a"', inside, is_bare)
            + tag(name, 'a="1"', draw(st.sampled_from(["", " "])), draw(st.booleans())),
            f'<link name="l{number}">{inside}</link>',
            f"<!-- <macro/> -->\n<gazebo><property name='a'/>{'<m00/>' * number}</gazebo>",
        ])))  # fmt: skip
    return "\n ".join(parts)


@settings(max_examples=settings().max_examples * 2 // 5, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(inside=marked())
def test_the_fix_of_any_file_gives_back_the_prefixes_that_it_lost(inside: str, tmp_path: Path) -> None:
    whole = f"{BOUND}{inside}</robot>\n"
    modern, old = re.sub(r"\[(\w+)\]", r"xacro:\1", whole), re.sub(r"\[(\w+)\]", r"\1", whole)
    write(tmp_path, modern=modern, cart=old)
    found, _ = expand(tmp_path / "modern.xacro", {}, {}, [tmp_path], SPAN)
    read, _ = expand(tmp_path / "cart.xacro", {}, {}, [tmp_path], SPAN)
    assert isinstance(found, Expanded)
    assert isinstance(read, Expanded)
    assert read.text.replace("cart.xacro", "modern.xacro").split() == found.text.split()
    assert len(read.notes) == ("[" in whole)
    file = shown_name(tmp_path / "cart.xacro")
    assert apply_fixes([note.fix for note in read.notes if note.fix], {file: old}).texts[file] == modern


def test_a_pattern_includes_the_files_that_fit_it_in_their_order(tmp_path: Path) -> None:
    folder = tmp_path / "a [1]"  # not a pattern, though it looks like one
    (folder / "parts").mkdir(parents=True)
    for name in "ba":
        (folder / f"parts/{name}.xacro").write_text(f'<robot><link name="{name}"/></robot>')
    write(folder, cart=f'{BOUND}<xacro:include filename="parts/*.xacro"/></robot>')
    found, files = expand(folder / "cart.xacro", {}, {}, [folder], SPAN)
    assert isinstance(found, Expanded)
    assert re.findall('link name="(.)"', found.text) == ["a", "b"]
    assert [file.name for file in files] == ["cart.xacro", "a.xacro", "b.xacro"]


@pytest.mark.parametrize("pattern", ["../*.xacro", *rare("none/*.xacro", "/etc/pass*", "/*/*")])
def test_a_pattern_that_no_file_of_the_project_fits_is_told(pattern: str, tmp_path: Path) -> None:
    folder = tmp_path / "project"
    folder.mkdir()
    (tmp_path / "outside.xacro").write_text("<robot/>")
    write(folder, cart=f'{BOUND}<xacro:include filename="{pattern}"/></robot>')
    found, _ = expand(folder / "cart.xacro", {}, {}, [folder], SPAN)
    assert isinstance(found, Finding)
    assert f"no file of the project fits '{pattern}'" in found.message
    assert found.span
    assert found.span.line == 2


def test_what_is_optional_may_be_missing(tmp_path: Path) -> None:
    includes = "".join(f'<xacro:include filename="{name}" optional="true"/>' for name in ("a.xacro", "a/*.xacro"))
    write(tmp_path, cart=f'{BOUND}{includes}<link name="base"/></robot>')
    found, _ = expand(tmp_path / "cart.xacro", {}, {}, [tmp_path], SPAN)
    assert isinstance(found, Expanded), found


FOLDER = "RBXCOMPOSE_ROS1_PACKAGE"
"""The variable of the environment that names the folder of a ROS 1 package whose xacro files are tried."""


@pytest.mark.timeout(0)
def test_the_robots_of_a_ros_1_package_load_or_name_what_is_missing(soak: Soak) -> None:
    if FOLDER not in os.environ:
        pytest.skip(f"{FOLDER} names no package: a folder with xacro files of ROS 1, which are not part of this one")
    package = Path(os.environ[FOLDER]).resolve()
    files = [path for path in sorted(package.rglob("*.xacro")) if not path.name.endswith(".urdf.xacro")]
    loaded, missing = 0, 0
    for file in files:
        found, _ = expand(file, {}, {package.name: package}, [package], SPAN)
        if isinstance(found, Finding):
            assert "cannot be read: No such file or directory" in found.message, found
            assert found.span != SPAN
            missing += 1
        loaded += isinstance(found, Expanded)
    soak.tell("xacro files of ROS 1", len(files), 0, f"{loaded} load, {missing} include files that do not exist")
    assert loaded + missing == len(files) > 0
