"""`rbxcompose body` on a URDF or xacro file that no robot names."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.commands.main import main
from rbxcompose.domains.body.commands import body
from tests.conftest import ROOT

XACRO = str(ROOT / "parts/body/torso.urdf.xacro")
LINK = '<robot name="{name}"><link name="a"><visual><geometry>{shape}</geometry></visual></link></robot>'
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def told(capsys: pytest.CaptureFixture[str], *words: str, code: int = 0) -> str:
    assert main(["body", *words]) == code
    out, err = capsys.readouterr()
    return out + err


def urdf(file: Path, mesh: str, name: str = "r") -> str:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(LINK.format(name=name, shape=f'<mesh filename="{mesh}"/>'))
    return str(file)


def test_a_file_is_shown_as_the_robot_that_names_it(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(
        "rbx: 1\nkind: Robot\nname: post\nbody:\n  xacro: rbx:parts/body/torso.urdf.xacro\n  with: {height: 60 cm}\n"
    )
    for action in ("show", "tree"):
        assert told(capsys, action, XACRO, "--with", "height=0.6") == told(capsys, action, str(tmp_path))


@pytest.mark.parametrize(("written", "read"), [("90 cm", "0.9"), ("1.50", "1.5")])
def test_arguments_reach_the_xacro_in_si_units(capsys: pytest.CaptureFixture[str], written: str, read: str) -> None:
    text = told(capsys, "expand", XACRO, "--with", f"height={written}")
    assert f'size="0.0254 0.0254 {read}"' in text


def test_packages_are_found_where_they_are_said_to_be(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file, package = urdf(tmp_path / "a/r.urdf", "package://cart/m.obj"), tmp_path / "b"
    package.mkdir()
    (package / "m.obj").write_text(TETRAHEDRON)
    assert "RBX2012" in told(capsys, "show", file, code=1)
    assert "1 link," in told(capsys, "show", file, "--package", f"cart={package}")
    assert "is not a folder" in told(capsys, "show", file, "--package", f"cart={package}/m.obj", code=2)


def test_a_file_outside_any_project_sees_its_own_folder_only(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "m.obj").write_text(TETRAHEDRON)
    for mesh in ("../m.obj", f"file://{tmp_path}/m.obj"):
        assert f"the mesh '{mesh}' is outside the project" in told(
            capsys, "show", urdf(tmp_path / "a/r.urdf", mesh), code=1
        )
    outside = f'<robot xmlns:xacro="http://x"><xacro:include filename="{tmp_path}/s.xacro"/></robot>'
    (tmp_path / "s.xacro").write_text('<robot><link name="stolen"/></robot>')
    (tmp_path / "a/r.xacro").write_text(outside)
    assert "stolen" not in told(capsys, "tree", str(tmp_path / "a/r.xacro"), code=1)
    assert "stolen" in told(capsys, "tree", str(tmp_path / "a/r.xacro"), "--package", f"all={tmp_path}")


def test_mistakes_are_told_at_their_line(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "r.urdf").write_text('<robot name="r">\n  <link/>\n</robot>\n')
    assert "r.urdf:2:" in told(capsys, "show", str(tmp_path / "r.urdf"), code=1)
    assert "RBX1301" in told(capsys, "show", str(tmp_path / "none.urdf"), code=1)
    (tmp_path / "r.urdf").write_text('<robot name="r"/>\n')
    assert "RBX2006" in told(capsys, "show", str(tmp_path / "r.urdf"), code=1)


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["robots/box_robot", "--with", "torso_height=1"], "--with is for .urdf and .xacro files"),
        (["robots/box_robot", "--package", "a=."], "--package is for .urdf and .xacro files"),
        ([XACRO, "--set", "name=x"], "--set is for robots"),
        ([XACRO, "--real"], "--real is for robots"),
        (["robot.urdf", "--with", "a=1"], "a URDF has no arguments"),
        ([XACRO, "--with", "torso_height"], "--with needs NAME=VALUE"),
    ],
)
def test_options_of_the_other_kind_of_file_are_refused(
    words: list[str], why: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    assert why in told(capsys, "show", *words, code=2)


def test_a_picture_without_a_name_stays_in_this_folder(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(body, "draw", lambda *shown: b"what is drawn")
    (tmp_path / "m.obj").write_text(TETRAHEDRON)
    assert "wrote ___r_png.png" in told(capsys, "picture", urdf(tmp_path / "r.urdf", "m.obj", name="../r.png"))
