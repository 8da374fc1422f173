"""Pictures of an arm among things: where it is, where it goes, the way of its tip, and what collides."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from itertools import pairwise
from pathlib import Path
from textwrap import wrap

from rbxcompose.base.arrays import Array, Ints, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3, Vector3
from rbxcompose.domains.arms.motion.octree_files import cells_in
from rbxcompose.domains.arms.motion.scene import PlacedObject
from rbxcompose.domains.body import picture as body_picture
from rbxcompose.domains.body.meshes import Solid, joined
from rbxcompose.domains.body.model import Body, Geometry

RED, GREEN, BLUE, SAND = (0.85, 0.1, 0.1), (0.2, 0.7, 0.3), (0.1, 0.3, 0.85), (0.85, 0.7, 0.45)
FLOOR = (0.88, 0.88, 0.9)
_WAY = 0.006  # [m]: half the width of the line along the way of the tip
_LONGEST_LINE = 95  # letters
_MARGIN = 0.15  # of a plane's picture around all else, as a share


@dataclass(frozen=True, slots=True)
class ArmPicture:
    """What is to be seen: the body at positions of its joints, things, and what an arm is about to do.

    `goal` are positions of the joints there, which move `moved` links; `way` is that of the tip [m]. Links and things
    that are `colliding` are red, those of the goal if there is one. `caption` and `problem` are written above it.
    """

    body: Body
    meshes: Mapping[str, Path]
    positions: Mapping[str, float]
    objects: Sequence[PlacedObject] = ()
    goal: Mapping[str, float] = field(default_factory=dict)
    moved: Collection[str] = ()
    way: Sequence[Vector3] = ()
    colliding: Collection[str] = ()
    caption: str = ""
    problem: str = ""


def draw_arm(shown: ArmPicture) -> bytes:
    """Return a PNG.

    Raises:
        MissingLibraryError: if a library is missing.
        ValueError: if there is nothing to draw, or a file of a shape cannot be read.
    """
    body_picture.need_for_pictures()
    goal, start = dict(shown.positions) | dict(shown.goal), shown.body.poses(shown.positions)
    solids = solids_in(shown)
    if not solids:
        raise ValueError("there is nothing to draw")
    ghost = list(_links(shown, goal, shown.moved, shown.colliding, GREEN)) if shown.goal else []
    bounds = body_picture.bounds_of(joined([*solids, *ghost]))
    solids += [plane for each in shown.objects for plane in _planes(each, start, bounds)]
    pixels = body_picture.rendered(joined(solids), bounds)
    if ghost:
        pixels = 0.35 * pixels + 0.65 * body_picture.rendered(joined([*solids, *ghost]), bounds)
    lines = [(line, "black") for line in wrap(shown.caption, _LONGEST_LINE)]
    lines += [(line, "#c01010") for line in wrap(shown.problem, _LONGEST_LINE, max_lines=3, placeholder=" ...")]
    return body_picture.png_of(pixels, *lines)


def solids_in(shown: ArmPicture) -> list[Solid]:
    """Return the body, the things around it and the way of the tip, without the goal and planes."""
    start, red_at_start = shown.body.poses(shown.positions), () if shown.goal else shown.colliding
    solids = list(_links(shown, shown.positions, shown.body.links, red_at_start))
    solids += [solid for each in shown.objects for solid in _solids(each, start, each.name in shown.colliding)]
    return solids + _line(shown.way)


def _links(
    shown: ArmPicture,
    positions: Mapping[str, float],
    links: Iterable[str],
    colliding: Collection[str],
    colour: tuple[float, ...] | None = None,
) -> Iterator[Solid]:
    found = body_picture.solids_of_links(shown.body, positions, shown.meshes)
    for link in links:
        tint = RED if link in colliding else colour
        yield from (body_picture.placed(solid, Transform3(), tint) for solid in found.get(link, ()))


def _solids(thing: PlacedObject, poses: Mapping[str, Transform3], is_red: bool) -> Iterator[Solid]:
    for piece in thing.all_pieces:
        at, colour = poses[thing.link].compose(piece.pose), RED if is_red else thing.colour or SAND
        if piece.shape.kind == "octree":
            yield body_picture.placed(_cells(piece.shape), at, colour)
        elif piece.shape.kind != "plane":
            files = {piece.shape.file: Path(piece.shape.file)}
            yield from (body_picture.placed(each, at, colour) for each in body_picture.solids_of(piece.shape, files))


def _cells(shape: Geometry) -> Solid:
    vertices, faces = cubes(*cells_in(shape))
    return Solid(vertices, faces, np.tile(SAND, (len(faces), 1)))


def cubes(middles: Array, side: float) -> tuple[Array, Ints]:
    """Return corners [m] and triangles of cubes around middles [m], the same number of triangles for each."""
    box = next(body_picture.solids_of(Geometry("box", (side,) * 3), {}))
    corners = (middles[:, None] + box.vertices[None]).reshape(-1, 3)
    faces = (box.faces[None] + len(box.vertices) * np.arange(len(middles))[:, None, None]).reshape(-1, 3)
    return corners, faces


def _planes(thing: PlacedObject, poses: Mapping[str, Transform3], bounds: Array) -> Iterator[Solid]:
    """Yield a thin square for each plane, below or beside all else."""
    middle, width = bounds.mean(0), float(np.linalg.norm(bounds[1] - bounds[0])) * (1 + _MARGIN)
    for piece in thing.all_pieces:
        if piece.shape.kind == "plane":
            at, normal = poses[thing.link].compose(piece.pose), np.array(piece.shape.size[:3])
            turned = np.array(at.compose(Transform3(_vector(normal))).translation) - at.translation
            above = float(turned @ (middle - np.array(at.translation))) + piece.shape.size[3]
            yield _square(middle - above * turned, turned, width, thing.colour or FLOOR)


def _square(middle: Array, normal: Array, width: float, colour: tuple[float, ...]) -> Solid:
    side = np.cross(normal, (1.0, 0.0, 0.0) if abs(normal[0]) < 0.9 else (0.0, 1.0, 0.0))
    side *= width / 2 / np.linalg.norm(side)
    other = np.cross(normal, side)
    corners = np.stack([middle + a * side + b * other for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    return Solid(corners, np.array([(0, 1, 2), (0, 2, 3)]), np.tile(colour[:3], (2, 1)))


def _line(way: Sequence[Vector3]) -> list[Solid]:
    """Return a thin tube along points."""
    from trimesh import creation

    return [
        Solid(np.array(tube.vertices), np.array(tube.faces), np.tile(BLUE, (len(tube.faces), 1)))
        for first, second in pairwise(way)
        if np.linalg.norm(np.subtract(first, second)) > 1e-6
        for tube in [creation.cylinder(radius=_WAY, segment=np.array([first, second]), sections=8)]
    ]


def _vector(values: Array) -> Vector3:
    x, y, z = values.tolist()
    return x, y, z
