"""Files of meshes as coloured triangles, in metres, as RViz reads them."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from rbxcompose.body.extra import need
from rbxcompose.body.mesh_files import FORMATS, LARGEST, mesh_problem
from rbxcompose.dataclass import dataclass
from rbxcompose.printable import plain
from rbxcompose.regular_files import read_regular

Trimesh = Any  # of an extra, which may be missing
Array = NDArray[np.float64]
GREY = (0.6, 0.62, 0.65)
_COLLADA = ".dae"
_MATERIALS = ("bind_material", "library_materials", "library_effects", "library_images")


@dataclass(frozen=True, slots=True)
class Solid:
    """Triangles: `vertices` [m], three of them for each of `faces`, and `colours`: red, green, blue from 0 to 1."""

    vertices: Array
    faces: NDArray[np.int64]
    colours: Array


def joined(solids: Sequence[Solid]) -> Solid:
    """Return several solids as one."""
    starts = np.cumsum([0, *(len(one.vertices) for one in solids[:-1])])
    return Solid(
        np.concatenate([one.vertices for one in solids]),
        np.concatenate([one.faces + start for one, start in zip(solids, starts, strict=True)]),
        np.concatenate([one.colours for one in solids]),
    )


def read_mesh(path: Path, name: str, most: int = LARGEST) -> Solid:
    """Return the triangles of a file of at most `most` bytes; `name` is that in messages.

    Lengths are those of the file, but in metres if it tells its unit. Its upward axis is ignored.

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
    try:
        data = read_regular(path, most)
        pieces = list(_pieces(data, ending)) or (list(_without_materials(data)) if ending == _COLLADA else [])
    except Exception as error:  # readers of many formats raise anything
        raise ValueError(f"the mesh '{plain(name)}' cannot be read") from error
    if not pieces:
        raise ValueError(f"the mesh '{plain(name)}' has no triangles")
    return joined(pieces)


def _pieces(data: bytes, ending: str) -> Iterator[Solid]:
    """Yield the pieces of a mesh file; without its path, it cannot name further files."""
    from trimesh import load_scene
    from trimesh.units import unit_conversion

    scene: Any = load_scene(io.BytesIO(data), file_type=ending.removeprefix("."))
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        geometry = scene.geometry[name]
        if len(getattr(geometry, "faces", ())):
            unit = unit_conversion(geometry.units, "meters") if geometry.units else 1.0
            vertices = (np.array(geometry.vertices) @ matrix[:3, :3].T + matrix[:3, 3]) * unit
            yield Solid(vertices, np.array(geometry.faces), _colours(geometry))


def _colours(geometry: Trimesh) -> Array:
    """Return the colour of each face. Of a texture only the colour below it counts."""
    visual, count = geometry.visual, len(geometry.faces)
    if not visual.defined:
        return np.tile(GREY, (count, 1))
    if hasattr(visual, "face_colors"):
        return np.array(visual.face_colors)[:, :3] / 255
    return np.tile(np.array(visual.material.main_color)[:3] / 255, (count, 1))


def _without_materials(data: bytes) -> Iterator[Solid]:
    """Yield the pieces of a COLLADA file whose materials are broken, which hides what they are on."""
    root = ElementTree.fromstring(data)  # noqa: S314 (expat limits entities, and the file is limited, too)
    for parent in list(root.iter()):
        for child in list(parent):
            if re.sub("^{.*}", "", child.tag) in _MATERIALS:
                parent.remove(child)
    yield from _pieces(ElementTree.tostring(root), _COLLADA)
