"""Meshes of a world: files as convex parts."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rbxcompose.base.geometry import Vector3
from rbxcompose.domains.body.meshes import need, read_mesh
from rbxcompose.domains.worlds.shapes import WorldHull, WorldMesh

MOST_PARTS = 100
SIMPLER = "rbxcompose body simplify"
MOST_TRIANGLES = 100_000
FLAT = 1e-3  # a part below this becomes a box of this thickness [m]

Points = NDArray[np.float64]


@lru_cache(maxsize=64)
def world_mesh(path: Path, scale: Vector3) -> WorldMesh:
    """Return a mesh as the convex hulls of its connected parts: a table is its top and its legs.

    Its lowest point is at a height of 0.

    Raises:
        MissingLibraryError: if a library for it is missing.
        ValueError: if it cannot be read, or is too large.
    """
    need("meshes", "trimesh", "scipy", extra="physics")
    import trimesh

    read = read_mesh(path, path.name)
    if len(read.faces) > MOST_TRIANGLES:
        raise ValueError(f"the mesh '{path.name}' has more than {MOST_TRIANGLES} triangles: '{SIMPLER}' makes fewer")
    vertices = read.vertices * scale
    if not np.isfinite(vertices).all():
        raise ValueError(f"the mesh '{path.name}' has corners that are nowhere")
    whole = trimesh.Trimesh(vertices - (0.0, 0.0, vertices[:, 2].min()), read.faces)
    parts = whole.split(only_watertight=False)
    if len(parts) > MOST_PARTS:
        raise ValueError(f"the mesh '{path.name}' has {len(parts)} parts that do not touch, and may have {MOST_PARTS}")
    return WorldMesh(tuple(_hull(np.asarray(part.vertices, float), path.name) for part in parts))


def _hull(points: Points, name: str) -> tuple[float, WorldHull]:
    """Return the height of a part above the ground [m], and its convex hull."""
    import trimesh

    low, high = points.min(0), points.max(0)
    if (high - low).min() < FLAT:
        thick = np.maximum(FLAT - (high - low), 0.0) / 2
        found = trimesh.creation.box(bounds=(low - thick, high + thick))
    elif np.linalg.svd(points - points.mean(0), compute_uv=False)[2] < FLAT:
        raise ValueError(f"a part of the mesh '{name}' is flat and leans: it has no inside")
    else:
        found = trimesh.convex.convex_hull(points)
    bottom = float(found.vertices[:, 2].min())
    corners = (np.asarray(found.vertices, float) - (0.0, 0.0, bottom)).tolist()
    return bottom, WorldHull(
        tuple((float(x), float(y), float(z)) for x, y, z in corners),
        tuple((int(a), int(b), int(c)) for a, b, c in found.faces),
    )
