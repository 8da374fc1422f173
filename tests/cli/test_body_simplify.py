"""`rbxcompose body simplify`: what it writes, what it tells, and what it does not replace."""

from __future__ import annotations

from pathlib import Path

import pytest
import trimesh

from rbxcompose.commands.main import main
from rbxcompose.domains.body import meshes as extra
from rbxcompose.domains.body.commands.body import counted
from rbxcompose.domains.body.meshes import SimplifiedMesh
from rbxcompose.testing.golden import Golden

LINK = '<link name="a"><visual><geometry><mesh filename="{0}" scale="0.001 0.001 0.001"/></geometry></visual></link>'
MESHES = ("meshes/ball.stl", "meshes/box.stl")


def told(capsys: pytest.CaptureFixture[str], *words: str, code: int = 0) -> str:
    assert main(["body", "simplify", *words]) == code
    out, err = capsys.readouterr()
    return out + err


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "meshes").mkdir()
    trimesh.creation.icosphere(subdivisions=3, radius=100.0).export("meshes/ball.stl")
    trimesh.creation.box(extents=(100.0, 100.0, 100.0)).export("meshes/box.stl")
    links = "".join(LINK.format(mesh).replace('"a"', f'"l{number}"') for number, mesh in enumerate(MESHES))
    joint = '<joint name="j" type="fixed"><parent link="l0"/><child link="l1"/></joint>'
    (tmp_path / "r.urdf").write_text(f'<robot name="r">{links}{joint}</robot>')
    return tmp_path


def test_all_meshes_of_a_body_are_written_and_told(
    capsys: pytest.CaptureFixture[str], golden: Golden, home: Path
) -> None:
    golden.check("body_simplify.txt", told(capsys, "r.urdf", "--faces", "100", "--out", "simple"))
    assert {path.name for path in (home / "simple").iterdir()} == {"ball.stl", "box.stl"}
    assert len(trimesh.load_mesh(home / "simple/ball.stl").faces) == 100


def test_one_mesh_is_chosen_by_its_name(capsys: pytest.CaptureFixture[str], home: Path) -> None:
    told(capsys, "r.urdf", "--mesh", "box.stl", "--out", "a")
    told(capsys, "r.urdf", "--mesh", MESHES[1], "--out", "b")
    assert [path.name for folder in "ab" for path in (home / folder).iterdir()] == ["box.stl"] * 2
    shown = told(capsys, "r.urdf", "--mesh", "meshes/bal.stl", "--out", "c", code=1)
    assert "RBX2018" in shown
    assert "did you mean 'meshes/ball.stl'?" in shown


@pytest.mark.soak  # as below, where one is replaced
def test_a_mesh_needs_no_body(capsys: pytest.CaptureFixture[str], home: Path) -> None:
    assert "1280 -> 128 " in told(capsys, "meshes/ball.stl", "--ratio", "0.1", "--out", "simple")
    assert (home / "simple/ball.stl").stat().st_size == 84 + 50 * 128


@pytest.mark.parametrize(
    ("left", "wanted", "words"), [(20, 20, "100 -> 20"), (60, 20, "100 -> 60, not 20"), (100, 200, "100, copied")]
)
def test_a_mesh_that_keeps_more_than_wanted_is_told(left: int, wanted: int, words: str) -> None:
    assert counted(SimplifiedMesh(b"", (100, left), (0, 0), 0.0, 0.0, wanted)) == words


def test_no_file_is_replaced_unless_that_is_wanted(capsys: pytest.CaptureFixture[str], home: Path) -> None:
    before = (home / MESHES[0]).read_bytes()
    for path in ("r.urdf", MESHES[0]):
        assert "error[RBX2017]: there already is 'meshes/ball.stl'" in told(capsys, path, "--out", "meshes", code=1)
    assert (home / MESHES[0]).read_bytes() == before
    told(capsys, MESHES[0], "--out", "meshes", "--force")
    assert len((home / MESHES[0]).read_bytes()) < len(before)


@pytest.mark.parametrize("words", [["--ratio", "0"], ["--ratio", "1.1"], ["--ratio", "nan"], ["--faces", "3"]])
def test_what_makes_no_sense_is_wrong_usage(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        told(capsys, "r.urdf", "--out", "simple", *words)
    assert end.value.code == 2
    assert "must be" in capsys.readouterr().err


def test_one_mesh_that_cannot_be_read_leaves_nothing_behind(capsys: pytest.CaptureFixture[str], home: Path) -> None:
    (home / MESHES[1]).write_bytes(b"solid\n")
    assert "the mesh 'meshes/box.stl'" in told(capsys, "r.urdf", "--out", "simple", code=2)
    assert not (home / "simple").exists()
    assert "RBX1301" in told(capsys, "none.stl", "--out", "simple", code=1)
    assert "--real is for bodies" in told(capsys, MESHES[0], "--real", "--out", "simple", code=2)
    (home / "r.urdf").write_text('<robot name="r"><link name="a"/></robot>')
    assert "no meshes" in told(capsys, "r.urdf", "--out", "simple", code=2)


def test_a_missing_library_is_told(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extra, "find_spec", lambda name: None)
    shown = told(capsys, "r.urdf", "--out", "simple", code=1)
    assert "RBX9042" in shown
    assert "pip install 'rbxcompose[picture]'" in shown
