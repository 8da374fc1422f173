"""Simplified meshes: how many triangles are left, and how far the original surface is from them."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.domains.body.commands.body import file_names
from rbxcompose.domains.body.meshes import SimplifiedMesh, distance, faces_for, nearest, scaled, simplify
from tests.soak import rare

ONE = (1.0, 1.0, 1.0)


def sphere(radius: float = 1.0, finer: int = 2) -> Any:
    return trimesh.creation.icosphere(subdivisions=finer, radius=radius)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("mesh") / "ball.stl"
    sphere().export(path)
    return path


@cache
def simplified(file: Path, ratio: float, scale: float = 1.0) -> SimplifiedMesh:
    return simplify(file, "ball", [(scale,) * 3], ratio=ratio)


@given(st.integers(0, 1000), st.floats(0.0, 3.0))
def test_the_nearest_point_is_that_of_all_triangles(seed: int, spread: float) -> None:
    draw = np.random.default_rng(seed)
    mesh = trimesh.Trimesh(draw.normal(size=(12, 3)), draw.integers(0, 12, size=(9, 3)), process=False)
    points = draw.normal(size=(30, 3)) * spread
    parts = draw.dirichlet((1.0, 1.0, 1.0), size=200)  # places in a triangle, by the shares of its corners
    places = np.einsum("pc,tcx->tpx", parts, np.asarray(mesh.triangles)).reshape(-1, 3)
    sampled = np.linalg.norm(points[:, None] - places, axis=2).min(axis=1)
    found = nearest(mesh, points)
    assert (found <= sampled + 1e-9).all()
    assert (sampled - found).max() < 1.0


@given(st.integers(0, 1000), st.integers(-4, 4))
def test_distances_grow_with_the_scale(seed: int, power: int) -> None:
    ball, points = sphere(finer=1), np.random.default_rng(seed).normal(size=(20, 3))
    factor = 10.0**power
    grown = scaled(ball, (factor,) * 3)
    assert nearest(grown, points * factor) == pytest.approx(nearest(ball, points) * factor, rel=1e-6, abs=factor * 1e-9)


@given(st.floats(-2.0, 2.0))
@settings(max_examples=5)
def test_the_distance_to_a_shifted_plane_is_the_shift(shift: float) -> None:
    plate: Any = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    moved = plate.copy()
    moved.apply_translation([0.0, 0.0, shift])
    near = 1e-8  # [m] at which trimesh takes two points for one
    assert distance(plate, moved) == pytest.approx((abs(shift), abs(shift)), abs=near)
    assert distance(plate, moved, (1.0, 1.0, 0.001)) == pytest.approx((abs(shift) / 1000, abs(shift) / 1000), abs=near)


def test_the_largest_distance_may_be_at_a_corner() -> None:
    spike: Any = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 5]], [[0, 1, 2], [0, 1, 3]])
    flat: Any = trimesh.Trimesh(spike.vertices[:3], [[0, 1, 2]])
    largest, mean = distance(spike, flat)
    assert largest == pytest.approx(5.0)
    assert 0.0 < mean < largest


@given(st.floats(0.001, 1.0), st.integers(1, 100_000))
def test_a_ratio_leaves_its_share_and_at_least_a_closed_body(ratio: float, faces: int) -> None:
    assert faces_for(ratio, faces) >= 4
    assert abs(faces_for(ratio, faces) - ratio * faces) <= 4


def test_fewer_triangles_are_further_away(file: Path) -> None:
    finer, coarser = (simplified(file, ratio) for ratio in (0.5, 0.1))
    assert (finer.triangles, coarser.triangles) == ((320, 160), (320, 32))
    assert 0.0 < finer.mean < coarser.mean < coarser.largest < 0.5
    assert coarser.bytes == (file.stat().st_size, 84 + 50 * 32) == (file.stat().st_size, len(coarser.data))


def test_the_error_is_told_in_the_scale_of_the_urdf(file: Path) -> None:
    metres, millimetres = (simplified(file, 0.1, scale) for scale in (1.0, 0.001))
    assert millimetres.largest == pytest.approx(metres.largest / 1000)
    assert simplify(file, "ball", [(0.001,) * 3, ONE], ratio=0.1).largest == metres.largest


def test_the_same_mesh_gives_the_same_bytes(file: Path) -> None:
    assert simplify(file, "ball", [ONE], ratio=0.1) == simplified(file, 0.1)


def test_what_has_fewer_triangles_is_copied(file: Path) -> None:
    for made in (simplify(file, "ball", [ONE], faces=5000), simplify(file, "ball", [ONE], ratio=1.0)):
        assert (made.triangles, made.largest, made.mean) == ((320, 320), 0.0, 0.0)


@pytest.mark.parametrize("suffix", [".obj", *rare(".dae")])
def test_other_formats_are_read_with_seams_closed(suffix: str, tmp_path: Path) -> None:
    sphere().export(tmp_path / f"ball{suffix}")
    made = simplify(tmp_path / f"ball{suffix}", "ball", [ONE], ratio=0.25)
    assert made.triangles == (320, 80)
    assert made.largest < 0.1


def test_a_collada_file_is_in_metres_whatever_its_unit(tmp_path: Path) -> None:
    path = tmp_path / "ball.dae"
    sphere(1000.0).export(path)
    text = path.read_text().replace("<asset>", '<asset><unit name="mm" meter="0.001"/>')
    path.write_text(text)
    assert "0.001" in text
    assert simplify(path, "ball", [ONE], ratio=0.25).largest < 0.1


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "has no surface"),
        ("v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n", "'m.obj'"),
        ("v 0 0 0\n", "'m.obj'"),
        ("nonsense", "'m.obj'"),
    ],
)
def test_what_is_no_mesh_is_told(text: str, why: str, tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text(text)
    with pytest.raises(ValueError, match=why):
        simplify(tmp_path / "m.obj", "m.obj", [ONE], ratio=0.1)


@given(st.lists(st.builds(Path, st.sampled_from("abAB"), st.sampled_from(["c.stl", "C.stl", "c.dae", "d.obj"]))))
def test_every_file_has_a_name_of_its_own(paths: list[Path]) -> None:
    unique = list(dict.fromkeys(paths))
    names = file_names(unique)
    assert len({name.lower() for name in names.values()}) == len(unique)
    assert all(name.endswith(".stl") and "/" not in name for name in names.values())
