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

FORM = f"1 {LEAVES} {FINEST} {SEGMENTS} {SLACK}"
"""What the spheres depend on beside the mesh; its first number changes with how they are fitted."""
MOST_FILES = 256
LARGEST = 1_000_000  # [bytes]


def kept_mesh_tree(triangles: Array) -> SphereTree:
    """Return the tree of the surface of a mesh, whose triangles have the shape (t, 3, 3) [m]; keep it for later."""
    digest = xxh3_128_hexdigest(FORM.encode() + np.ascontiguousarray(triangles).tobytes())
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    path = home / "rbxcompose/spheres" / f"{digest}.npy"
    if (kept := _read(path)) is not None:
        return kept
    made = mesh_tree(triangles)
    file = io.BytesIO()
    np.save(file, np.column_stack((made.centres, made.radii, made.children)), allow_pickle=False)
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
            rows = np.load(io.BytesIO(file.read(LARGEST)), allow_pickle=False)
    except (OSError, ValueError, EOFError):
        return None
    if rows.ndim != 2 or rows.shape[1] != 5 or not len(rows) or not np.all(np.isfinite(rows)):
        return None
    children, own = rows[:, 4].astype(np.int64), np.arange(len(rows))
    if np.any((children >= 0) & ((children <= own) | (children + 1 >= len(rows)))):
        return None  # it would lead in circles, or out of the tree
    return SphereTree(np.ascontiguousarray(rows[:, :3]), np.ascontiguousarray(rows[:, 3]), children)
