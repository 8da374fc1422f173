"""Spheres of meshes in the user's folder of caches, by what the meshes are. Losing them costs time only."""

from __future__ import annotations

import io
import os
import stat
from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from xxhash import xxh3_128_hexdigest

from rbxcompose.atomic_files import replace_file
from rbxcompose.motion.sphere_trees import FINEST, LEAVES, SEGMENTS, SLACK, SphereTree, mesh_tree
from rbxcompose.regular_files import open_regular

Array = NDArray[np.float64]

FORM = f"4 {LEAVES} {FINEST} {SEGMENTS} {SLACK}"
"""What the spheres depend on beside the mesh; its first number changes with how they are fitted."""
MOST_FILES = 256
LARGEST = 64_000_000  # [bytes], as many as a mesh may have


def kept_mesh_tree(triangles: Array) -> SphereTree:
    """Return the tree of the surface of a mesh, whose triangles have the shape (t, 3, 3) [m]; keep it for later."""
    digest = xxh3_128_hexdigest(FORM.encode() + np.ascontiguousarray(triangles).tobytes())
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    path = home / "rbxcompose/spheres" / f"{digest}.npy"
    if (kept := _read(path)) is not None:
        return kept
    made = mesh_tree(triangles)
    file = io.BytesIO()
    for array in (np.column_stack((made.centres, made.radii, made.children, made.spans)), made.corners):
        np.save(file, array, allow_pickle=False)
    with suppress(OSError):  # without a folder that can be written, there is none to keep it in
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        replace_file(path, file.getvalue(), mode=0o600)
        files = sorted(path.parent.iterdir(), key=lambda one: one.stat().st_mtime_ns)
        for old in files[:-MOST_FILES]:
            old.unlink()
    return made


def _read(path: Path) -> SphereTree | None:
    """Return what was kept; None if that is nothing, no tree, or not written by this user alone."""
    try:
        with open_regular(path, follow=False) as file:
            about = os.fstat(file.fileno())
            if about.st_uid != os.getuid() or about.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
                return None
            content = io.BytesIO(file.read(LARGEST))
            rows, corners = (np.load(content, allow_pickle=False) for _ in range(2))
    except (OSError, ValueError, EOFError):
        return None
    if rows.ndim != 2 or rows.shape[1] != 7 or not len(rows) or corners.ndim != 2 or corners.shape[1] != 3:
        return None
    if not all(one.dtype == np.float64 and np.all(np.isfinite(one)) for one in (rows, corners)):
        return None
    (children, begins, ends), own = rows[:, 4:].T.astype(np.int64), np.arange(len(rows))
    if np.any((children >= 0) & ((children <= own) | (children + 1 >= len(rows)))):
        return None  # it would lead in circles, or out of the tree
    if np.any((begins < 0) | (ends < begins) | (ends > len(corners))):
        return None
    spheres = (np.ascontiguousarray(rows[:, :3]), np.ascontiguousarray(rows[:, 3]), children)
    return SphereTree(*spheres, np.stack((begins, ends), axis=1), corners)
