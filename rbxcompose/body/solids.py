"""The shapes of a body as coloured triangles: boxes, round ones, and meshes from files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from rbxcompose.body.meshes import GREY, Solid, Trimesh, joined, read_mesh
from rbxcompose.body.model import Body, Geometry
from rbxcompose.geometry import Transform3, rotate

_ROUND = 48  # faces around a cylinder
_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def solid_of(body: Body, positions: Mapping[str, float], meshes: Mapping[str, Path]) -> Solid | None:
    """Return what is visible of a body, in the frame of its root; None if there is nothing.

    Raises:
        ValueError: if a mesh cannot be read.
    """
    found = [one for solids in solids_of_links(body, positions, meshes).values() for one in solids]
    return joined(found) if found else None


def solids_of_links(body: Body, positions: Mapping[str, float], meshes: Mapping[str, Path]) -> dict[str, list[Solid]]:
    """Return what is visible of each link, in the frame of the root; raises as `solid_of` does."""
    poses, found = body.poses(positions), dict[str, list[Solid]]()
    for name, link in body.links.items():
        for shape in link.visuals or link.collisions:
            at = poses[name].compose(shape.origin)
            found.setdefault(name, []).extend(
                placed(one, at, shape.colour) for one in solids_of(shape.geometry, meshes)
            )
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
