"""The body of the robot for browsers."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.domains.console.models import served


def urdf(*names: str) -> str:
    return "".join(f'<visual><geometry><mesh filename="{name}" scale="1 1 1"/></geometry></visual>' for name in names)


def test_meshes_have_addresses_by_number_and_only_those_that_are_named(tmp_path: Path) -> None:
    face, arm = tmp_path / "my face.stl", tmp_path / "arm.dae"
    for path in (face, arm):
        path.write_text("solid")
    model = served(urdf(f"file://{tmp_path}/my%20face.stl", str(arm), f"file://{tmp_path}/my%20face.stl"))
    assert model.urdf == urdf("meshes/0/my%20face.stl", "meshes/1/arm.dae", "meshes/0/my%20face.stl")
    assert model.file(0) == (face, "model/stl")
    assert model.file(1) == (arm, "model/vnd.collada+xml")
    assert model.file(2) is None
    assert model.file(-1) is None


@pytest.mark.parametrize("name", ["/etc/passwd", "/nothing/here.stl", "", "/dev/zero.stl"])
def test_what_is_no_mesh_is_not_served(name: str) -> None:
    assert served(urdf(name)).file(0) is None


@given(st.text())
def test_any_text_is_served(text: str) -> None:
    model = served(text)
    assert len(model.files) <= text.count("mesh")
