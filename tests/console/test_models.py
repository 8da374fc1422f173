"""What viewers get of a robot's body, and what they cannot get."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbxcompose.domains.console.models import MESHES, CandidateModels, ServedModel

URDF = """<robot name="cart">
  <link name="base"><visual><geometry><mesh filename="meshes/base.STL"/></geometry></visual></link>
  <link name="lost"><visual><geometry><mesh filename="package://cart/lost.dae"/></geometry></visual></link>
</robot>"""


@pytest.fixture
def mesh(tmp_path: Path) -> Path:
    path = tmp_path / "base.STL"
    path.write_bytes(b"solid base")
    (tmp_path / "secret").write_text("secret")
    return path


@pytest.fixture
def model(mesh: Path) -> ServedModel:
    return ServedModel(URDF, {"meshes/base.STL": str(mesh)})


def test_the_urdf_has_addresses_that_the_console_serves(model: ServedModel) -> None:
    assert model.urdf is not None
    text = model.urdf.content.decode()
    assert f'"{MESHES}0/base.STL"' in text
    assert f'"{MESHES}1/lost.dae"' in text
    assert "package://" not in text
    assert model.urdf.kind == "application/xml"


def test_a_mesh_comes_with_its_type_and_another_tag_when_it_has_changed(model: ServedModel, mesh: Path) -> None:
    before = model.mesh("0/base.STL")
    assert before is not None
    assert (before.content, before.kind) == (b"solid base", "model/stl")
    mesh.write_bytes(b"solid other")
    after = model.mesh("0/base.STL")
    assert after is not None
    assert after.tag != before.tag


@pytest.mark.parametrize(
    "address",
    [
        "",
        ".",
        "secret",
        "base.STL",
        "../secret",
        "0/base.STL/../secret",
        "/etc/passwd",
        "%2e%2e/secret",
        "0/base.STL\0",
    ],
)
def test_nothing_but_the_meshes_of_the_urdf_is_served(model: ServedModel, address: str) -> None:
    assert model.mesh(address) is None


def test_a_mesh_that_was_never_there_or_is_gone_is_not_served(model: ServedModel, mesh: Path) -> None:
    assert model.mesh("1/lost.dae") is None
    mesh.unlink()
    assert model.mesh("0/base.STL") is None
    mesh.symlink_to(mesh.parent / "secret")
    assert model.mesh("0/base.STL") is None


def test_a_robot_without_a_body_has_no_urdf() -> None:
    assert ServedModel("", {}).urdf is None


def test_bodies_that_nobody_has_saved_have_addresses_of_their_own(mesh: Path) -> None:
    models = CandidateModels()
    text = models.add(URDF, {"meshes/base.STL": str(mesh)})
    address = text.partition(f'"{MESHES}')[2].partition('"')[0]
    found = models.mesh(address)
    assert found is not None
    assert found.content == b"solid base"
    assert models.add(URDF, {"meshes/base.STL": str(mesh)}) == text
    for wrong in ("0/base.STL", "candidates/", "candidates/x/0/base.STL", address.replace("base.STL", "../secret")):
        assert models.mesh(wrong) is None
    for number in range(20):
        models.add(URDF.replace("cart", f"cart_{number}"), {"meshes/base.STL": str(mesh)})
    assert models.mesh(address) is None
    assert models.add("", {}) == ""
