"""Shapes as coal has them, whose axes are those of URDF."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbxcompose.body.meshes import read_mesh
from rbxcompose.body.model import Geometry
from rbxcompose.motion.octree_files import read_cells

Array = NDArray[np.float64]
Coal = Any  # of an extra, without types
STL = ".stl"
"""The ending of meshes that coal reads rightly; those of others may have pieces, whose corners it confuses."""
_READERS = ("trimesh", "collada")


def readers_of(files: Iterable[str]) -> tuple[str, ...]:
    """Return the modules beside coal that read some files of meshes."""
    return () if all(one.lower().endswith(STL) for one in files) else _READERS


class Shapes:
    """Shapes for coal, each made once; `meshes` are the files of meshes by their names."""

    def __init__(self, meshes: Mapping[str, Path]) -> None:
        self._meshes = meshes
        self._made: dict[Geometry, Coal] = {}

    def of(self, geometry: Geometry) -> Coal:
        """Return a shape.

        Raises:
            ModuleNotFoundError: without the extra `arm`.
            ValueError: if it is a mesh that cannot be read.
        """
        if geometry not in self._made:
            self._made[geometry] = coal_shape(geometry, self._meshes)
        return self._made[geometry]

    def keep(self, wanted: Iterable[Geometry]) -> None:
        """Forget all other shapes: those of clouds of points are large, and come again and again."""
        kept = set(wanted)
        self._made = {geometry: made for geometry, made in self._made.items() if geometry in kept}


def coal_shape(geometry: Geometry, meshes: Mapping[str, Path]) -> Coal:
    """Return a shape for coal; a mesh that `meshes` does not name is a file of this name.

    Raises:
        ModuleNotFoundError: without the extra `arm`.
        ValueError: if its file cannot be read.
    """
    import coal

    match geometry.kind:
        case "box":
            return coal.Box(*geometry.size)
        case "sphere":
            return coal.Sphere(*geometry.size)
        case "cylinder":
            return coal.Cylinder(*geometry.size)
        case "cone":
            return coal.Cone(*geometry.size)
        case "capsule":
            return coal.Capsule(*geometry.size)
        case "plane":
            return coal.Halfspace(np.array(geometry.size[:3]), -geometry.size[3])
        case "octree":
            cells, side = np.array(geometry.points).reshape(-1, 3), geometry.size[0]
            return coal.makeOctree(*(read_cells(Path(geometry.file), side) if geometry.file else (cells, side)))
    scale = np.array(geometry.size or (1.0, 1.0, 1.0))
    if geometry.points:
        return _triangles(np.array(geometry.points).reshape(-1, 3) * scale, geometry.triangles)
    return _from_file(meshes.get(geometry.file, Path(geometry.file)), geometry.file, scale)


def _from_file(path: Path, name: str, scale: Array) -> Coal:
    import coal

    if not path.is_file():
        raise ValueError(f"the mesh '{name}' cannot be read: there is no such file")
    if path.suffix.lower() != STL:
        return _of_pieces(path, name, scale)
    try:
        loaded = coal.MeshLoader().load(str(path), scale)
    except (ValueError, RuntimeError) as error:  # its text is about coal's own files
        raise ValueError(f"the mesh '{name}' cannot be read: it is none") from error
    _prove_finite(np.asarray(loaded.vertices()), name)
    loaded.computeLocalAABB()
    return loaded


def _of_pieces(path: Path, name: str, scale: Array) -> Coal:
    for module in _READERS:
        import_module(module)  # a missing one would be told as a broken file
    solid = read_mesh(path, name)
    _prove_finite(solid.vertices, name)
    return _triangles(solid.vertices * scale, solid.faces)


def _prove_finite(corners: Array, name: str) -> None:
    if not np.isfinite(corners).all():
        raise ValueError(f"the mesh '{name}' cannot be read: a corner of it is no finite point")


def _triangles(corners: Array, triangles: ArrayLike) -> Coal:
    import coal

    faces = np.asarray(triangles, dtype=np.int64).reshape(-1, 3)
    made = coal.BVHModelOBBRSS()
    made.beginModel(len(faces), len(corners))
    made.addVertices(corners)
    made.addTriangles(faces)
    made.endModel()
    made.computeLocalAABB()
    return made
