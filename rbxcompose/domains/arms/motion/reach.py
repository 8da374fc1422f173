"""Where the tip of an arm gets, cell by cell, and pictures of it."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from textwrap import wrap

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.collisions import Checker
from rbxcompose.domains.arms.motion.groups import JointSpace
from rbxcompose.domains.arms.motion.picture import ArmPicture, cubes, solids_in
from rbxcompose.domains.body.meshes import Solid, joined
from rbxcompose.domains.body.picture import bounds_of, need_for_pictures, png_of, rendered

Cell = tuple[int, int, int]

DIRECTIONS = 50
SLICE = 2_000  # positions, after which others may run
SEEDS = 1_000_003  # between those of slices, so that no two of a person share positions
_GOLDEN = math.pi * (3.0 - math.sqrt(5.0))  # [rad]


@dataclass(frozen=True, slots=True)
class Cut:
    """A layer of cells: those that have `at` [m] along the axis 0, 1 or 2 of the root's frame."""

    axis: int
    at: float


@dataclass(slots=True)
class ReachedCell:
    """What was found of a cell."""

    values: Array
    """Positions of joints that bring the tip there, of shape (n,): those of the greatest manipulability."""
    manipulability: float
    directions: set[int] = field(default_factory=set)
    """Which of the directions the x axis of the tip has had, by their numbers."""


@dataclass(frozen=True, slots=True)
class ReachMap:
    """Cells by their numbers along x, y and z: cubes of `side` [m], whose middles are at the numbers times that."""

    cells: Mapping[Cell, ReachedCell]
    side: float
    tried: int
    """Positions of joints, also those whose tip is not in the cut."""
    colliding: int

    def cell_of(self, point: Array) -> Cell:
        """Return the cell of a point [m] in the root's frame."""
        return _cell(point, self.side)


def reached(
    kinematics: ArmKinematics,
    space: JointSpace,
    checker: Checker,
    *,
    side: float,
    samples: int,
    seed: int,
    cut: Cut | None = None,
) -> Iterator[ReachMap]:
    """Yield the cells that the tip gets to at random positions that collide with nothing, more and more of them.

    The same seed tries the same positions. `side` [m] is that of a cell; with a cut, only its cells count.
    """
    cells, sphere = dict[Cell, ReachedCell](), directions()
    tried = colliding = 0
    wanted = None if cut is None else round(cut.at / side)
    for number in range(math.ceil(samples / SLICE)):
        batch = space.samples(min(SLICE, samples - tried), seed * SEEDS + number)
        for values in batch:
            position, rotation, _ = kinematics.tip(values, with_jacobian=False)
            cell = _cell(position, side)
            if cut is not None and cell[cut.axis] != wanted:
                continue
            if not checker.is_free(values):
                colliding += 1
                continue
            ease = manipulability(kinematics, values)
            known = cells.get(cell)
            if known is None:
                known = cells[cell] = ReachedCell(values, ease)
            elif ease > known.manipulability:
                known.values, known.manipulability = values, ease
            known.directions.add(int(np.argmax(sphere @ rotation[:, 0])))
        tried += len(batch)
        yield ReachMap(cells, side, tried, colliding)


def manipulability(kinematics: ArmKinematics, values: Array) -> float:
    """Return how well the tip moves: the volume that velocities of joints of length 1 make, but for a factor."""
    rows = kinematics.tip(values, with_jacobian=True)[2][:3]
    return math.sqrt(max(0.0, float(np.linalg.det(rows @ rows.T))))


def directions(count: int = DIRECTIONS) -> Array:
    """Return even directions, of shape (count, 3), on a spiral of the golden angle around z."""
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    turn, across = _GOLDEN * np.arange(count), np.sqrt(1.0 - z * z)
    return np.stack((across * np.cos(turn), across * np.sin(turn), z), axis=1)


def _cell(point: Array, side: float) -> Cell:
    x, y, z = np.round(point / side).astype(int).tolist()
    return x, y, z


SCALE = np.array(((0.62, 0.05, 0.15), (0.93, 0.45, 0.15), (0.98, 0.9, 0.4), (0.4, 0.75, 0.35), (0.1, 0.35, 0.75)))
"""Colours from the least to the greatest value."""
_FULL, _SMALL = 0.92, 0.3  # of a cell's side: in a layer, and in a cloud, through which one looks
_LETTERS = 15  # [pixels]
_LONGEST_LINE = 95  # letters


@dataclass(frozen=True, slots=True)
class ReachPicture:
    """The robot, and cells of `side` [m] with their values, of which `most` is the end of the scale."""

    robot: ArmPicture
    cells: Mapping[Cell, float]
    side: float
    most: float
    legend: str
    """What the values are, with their unit."""
    is_layer: bool


def draw_reach(shown: ReachPicture) -> bytes:
    """Return a PNG.

    Raises:
        MissingLibraryError: if a library is missing.
        ValueError: if there is nothing to draw, or a file of a shape cannot be read.
    """
    need_for_pictures()
    solids = solids_in(shown.robot)
    if shown.cells:
        solids.append(_cubes(shown))
    if not solids:
        raise ValueError("there is nothing to draw")
    whole = joined(solids)
    lines = [(line, "black") for line in wrap(shown.robot.caption, _LONGEST_LINE)]
    return _with_legend(png_of(rendered(whole, bounds_of(whole)), *lines), shown)


def colours_of(values: Sequence[float], most: float) -> Array:
    """Return the colours of values from 0 to `most`, of shape (n, 3)."""
    place = np.clip(np.array(values) / (most or 1.0), 0.0, 1.0) * (len(SCALE) - 1)
    return np.stack([np.interp(place, np.arange(len(SCALE)), SCALE[:, index]) for index in range(3)], axis=1)


def _cubes(shown: ReachPicture) -> Solid:
    middles = np.array(list(shown.cells), dtype=float) * shown.side
    vertices, faces = cubes(middles, shown.side * (_FULL if shown.is_layer else _SMALL))
    colours = colours_of(list(shown.cells.values()), shown.most)
    return Solid(vertices, faces, np.repeat(colours, len(faces) // len(middles), axis=0))


def _with_legend(png: bytes, shown: ReachPicture) -> bytes:
    """Return the picture with a bar of colours at the bottom: what they mean, from 0 to the greatest value."""
    from PIL import Image, ImageDraw, ImageFont

    picture = Image.open(io.BytesIO(png)).convert("RGB")
    pen, font = ImageDraw.Draw(picture), ImageFont.load_default(_LETTERS)
    left, width, top = _LETTERS, picture.width // 3, picture.height - 3 * _LETTERS
    bar = (colours_of(np.linspace(0.0, 1.0, width).tolist(), 1.0) * 255).round().astype(np.uint8)
    picture.paste(Image.fromarray(np.repeat(bar[None], _LETTERS, axis=0)), (left, top))
    pen.text((left, top - 1.4 * _LETTERS), shown.legend, fill="black", font=font)
    for share in (0.0, 0.5, 1.0):
        pen.text((left + share * width, top + 1.2 * _LETTERS), f"{share * shown.most:.3g}", fill="black", font=font)
    out = io.BytesIO()
    picture.save(out, "PNG")
    return out.getvalue()
