"""`rbxcompose body`: what it shows of the shipped robot, and what it says of wrong input."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from rbxcompose.commands import layout
from rbxcompose.commands.main import main
from rbxcompose.domains.body import meshes as extra
from rbxcompose.domains.body import picture
from rbxcompose.testing.golden import Golden
from tests.conftest import ROOT

ROBOT = str(ROOT / "robots/pi_robot")


def told(capsys: pytest.CaptureFixture[str], *words: str, code: int = 0) -> str:
    assert main(["body", *words]) == code
    out, err = capsys.readouterr()
    return out + err


@pytest.mark.parametrize("action", ["show", "tree"])
def test_a_body_is_shown(
    action: str, capsys: pytest.CaptureFixture[str], golden: Golden, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    golden.check(f"body_{action}.txt", told(capsys, action, ROBOT))


def test_the_expansion_is_a_urdf_without_anything_of_xacro(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    text = told(capsys, "expand", ROBOT)
    assert "xacro:" not in text
    assert 'size="0.0254 0.0254 0.75"' in text  # as the robot's file has it
    told(capsys, "expand", ROBOT, "--set", "include.torso.with.height=90 cm", "--out", str(tmp_path / "r.urdf"))
    assert 'size="0.0254 0.0254 0.9"' in (tmp_path / "r.urdf").read_text()


def test_a_picture_shows_the_body_on_white(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    straight, turned = tmp_path / "a.png", tmp_path / "b.png"
    told(capsys, "picture", ROBOT, "--out", str(straight))
    told(capsys, "picture", ROBOT, "--out", str(turned), "--joint", "head_pan_joint=1.0")
    first, second = (np.asarray(Image.open(io.BytesIO(file.read_bytes()))) for file in (straight, turned))
    assert first.shape == (picture.SIZE, picture.SIZE, 3)
    drawn = (first != 255).any(axis=2)
    assert 0.03 < drawn.mean() < 0.5
    edges = np.concatenate([drawn[0], drawn[-1], drawn[:, 0], drawn[:, -1]])
    assert not edges.any(), "something is out of sight"
    assert (first != second).any()


def test_the_tree_is_drawn_as_a_graph(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    svg = told(capsys, "tree", ROBOT, "--format", "svg")
    assert all(word in svg for word in ("<svg", "head_pan_joint", "revolute, z", "camera_depth_optical_frame"))
    assert "wrote pi_robot.pdf" in told(capsys, "tree", ROBOT, "--format", "pdf")
    assert (tmp_path / "pi_robot.pdf").read_bytes().startswith(b"%PDF-")
    told(capsys, "tree", ROBOT, "--out", "tree.txt")
    assert (tmp_path / "tree.txt").read_text() == told(capsys, "tree", ROBOT)
    monkeypatch.setattr(layout, "find_spec", lambda name: None)
    assert "pip install 'rbxcompose[graph]'" in told(capsys, "tree", ROBOT, "--format", "svg", code=1)


def test_wrong_input_is_told(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "RBX2008" in told(capsys, "show", str(ROOT / "robots/rooms"), code=1)
    assert "no moving joint 'neck': base_l" in told(capsys, "picture", ROBOT, "--joint", "neck=1", code=2)
    assert "not a number with a unit" in told(capsys, "picture", ROBOT, "--joint", "head_pan_joint=up", code=2)
    assert "cannot be written" in told(capsys, "expand", ROBOT, "--out", str(tmp_path / "no/file"), code=2)
    monkeypatch.setattr(extra, "find_spec", lambda name: None)
    assert "RBX9042" in told(capsys, "picture", ROBOT, "--out", str(tmp_path / "c.png"), code=1)


def test_a_mesh_that_cannot_be_read_is_told(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text("rbx: 1\nkind: Robot\nname: r\nbody: {urdf: r.urdf}\n")
    shape = '<visual><geometry><mesh filename="m.stl"/></geometry></visual>'
    (tmp_path / "r.urdf").write_text(f'<robot name="r"><link name="a">{shape}</link></robot>')
    for data in (bytes(range(256)) * 20, b"", b"solid nothing\nendsolid nothing\n"):
        (tmp_path / "m.stl").write_bytes(data)
        assert "the mesh 'm.stl'" in told(capsys, "picture", str(tmp_path), "--out", str(tmp_path / "o.png"), code=2)
