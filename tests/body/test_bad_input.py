"""Descriptions made to do harm, or damaged: each ends as a finding at its place, and nothing in it is executed."""

from __future__ import annotations

import math
import re
from pathlib import Path
from unittest.mock import Mock

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rbxcompose.base import processes as fence
from rbxcompose.base.findings import Finding
from rbxcompose.base.printable import FORBIDDEN
from rbxcompose.commands.main import main
from rbxcompose.domains.body.commands.body import tree_of
from rbxcompose.domains.body.files import FORMATS, mesh_problem
from rbxcompose.domains.body.lint import lint
from rbxcompose.domains.body.model import Body
from rbxcompose.domains.body.picture import draw
from rbxcompose.domains.body.urdf import LARGEST, read_body
from rbxcompose.domains.body.xml_reader import read_urdf
from rbxcompose.testing.manifests import check_file, check_text
from tests.body.bad_bodies import ALL, MESHES, PWNED, SECRET, YAML, BadBody, computed, fixed, links, mesh, stl, urdf
from tests.body.described import described
from tests.loops import for_all
from tests.soak import Soak, rare

SLOW = (
    "output without end",
    "a large power",
    "a parameter that takes for ever",
    "macros that double",
    "YAML that doubles",
    "a long sum",
    "a long list",
    "much text",
    "100,000 elements in xacro",
    "a circle of 10,000 joints",
    "10,000 links in a star",
    "10,000 links of their own",
    "10,000 joints without links",
    "10,000 joints that mimic nothing",
    "a text that grows",
    "100,000 elements",
    "a tag of 1 MB",
    "an expansion of 9 MB",
    "a long text",
    "100,000 elements inside each other in xacro",
    "10,000 links in a chain",
)
"""What is stopped after a second, as `messages without end`, or is large and many times the same."""
LIKE_OTHERS = (
    "a subclass in a lambda",
    "a subclass in a list",
    "a file that is written",
    "a folder above",
    "files above",
    "YAML above",
    "YAML that is none",
    "YAML that is a picture",
    "a DOCTYPE in xacro",
    "an entity bomb in xacro",
    "a bare macro of itself",
    "a lambda of itself",
    "a property of itself",
    "a file of itself",
    "the frame of a generator",
    "a format",
)
"""Each takes a process, and is refused by what refuses another one."""
LIKE_MISTAKES = ("Python", "the environment", "a file of the system", "YAML elsewhere")
"""Those that `test_xacro` has."""
RARE = (*SLOW, *LIKE_OTHERS, *LIKE_MISTAKES)


@pytest.mark.parametrize("name", [*(name for name in ALL if name not in RARE), *rare(*RARE)])
def test_a_bad_description_is_a_finding_at_its_place_and_executes_nothing(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, soak: Soak
) -> None:
    case, file = ALL[name], ALL[name].write(tmp_path)
    monkeypatch.chdir(file.parent)
    before = sorted(tmp_path.rglob("*"))
    checked = check_file(Path("robot.yaml"))
    told = [finding for finding in checked.compilation.report if finding.code == case.code]
    assert told, checked.text
    assert {finding.span.file for finding in told if finding.span} <= {"bad.xml", "robot.yaml"}
    assert all(finding.span and (finding.span.file == "bad.xml" or not case.is_placed) for finding in told), (
        checked.text
    )
    assert not re.search(FORBIDDEN, checked.text.replace("\n", ""))
    assert SECRET not in checked.text
    assert sorted(tmp_path.rglob("*")) == before
    assert not Path(PWNED).exists()
    soak.tell("hostile descriptions of bodies", len(ALL), 0, "all refused at their place; nothing was executed")


def test_a_mesh_in_other_capitals_is_told_if_it_is_in_the_project(tmp_path: Path) -> None:
    text = "rbx: 1\nkind: Robot\nname: r\nbody: {urdf: r.urdf}\n"
    for name in ("meshes/Arm.STL", "../meshes/Arm.STL"):
        home = tmp_path / "project"
        for folder in (home, tmp_path):
            (folder / "meshes").mkdir(parents=True, exist_ok=True)
            (folder / "meshes" / "arm.stl").write_bytes(b"")
        (home / ".git").mkdir(exist_ok=True)
        shape = f'<visual><geometry><mesh filename="{name}"/></geometry></visual>'
        (home / "r.urdf").write_text(f'<robot name="r"><link name="l">{shape}</link></robot>', encoding="utf-8")
        checked = check_text(text, home)
        assert ("did you mean 'meshes/arm.stl'?" in checked.text) is name.startswith("meshes")
        assert "arm.stl'" not in checked.text or name.startswith("meshes")


def test_values_may_come_from_a_yaml_file_of_the_project(tmp_path: Path) -> None:
    case = computed("xacro.load_yaml('a.yaml')['names'][1]", {"a.yaml": b"names: [left, right]\n"})
    robot = check_file(case.write(tmp_path)).compilation.robot
    assert robot
    assert list(described(robot.manifest).body.links) == ["right"]
    assert YAML


@for_all("name", MESHES)
def test_a_picture_with_a_bad_mesh_is_refused(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(MESHES[name].write(tmp_path).parent)
    assert main(["body", "picture", "robot.yaml"]) == 2
    assert re.search(r"rbxcompose body: the mesh '\w+\.\w+' (is|has) ", capsys.readouterr().err)
    assert not Path("bad.png").exists()


def body_of(case: BadBody) -> Body:
    root = read_urdf(case.text, "bad.xml")
    assert not isinstance(root, Finding)
    body, findings = read_body(root)
    assert findings == []
    return body


@pytest.mark.parametrize("parent", [lambda n: n - 1, *rare(lambda n: 0)], ids=["chain", "star"])
def test_10_000_links_are_no_mistake(parent: Mock) -> None:
    body = body_of(urdf(links(10_000) + "".join(fixed(parent(n), n) for n in range(1, 10_000))))
    assert len(body.poses({})) == len(list(tree_of(body))) == 10_000
    assert list(lint(body, ())) == []


@pytest.mark.parametrize("number", ["1e30", f"{LARGEST:g}"])
@pytest.mark.parametrize("attributes", ['scale="{} 1 1"', "", 'scale="1 1 -{}"'])
def test_a_picture_of_what_is_endless_is_refused(number: str, attributes: str, tmp_path: Path) -> None:
    (tmp_path / "m.stl").write_bytes(stl(1))
    text = mesh("m.stl", b"", attributes.format(number)).text
    body = body_of(BadBody("", text.replace("<geometry>", f'<origin xyz="0 {number} 0"/><geometry>')))
    with pytest.raises(ValueError, match="further than 1e\\+06 m away"):
        draw(body, {}, {"m.stl": tmp_path / "m.stl"})


@pytest.mark.parametrize("name", ["M.STL", *rare("m.stl")])
def test_a_mesh_that_is_one_is_drawn(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rbxcompose.domains.body.picture.SIZE", 100)
    (tmp_path / name).write_bytes(stl(2))
    assert mesh_problem(tmp_path / name) == ""
    assert draw(body_of(mesh(name, b"")), {}, {name: tmp_path / name}).startswith(b"\x89PNG")


GOOD = {
    "m.stl": (stl(1), b"solid m\n facet normal 0 0 1\n", stl(3) + b"a comment of the exporter"),
    "m.dae": (b'\xef\xbb\xbf<?xml version="1.0"?>\n<!-- of Blender -->\n<COLLADA xmlns="a">',),
    "m.obj": (b"# made by hand\nv 0 0 0\nv 1 0 0\n", "# größe\nv 0 0 0\n".encode()),
    "m.ply": (b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nelement face 0\nend_header\n1.0\n",),
    "m.glb": (b"glTF\x02\x00\x00\x00",),
    "m.mesh": (b"\x00\x10[MeshSerializer_v1.41]",),  # of another viewer: we do not know the format
}


@pytest.mark.parametrize("name", GOOD)
def test_what_may_be_a_mesh_is_not_told(name: str, tmp_path: Path) -> None:
    for data in GOOD[name]:
        (tmp_path / name).write_bytes(data)
        assert mesh_problem(tmp_path / name) == ""


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.binary(max_size=300), begin=st.sampled_from([b"", stl(2), b"solid facet", b"ply", b"glTF"]),
       ending=st.sampled_from(FORMATS))  # fmt: skip
def test_bytes_are_drawn_or_refused(data: bytes, begin: bytes, ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"m{ending}"
    path.write_bytes(begin + data)
    refused = ""
    try:
        draw(body_of(mesh(path.name, b"")), {}, {path.name: path})
    except ValueError as error:
        refused = str(error)
    assert not refused or refused.startswith((f"the mesh '{path.name}' ", "a part of the body is further "))


WHOLE = (
    '<robot name="r"><material name="m"><color rgba="1 0 0 1"/></material><link name="a"><inertial><mass value="1"/>'
    '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial><visual><geometry><box size="1 1 1"/>'
    '</geometry><material name="m"/></visual></link><link name="b"><collision><origin xyz="0 0 1" rpy="0 0 1"/>'
    '<geometry><mesh filename="m.stl" scale="1 1 1"/></geometry></collision></link><joint name="j" type="revolute">'
    '<parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/>'
    '<mimic joint="k"/></joint><link name="c"/><joint name="k" type="prismatic"><parent link="b"/><child link="c"/>'
    '<axis xyz="1 0 0"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint></robot>'
)
WORDS = re.findall(r"[\w.-]+|\W", WHOLE)
ODD = [
    "",
    "nan",
    "-inf",
    "1e308",
    "-1e308",
    "1e-320",
    f"{LARGEST:g}",
    "0x1",
    "\u0661",
    "1_0",
    "a",
    "b",
    "j",
    "<",
    '"',
    "&",
    "ü",
]


@given(changes=st.lists(st.tuples(st.integers(0, len(WORDS) - 1), st.sampled_from([*ODD, *WORDS])), max_size=4))
def test_a_damaged_urdf_is_a_body_of_finite_numbers_or_a_finding_with_its_place(changes: list[tuple[int, str]]) -> None:
    words = list(WORDS)
    for at, word in changes:
        words[at] = word
    root = read_urdf("".join(words), "bad.xml")
    if isinstance(root, Finding):
        assert root.span
        return
    body, findings = read_body(root)
    assert all(finding.span and finding.span.file == "bad.xml" for finding in findings)
    if not findings and body.links:
        assert all(finding.span for finding in lint(body, ()))
        numbers = [value for pose in body.poses({}).values() for value in (*pose.translation, *pose.rotation)]
        assert all(map(math.isfinite, numbers))


def test_a_file_may_not_open_what_lies_outside_nor_write(tmp_path: Path) -> None:
    inside, beside = tmp_path / "project", tmp_path / "project of others"
    assert fence.is_below(str(inside / "a"), [str(inside)])
    assert fence.is_below(str(inside), [str(inside)])
    assert not fence.is_below(str(beside), [str(inside)])
    assert not fence.is_below(str(tmp_path), [str(inside)])
