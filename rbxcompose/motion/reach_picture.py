"""Pictures of where an arm gets: cells around the robot in colours, with a legend."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from textwrap import wrap

import numpy as np
from numpy.typing import NDArray

from rbxcompose.body.meshes import Solid, joined
from rbxcompose.body.model import Geometry
from rbxcompose.body.picture import bounds_of, need_for_pictures, png_of, rendered
from rbxcompose.body.solids import placed, solids_of
from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import Transform3
from rbxcompose.motion.picture import ArmPicture, solids_in
from rbxcompose.motion.reach import Cell

Array = NDArray[np.float64]

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
    lines = [(line, "black") for line in wrap(shown.robot.told, _LONGEST_LINE)]
    return _with_legend(png_of(rendered(whole, bounds_of(whole)), *lines), shown)


def colours_of(values: Sequence[float], most: float) -> Array:
    """Return the colours of values from 0 to `most`, of shape (n, 3)."""
    place = np.clip(np.array(values) / (most or 1.0), 0.0, 1.0) * (len(SCALE) - 1)
    return np.stack([np.interp(place, np.arange(len(SCALE)), SCALE[:, one]) for one in range(3)], axis=1)


def _cubes(shown: ReachPicture) -> Solid:
    middles = np.array(list(shown.cells), dtype=float) * shown.side
    side = shown.side * (_FULL if shown.is_layer else _SMALL)
    box = placed(next(solids_of(Geometry("box", (side,) * 3), {})), Transform3(), None)
    vertices = (middles[:, None] + box.vertices[None]).reshape(-1, 3)
    faces = (box.faces[None] + len(box.vertices) * np.arange(len(middles))[:, None, None]).reshape(-1, 3)
    return Solid(vertices, faces, np.repeat(colours_of(list(shown.cells.values()), shown.most), len(box.faces), axis=0))


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
