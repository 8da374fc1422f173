"""Files of meshes as coloured triangles, and meshes with fewer triangles."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from rbxcompose.base.arrays import Array, Ints, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import read_regular
from rbxcompose.base.findings import Finding, kind
from rbxcompose.base.printable import plain
from rbxcompose.domains.body.files import FORMATS, LARGEST, mesh_problem

NOT_DRAWN = kind("RBX9042")
GREY = (0.6, 0.62, 0.65)
_COLLADA = ".dae"
_MATERIALS = ("bind_material", "library_materials", "library_effects", "library_images")
LARGEST_FILE = 512_000_000  # [bytes]
LEAST_FACES = 4  # of a closed body
POINTS = 10_000  # on the original surface, and at most as many of its corners
_SEED = 0
_AT_ONCE = 250  # points, each with all triangles that may be nearest
_SLACK = 1e-9  # relative, so that rounding loses no triangle


class MissingLibraryError(Exception):
    """Raised where a library is missing; the finding says which."""

    def __init__(self, finding: Finding) -> None:
        super().__init__(finding.message)
        self.finding = finding


def need(what: str, *names: str, extra: str = "picture") -> None:
    """Require modules for `what`, a plural, which an extra of rbxcompose brings.

    Raises:
        MissingLibraryError: if one is not installed.
    """
    if missing := [name for name in names if find_spec(name) is None]:
        message = f"{what} need {' and '.join(missing)}, which {'is' if len(missing) == 1 else 'are'} not installed"
        raise MissingLibraryError(NOT_DRAWN.at(None, message, help=f"pip install 'rbxcompose[{extra}]'"))


Trimesh = Any  # of an extra, which may be missing


@dataclass(frozen=True, slots=True)
class Solid:
    """Triangles: `vertices` [m], three of them for each of `faces`, and `colours`: red, green, blue from 0 to 1."""

    vertices: Array
    faces: Ints
    colours: Array


def joined(solids: Sequence[Solid]) -> Solid:
    """Return several solids as one."""
    starts = np.cumsum([0, *(len(solid.vertices) for solid in solids[:-1])])
    return Solid(
        np.concatenate([solid.vertices for solid in solids]),
        np.concatenate([solid.faces + start for solid, start in zip(solids, starts, strict=True)]),
        np.concatenate([solid.colours for solid in solids]),
    )


def read_mesh(path: Path, name: str, most: int = LARGEST) -> Solid:
    """Return the triangles of a file of at most `most` bytes; `name` is that in messages.

    Lengths are those of the file, but in metres if it has a unit. Its upward axis is ignored.

    Raises:
        MissingLibraryError: if a library for this format is missing.
        ValueError: if it cannot be read.
    """
    if problem := mesh_problem(path, most):
        raise ValueError(f"the mesh '{plain(name)}' {problem}")
    if (ending := path.suffix.lower()) not in FORMATS:
        raise ValueError(f"the mesh '{plain(name)}' must be one of {', '.join(FORMATS)}")
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


Scale = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class SimplifiedMesh:
    """A binary STL file in place of another file; distances in metres, by the scale in the URDF."""

    data: bytes
    triangles: tuple[int, int]  # before, after
    bytes: tuple[int, int]
    largest: float
    mean: float
    wanted: int
    """How many triangles were wanted: more than there were, or fewer than the shape could be reduced to."""


def faces_for(ratio: float, faces: int) -> int:
    """Return how many of the triangles are left at a ratio, at least those of a closed body."""
    return max(LEAST_FACES, round(ratio * faces))


def simplify(
    path: Path, name: str, scales: Iterable[Scale], faces: int | None = None, ratio: float = 1.0
) -> SimplifiedMesh:
    """Return a mesh file with at most `faces` triangles, or with a `ratio` of them.

    It has the error at the worst of the `scales` by which the file is used.

    Raises:
        MissingLibraryError: if a library is missing.
        ValueError: if it cannot be read or simplified.
    """
    need("simpler meshes", "fast_simplification", "rtree", "trimesh")
    mesh = _closed(read_mesh(path, name, LARGEST_FILE), name)
    before = len(mesh.faces)
    wanted = faces_for(ratio, before) if faces is None else faces
    simple = mesh if wanted >= before else _decimated(mesh, wanted, name)
    distances = [(0.0, 0.0) if simple is mesh else distance(mesh, simple, scale) for scale in scales]
    data: bytes = simple.export(file_type="stl")
    largest, mean = max(distances)
    sizes = path.stat().st_size, len(data)
    return SimplifiedMesh(data, (before, len(simple.faces)), sizes, largest, mean, wanted)


def _closed(solid: Solid, name: str) -> Trimesh:
    """Return a mesh whose triangles share their corners: where a texture or a normal ends there are several."""
    import trimesh

    mesh = trimesh.Trimesh(solid.vertices, solid.faces) if np.isfinite(solid.vertices).all() else None
    if mesh is None or not mesh.area > 0:
        raise ValueError(f"the mesh '{plain(name)}' has no surface")
    return mesh


def _decimated(mesh: Trimesh, faces: int, name: str) -> Trimesh:
    import fast_simplification
    import trimesh

    corners, triangles = fast_simplification.simplify(mesh.vertices, mesh.faces.astype(np.int32), target_count=faces)
    simple: Any = trimesh.Trimesh(corners, triangles, process=False)
    if not len(triangles) or not simple.area > 0:
        raise ValueError(f"nothing is left of the mesh '{plain(name)}' with {faces} triangles")
    return simple


def distance(original: Trimesh, simple: Trimesh, scale: Scale = (1.0, 1.0, 1.0)) -> tuple[float, float]:
    """Return the largest and the mean distance from the surface of one mesh to that of another.

    The mean is that of points spread evenly over the original; the largest may be at one of its corners.
    """
    from trimesh.sample import sample_surface

    first, second = scaled(original, scale), scaled(simple, scale)
    points = np.asarray(sample_surface(first, POINTS, seed=_SEED)[0])
    corners = np.asarray(first.vertices)[:: max(1, -(-len(first.vertices) // POINTS))]
    spread = nearest(second, points)
    return float(max(spread.max(), nearest(second, corners).max())), float(spread.mean())


def nearest(mesh: Trimesh, points: Array) -> Array:
    """Return the distance of each point from the surface of a mesh."""
    triangles, tree = np.asarray(mesh.triangles), mesh.triangles_tree
    parts = [points[start : start + _AT_ONCE] for start in range(0, len(points), _AT_ONCE)]
    return np.concatenate([_nearest(triangles, tree, np.ascontiguousarray(part)) for part in parts])


def _nearest(triangles: Array, tree: Any, points: Array) -> Array:
    """Return distances: the triangle with the nearest box bounds the distance, and what lies within that is tried."""
    first, _ = tree.nearest_v(points, points, strict=True)
    bounds = _distances(triangles[first], points)
    reach = (bounds + _SLACK * (bounds + np.abs(points).max()))[:, None]
    found, counts = tree.intersection_v(points - reach, points + reach)
    many = counts.astype(np.int64)
    tried = _distances(triangles[found], np.repeat(points, many, axis=0))
    return np.asarray(np.minimum.reduceat(tried, np.cumsum(many) - many))


def _distances(triangles: Array, points: Array) -> Array:
    """Return the distance of each point from the triangle in the same row."""
    from trimesh.triangles import closest_point

    closest: Any = closest_point
    first = triangles[:, 0]
    edges, offsets = triangles - first[:, None], points - first
    sizes = np.abs(edges).max(axis=(1, 2))
    sizes[sizes == 0.0] = 1.0
    offsets = offsets / sizes[:, None]  # the library takes small numbers for zero, so that each triangle has size 1
    along = np.linalg.norm(closest(edges / sizes[:, None, None], offsets) - offsets, axis=1)
    corners = np.linalg.norm(offsets, axis=1)
    return np.asarray(np.fmin(along, corners) * sizes)  # a triangle without area gives no number


def scaled(mesh: Trimesh, scale: Sequence[float]) -> Trimesh:
    """Return a copy with each direction multiplied by its factor."""
    copy = mesh.copy()
    copy.apply_scale(scale)
    return copy
