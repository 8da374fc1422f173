"""Trees of spheres: each sphere covers what those below it are for, and the finest ones cover the whole shape."""

from __future__ import annotations

import io
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rbxcompose.domains.arms.motion import sphere_trees as kept_trees
from rbxcompose.domains.arms.motion.collisions import coal_shape
from rbxcompose.domains.arms.motion.sphere_checker import triangles_of
from rbxcompose.domains.arms.motion.sphere_trees import (
    FINEST,
    LEAVES,
    SphereTree,
    ball_tree,
    box_tree,
    cells_tree,
    cylinder_tree,
    kept_mesh_tree,
    mesh_tree,
)
from rbxcompose.domains.body.model import Geometry

Array = NDArray[np.float64]
LENGTHS = st.floats(1e-3, 2.0)
SEEDS = st.integers(0, 2**31)
DIRECTIONS = np.random.default_rng(5).normal(size=(3, 64))


def uncovered(tree: SphereTree, points: Array, node: int = 0) -> Array:
    """Return the points that no way down the tree leads to: those that are beyond a sphere, or beyond its hull."""
    inside = np.linalg.norm(points - tree.centres[node], axis=1) <= tree.radii[node]
    first, end = tree.spans[node]
    if first < end:
        inside &= np.all(points @ DIRECTIONS <= (tree.corners[first:end] @ DIRECTIONS).max(axis=0) + 1e-9, axis=1)
    out, rest, child = points[~inside], points[inside], tree.children[node]
    if child >= 0 and len(rest):
        rest = uncovered(tree, uncovered(tree, rest, child), child + 1)
    elif child < 0:
        rest = rest[:0]
    return np.concatenate((out, rest))


@given(st.tuples(LENGTHS, LENGTHS, LENGTHS), SEEDS)
def test_spheres_cover_a_box_within_and_on_its_surface(size: tuple[float, float, float], seed: int) -> None:
    points = np.random.default_rng(seed).uniform(-1, 1, (300, 3))
    points[:150] /= np.abs(points[:150]).max(axis=1)[:, None]
    tree = box_tree(size)
    assert not len(uncovered(tree, points * np.array(size) / 2))
    assert len(tree.leaves[0]) <= LEAVES


@given(LENGTHS, LENGTHS, SEEDS)
def test_spheres_cover_a_cylinder_within_and_on_its_surface(radius: float, length: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    angle, along = rng.uniform(0, 2 * np.pi, 300), rng.uniform(-1, 1, 300)
    away = np.where(np.arange(300) % 2, np.sqrt(rng.uniform(0, 1, 300)), 1.0)
    along[::3] = np.sign(along[::3])
    points = np.stack((radius * away * np.cos(angle), radius * away * np.sin(angle), length / 2 * along), axis=1)
    tree = cylinder_tree(radius, length)
    assert not len(uncovered(tree, points))
    assert len(tree.leaves[0]) <= LEAVES


@settings(max_examples=settings().max_examples // 2)
@given(st.integers(1, 40), SEEDS)
def test_spheres_cover_every_triangle_of_a_mesh(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    triangles = rng.normal(scale=rng.uniform(1e-3, 1.0), size=(count, 3, 3))
    assert not len(uncovered(mesh_tree(triangles), on_surface(triangles, 500, rng)))


@settings(max_examples=settings().max_examples // 2)
@given(st.integers(1, 40), SEEDS)
def test_the_hulls_of_a_mesh_cover_it_as_its_spheres_do(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    triangles = rng.normal(scale=rng.uniform(1e-3, 1.0), size=(count, 3, 3))
    tree, points = mesh_tree(triangles), on_surface(triangles, 200, rng)
    is_in = np.zeros(len(points), dtype=bool)
    ways = rng.normal(size=(200, 3))
    for begin, end in tree.spans[tree.children < 0]:
        is_in |= np.all(points @ ways.T <= (tree.corners[begin:end] @ ways.T).max(axis=0) + 1e-9, axis=1)
    assert np.all(is_in)


def test_a_convex_mesh_is_one_hull_and_another_one_many_small_ones() -> None:
    corners = np.array([(x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
    sides = (
        (0, 1, 3),
        (0, 3, 2),
        (4, 7, 5),
        (4, 6, 7),
        (0, 5, 1),
        (0, 4, 5),
        (2, 3, 7),
        (2, 7, 6),
        (0, 2, 6),
        (0, 6, 4),
    )
    cube = corners[[*map(list, sides), [1, 5, 7], [1, 7, 3]]]
    assert len(mesh_tree(cube).radii) == 1
    _, radii = mesh_tree(np.concatenate((cube, cube + np.array((2.0, 0.0, 0.0))))).leaves
    assert radii.max() < 0.5


@given(st.integers(1, 300), st.floats(0.01, 0.2), SEEDS)
def test_spheres_cover_all_cells_of_an_octree(count: int, side: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    middles = (rng.integers(-20, 20, (count, 3)).astype(np.float64) + 0.5) * side
    corners = middles + rng.choice([-0.5, 0.5], (count, 3)) * side
    assert not len(uncovered(cells_tree(middles, side), corners))


def test_a_sphere_is_its_own_tree() -> None:
    centres, radii = ball_tree(0.3).leaves
    assert len(centres) == 1
    assert 0.3 < radii[0] < 0.3 + FINEST


@pytest.mark.parametrize("kind", ["collision", "visual"])
def test_spheres_cover_the_meshes_of_a_panda(kind: str) -> None:
    meshes = panda(kind)
    if not meshes:
        pytest.skip("example-robot-data is not installed")
    for path in meshes:
        triangles = triangles_of(coal_shape(Geometry("mesh", file=str(path)), {}))
        tree = mesh_tree(triangles)
        assert not len(uncovered(tree, on_surface(triangles, 3_000, np.random.default_rng(1)))), path.name
        assert len(tree.radii) == 1 or tree.leaves[1].max() < 0.05, path.name


def test_what_was_fitted_is_kept_and_a_bad_file_is_fitted_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    triangles = np.random.default_rng(1).normal(size=(8, 3, 3))
    first = kept_mesh_tree(triangles)
    [path] = (tmp_path / "rbxcompose/spheres").iterdir()
    again = kept_mesh_tree(triangles)
    assert again.radii.tobytes() == first.radii.tobytes()
    assert again.children.tolist() == first.children.tolist()
    whole = path.read_bytes()
    for bad in (b"", whole[:100], np.zeros((3, 5)).tobytes(), spoilt(path, 4, 0.0), spoilt(path, 6, 1e6)):
        path.write_bytes(bad)
        assert kept_mesh_tree(triangles).radii.tobytes() == first.radii.tobytes()
        assert path.read_bytes() == whole


@pytest.mark.soak
@pytest.mark.timeout(100)
def test_spheres_of_a_fine_mesh_are_kept_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    middles = np.random.default_rng(1).normal(size=(50_000, 1, 3))
    around = np.random.default_rng(2).normal(scale=0.01, size=(50_000, 3, 3))
    triangles = (middles / np.linalg.norm(middles, axis=2, keepdims=True)) * 3.0 + around
    triangles /= np.linalg.norm(triangles, axis=2, keepdims=True)  # on a ball, where all are corners of hulls
    first = kept_mesh_tree(triangles)
    assert len(first.corners) > 50_000
    monkeypatch.setattr(kept_trees, "mesh_tree", None)
    assert kept_mesh_tree(triangles).corners.tobytes() == first.corners.tobytes()


def spoilt(path: Path, column: int, value: float) -> bytes:
    """Return a tree that leads in a circle, or to corners that are not there, as a file."""
    content, file = io.BytesIO(path.read_bytes()), io.BytesIO()
    rows, corners = np.load(content), np.load(content)
    rows[0, column] = value
    np.save(file, rows)
    np.save(file, corners)
    return file.getvalue()


def on_surface(triangles: Array, count: int, rng: np.random.Generator) -> Array:
    """Return random points of triangles."""
    shares = rng.dirichlet((1.0, 1.0, 1.0), count)
    return np.asarray(np.einsum("pi,pij->pj", shares, triangles[rng.integers(0, len(triangles), count)]))


def panda(kind: str) -> list[Path]:
    try:
        there = files("example-robot-data") or []
    except PackageNotFoundError:
        return []
    wanted = f"panda_description/meshes/{kind}/"
    return [Path(str(file.locate())) for file in there if wanted in str(file) and str(file).endswith((".stl", ".dae"))]
