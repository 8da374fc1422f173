"""A picture of the body: rays from a camera into its shapes, without a display or a graphics card."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbxcompose.body.extra import need
from rbxcompose.body.meshes import Trimesh, read_mesh
from rbxcompose.body.model import Body, Geometry, Shape
from rbxcompose.geometry import Transform3

SIZE = 800  # [pixels] of each side
_FINER = 2  # rays per pixel and direction
_GREY = (0.6, 0.62, 0.65, 1.0)
_VIEW = (1.0, -1.3, 0.75)  # direction from which it is seen: from the right front, and above
_LIGHT = (0.4, -0.75, 1.0)
_AMBIENT = 0.35
_FIELD = math.radians(30)  # of view
_MARGIN = 1.08
_ROUND = 48  # faces around a cylinder
_NEEDED = ("trimesh", "embreex", "PIL")

Array = NDArray[np.float64]


def draw(body: Body, positions: Mapping[str, float], meshes: Mapping[str, Path]) -> bytes:
    """Return a PNG of the body with its joints at `positions` [rad or m]; `meshes` are files by the names in the URDF.

    Raises:
        MissingLibraryError: if a library is missing.
        ValueError: if there is nothing to draw, or a mesh cannot be read.
    """
    need("pictures", *_NEEDED)
    import trimesh
    from PIL import Image

    solids = list(_solids(body, positions, meshes))
    if not solids:
        raise ValueError("the body has no shapes")
    colours = np.concatenate([np.tile(colour[:3], (len(solid.faces), 1)) for solid, colour in solids])
    whole: Any = trimesh.util.concatenate([solid for solid, _ in solids])
    pixels = _rendered(whole, colours, SIZE * _FINER)
    picture = Image.fromarray((pixels * 255).round().astype(np.uint8)).resize((SIZE, SIZE), Image.Resampling.BOX)
    out = io.BytesIO()
    picture.save(out, "PNG")
    return out.getvalue()


def _solids(
    body: Body, positions: Mapping[str, float], meshes: Mapping[str, Path]
) -> Iterator[tuple[Trimesh, tuple[float, ...]]]:
    """Yield each visible shape in the frame of the root, with its colour."""
    poses = body.poses(positions)
    for name, link in body.links.items():
        for shape in link.visuals or link.collisions:
            solid = _solid(shape.geometry, meshes)
            if solid is not None:
                yield _placed(solid, shape, poses[name]), shape.colour or _GREY


def _placed(solid: Trimesh, shape: Shape, link: Transform3) -> Trimesh:
    at = link.compose(shape.origin)
    columns = [at.apply(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    matrix = np.eye(4)
    matrix[:3, 3] = at.translation
    matrix[:3, :3] = np.subtract(columns, at.translation).T
    solid.apply_transform(matrix)
    return solid


def _solid(geometry: Geometry, meshes: Mapping[str, Path]) -> Any:
    """Return the triangles of a geometry; None for a mesh that is not there."""
    from trimesh import creation

    match geometry.kind:
        case "box":
            return creation.box(extents=geometry.size)
        case "sphere":
            return creation.icosphere(subdivisions=4, radius=geometry.size[0])
        case "cylinder":
            return creation.cylinder(radius=geometry.size[0], height=geometry.size[1], sections=_ROUND)
        case "capsule":
            return creation.capsule(radius=geometry.size[0], height=geometry.size[1])
    path = meshes.get(geometry.file)
    if path is None:
        return None
    mesh = read_mesh(path, geometry.file)
    mesh.apply_scale(geometry.size)
    return mesh


def _rendered(whole: Trimesh, colours: Array, side: int) -> Array:
    """Return red, green and blue from 0 to 1, shape (side, side, 3), seen from `_VIEW`."""
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    eye, rays = _camera(np.asarray(whole.bounds), side)
    faces = RayMeshIntersector(whole).intersects_first(np.broadcast_to(eye, rays.shape), rays)
    light = np.array(_LIGHT) / np.linalg.norm(_LIGHT)
    normals = np.asarray(whole.face_normals)
    towards = np.where((normals * (eye - np.asarray(whole.triangles_center))).sum(1)[:, None] < 0, -normals, normals)
    brightness = _AMBIENT + (1 - _AMBIENT) * np.clip(towards @ light, 0, 1)
    shaded = colours * brightness[:, None]
    picture = np.ones((len(rays), 3))
    hit = faces >= 0
    picture[hit] = shaded[faces[hit]]
    return picture.reshape(side, side, 3)


def _camera(bounds: Array, side: int) -> tuple[Array, Array]:
    """Return the eye and the directions of `side` x `side` rays, row by row, that see all within `bounds`."""
    middle, radius = bounds.mean(0), float(np.linalg.norm(bounds[1] - bounds[0])) / 2
    back = np.array(_VIEW) / np.linalg.norm(_VIEW)
    right = np.cross((0.0, 0.0, 1.0), back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    eye = middle + back * radius * _MARGIN / math.sin(_FIELD / 2)
    span = math.tan(_FIELD / 2) * (np.arange(side) + 0.5 - side / 2) / (side / 2)
    rays = -back + span[None, :, None] * right - span[:, None, None] * up
    return eye, np.ascontiguousarray(rays.reshape(-1, 3))
