"""A picture of the body: rays from a camera into its shapes, without a display or a graphics card."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator, Mapping
from itertools import cycle
from pathlib import Path
from typing import Any

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.geometry import Transform3, rotate
from rbxcompose.domains.body.meshes import GREY, Solid, Trimesh, joined, need, read_mesh
from rbxcompose.domains.body.model import Body, Geometry

_ROUND = 48  # faces around a cylinder
_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
SIZE = 800  # [pixels] of each side
_FINER = 2  # rays per pixel and direction
_LETTERS = 15  # [pixels] of a line of text
_VIEW = (1.0, -1.3, 0.75)  # direction from which it is seen: from the right front, and above
_LIGHT = (0.4, -0.75, 1.0)
_AMBIENT = 0.35
_FIELD = math.radians(30)  # of view
_MARGIN = 1.08
_FARTHEST = 1e6  # [m] from the root: more is no robot, and rays are computed with few digits
_NEEDED = ("trimesh", "embreex", "PIL")
# Of links whose shapes have no material, in turn: calm, and none like what a picture of an arm marks.
_CALM = (
    (0.40, 0.53, 0.66),  # slate blue
    (0.86, 0.80, 0.70),  # cream
    (0.50, 0.66, 0.62),  # sea green
    (0.74, 0.56, 0.50),  # clay
    (0.62, 0.58, 0.72),  # lavender
    (0.70, 0.73, 0.76),  # silver
)


def solid_of(body: Body, positions: Mapping[str, float], meshes: Mapping[str, Path]) -> Solid | None:
    """Return what is visible of a body, in the frame of its root; None if there is nothing.

    Raises:
        ValueError: if a mesh cannot be read.
    """
    found = [solid for solids in solids_of_links(body, positions, meshes).values() for solid in solids]
    return joined(found) if found else None


def solids_of_links(body: Body, positions: Mapping[str, float], meshes: Mapping[str, Path]) -> dict[str, list[Solid]]:
    """Return what is visible of each link, in the frame of the root; raises as `solid_of` does.

    What has no colour of its own has that of its link, so that neighbours can be told apart.
    """
    poses, found = body.poses(positions), dict[str, list[Solid]]()
    seen = {name: link.visuals or link.collisions for name, link in body.links.items()}
    calm = dict(zip((name for name, shapes in seen.items() if shapes), cycle(_CALM), strict=False))
    for name, shapes in seen.items():
        for shape in shapes:
            at = poses[name].compose(shape.origin)
            for solid in solids_of(shape.geometry, meshes):
                colour = shape.colour or (calm[name] if np.all(solid.colours == GREY) else None)
                found.setdefault(name, []).append(placed(solid, at, colour))
    return found


def placed(solid: Solid, at: Transform3, colour: tuple[float, ...] | None) -> Solid:
    """Return a solid at a pose, with a colour of its own if there is one."""
    columns = np.array([rotate(at.rotation, axis) for axis in _AXES])
    colours = solid.colours if colour is None else np.tile(colour[:3], (len(solid.faces), 1))
    return Solid(solid.vertices @ columns + at.translation, solid.faces, colours)


def solids_of(geometry: Geometry, meshes: Mapping[str, Path]) -> Iterator[Solid]:
    """Yield the triangles of a geometry; nothing for a mesh that is not there, which is a finding of its own."""
    from trimesh import creation

    match geometry.kind:
        case "box":
            yield _plain(creation.box(extents=geometry.size))
        case "sphere":
            yield _plain(creation.icosphere(subdivisions=4, radius=geometry.size[0]))
        case "cylinder":
            yield _plain(creation.cylinder(radius=geometry.size[0], height=geometry.size[1], sections=_ROUND))
        case "capsule":
            yield _plain(creation.capsule(radius=geometry.size[0], height=geometry.size[1]))
        case "cone":
            radius, height = geometry.size
            cone = creation.cone(radius=radius, height=height, sections=_ROUND)
            yield _plain(cone.apply_translation((0, 0, -height / 2)))
        case _ if geometry.points:
            corners = np.array(geometry.points).reshape(-1, 3) * geometry.size
            faces = np.array(geometry.triangles).reshape(-1, 3)
            yield Solid(corners, faces, np.tile(GREY, (len(faces), 1)))
        case _ if (path := meshes.get(geometry.file)) is not None:
            yield _mesh(geometry, path)


def _plain(shape: Trimesh, colour: tuple[float, ...] = GREY) -> Solid:
    return Solid(np.array(shape.vertices), np.array(shape.faces), np.tile(colour, (len(shape.faces), 1)))


def _mesh(geometry: Geometry, path: Path) -> Solid:
    solid = read_mesh(path, geometry.file)
    return Solid(solid.vertices * geometry.size, solid.faces, solid.colours)


def draw(body: Body, positions: Mapping[str, float], meshes: Mapping[str, Path]) -> bytes:
    """Return a PNG of the body with its joints at `positions` [rad or m]; `meshes` are files by the names in the URDF.

    Raises:
        MissingLibraryError: if a library is missing.
        ValueError: if there is nothing to draw, or a mesh cannot be read.
    """
    need_for_pictures()
    solid = solid_of(body, positions, meshes)
    if solid is None:
        raise ValueError("the body has no shapes")
    return png_of(rendered(solid, bounds_of(solid)))


def need_for_pictures() -> None:
    """Require the libraries that pictures need; raises as `draw` does."""
    need("pictures", *_NEEDED)


def bounds_of(solid: Solid) -> Array:
    """Return its least and greatest coordinates [m], shape (2, 3).

    Raises:
        ValueError: if it is too far away to be drawn.
    """
    if not np.abs(solid.vertices).max() <= _FARTHEST:  # also if it is not a number
        raise ValueError(f"a part of the body is further than {_FARTHEST:g} m away")
    return np.stack((solid.vertices.min(0), solid.vertices.max(0)))


def png_of(pixels: Array, *lines: tuple[str, str]) -> bytes:
    """Return pixels as a PNG, with lines of text at the top, each with its colour."""
    from PIL import Image, ImageDraw, ImageFont

    picture = Image.fromarray((pixels * 255).round().astype(np.uint8)).resize((SIZE, SIZE), Image.Resampling.BOX)
    for number, (text, colour) in enumerate(lines):
        font = ImageFont.load_default(_LETTERS)
        ImageDraw.Draw(picture).text((_LETTERS, _LETTERS * (1 + 1.4 * number)), text, fill=colour, font=font)
    out = io.BytesIO()
    picture.save(out, "PNG")
    return out.getvalue()


def rendered(solid: Solid, bounds: Array) -> Array:
    """Return red, green and blue from 0 to 1, shape (side, side, 3), from a camera that sees all within `bounds`."""
    from trimesh import Trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    whole: Any = Trimesh(solid.vertices, solid.faces, process=False)
    side = SIZE * _FINER
    eye, rays = _camera(bounds, side)
    faces = RayMeshIntersector(whole).intersects_first(np.broadcast_to(eye, rays.shape), rays)
    light = np.array(_LIGHT) / np.linalg.norm(_LIGHT)
    normals = np.asarray(whole.face_normals)
    towards = np.where((normals * (eye - np.asarray(whole.triangles_center))).sum(1)[:, None] < 0, -normals, normals)
    brightness = _AMBIENT + (1 - _AMBIENT) * np.clip(towards @ light, 0, 1)
    shaded = solid.colours * brightness[:, None]
    picture = np.ones((len(rays), 3))
    hit = faces >= 0
    picture[hit] = shaded[faces[hit]]
    return picture.reshape(side, side, 3)


def _camera(bounds: Array, side: int) -> tuple[Array, Array]:
    """Return the eye and the directions of `side` x `side` rays, row by row, that see all within `bounds` and no more.

    The eye is where all of the sphere around `bounds` is in the field of view; the rays cover only their corners.
    """
    middle, radius = bounds.mean(0), float(np.linalg.norm(bounds[1] - bounds[0])) / 2
    back = np.array(_VIEW) / np.linalg.norm(_VIEW)
    right = np.cross((0.0, 0.0, 1.0), back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    eye = middle + back * radius / math.sin(_FIELD / 2)
    corners = np.stack(np.meshgrid(*bounds.T), -1).reshape(-1, 3) - eye
    seen = corners @ np.stack((right, up)).T / -(corners @ back)[:, None]
    half = _MARGIN * float(np.ptp(seen, axis=0).max()) / 2
    span = half * (np.arange(side) + 0.5 - side / 2) / (side / 2)
    across, above = (seen.min(0) + seen.max(0)) / 2
    rays = -back + (across + span)[None, :, None] * right + (above - span)[:, None, None] * up
    return eye, np.ascontiguousarray(rays.reshape(-1, 3))
