"""Files of meshes as triangles, in the unit of the URDF that names them."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rbxcompose.body.extra import need
from rbxcompose.body.mesh_files import FORMATS, LARGEST, mesh_problem
from rbxcompose.printable import plain
from rbxcompose.regular_files import read_regular

Trimesh = Any  # of an extra, which may be missing
_COLLADA = ".dae"


def read_mesh(path: Path, name: str, most: int = LARGEST) -> Trimesh:
    """Return the triangles of a file of at most `most` bytes; `name` is that in messages.

    Lengths are those of the file, but a Collada file has a unit, and is read in metres, as viewers do.

    Raises:
        MissingLibraryError: if a library for this format is missing.
        ValueError: if it cannot be read.
    """
    if problem := mesh_problem(path, most):
        raise ValueError(f"the mesh '{plain(name)}' {problem}")
    if (ending := path.suffix.lower()) not in FORMATS:
        raise ValueError(f"the mesh '{plain(name)}' is none of {', '.join(FORMATS)}")
    if ending == _COLLADA:
        need("Collada files", "collada")
    from trimesh import load_scene, units

    try:
        data = io.BytesIO(read_regular(path, most))  # without its path, a mesh cannot name further files
        scene = load_scene(data, file_type=ending.removeprefix("."))
        mesh: Any = scene.to_mesh()
        if ending == _COLLADA and scene.units:
            mesh.apply_scale(units.unit_conversion(scene.units, "meters"))
        is_empty = not len(mesh.faces)
    except Exception as error:  # readers of many formats raise anything
        raise ValueError(f"the mesh '{plain(name)}' cannot be read") from error
    if is_empty:
        raise ValueError(f"the mesh '{plain(name)}' has no triangles")
    return mesh


def scaled(mesh: Trimesh, scale: Sequence[float]) -> Trimesh:
    """Return a copy with each direction multiplied by its factor."""
    copy = mesh.copy()
    copy.apply_scale(scale)
    return copy
