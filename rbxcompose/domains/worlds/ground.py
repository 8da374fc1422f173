"""Where the ground of a world is missing: holes, such as stairs that lead down."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbxcompose.base.dataclass import dataclass
from rbxcompose.domains.worlds.shapes import Point2

LEAST_AREA = 1e-6  # [m^2]


@dataclass(frozen=True, slots=True)
class WorldHole:
    """A part of the ground that is not there, by the corners of a polygon in `map` [m].

    Raises:
        ValueError: if it encloses no area.
    """

    name: str
    corners: tuple[Point2, ...]

    def __post_init__(self) -> None:
        if len(self.corners) < 3:
            raise ValueError("an area has at least three corners")
        sides = zip(self.corners, (*self.corners[1:], self.corners[0]), strict=True)
        if abs(sum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in sides)) < 2 * LEAST_AREA:
            raise ValueError("the corners of an area are on one line, or its sides cross")


def in_polygon(corners: Sequence[Point2], x: ArrayLike, y: ArrayLike) -> NDArray[np.bool_]:
    """Return which points (...) are in a polygon: those from which a line to the right crosses its sides oddly."""
    px, py = np.asarray(x, float), np.asarray(y, float)
    inside = np.zeros(px.shape, bool)
    for (x0, y0), (x1, y1) in zip(corners, (*corners[1:], *corners[:1]), strict=True):
        if y0 != y1:
            crosses = (y0 > py) != (y1 > py)
            inside ^= crosses & (px < x0 + (py - y0) * (x1 - x0) / (y1 - y0))
    return inside
