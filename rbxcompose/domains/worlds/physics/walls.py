"""The occupied cells of a map as a few rectangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbxcompose.domains.worlds.grid_map import SOLID, GridMap

Rectangles = NDArray[np.intp]


def wall_rectangles(grid: GridMap) -> Rectangles:
    """Return rectangles (n, 4) that cover the occupied cells, and nothing else, without overlap.

    Each is its first column and row, and the first column and row behind it, in cells. Occupied runs of a row are
    merged with equal ones of the next row; the same is done by columns, and the shorter list counts.
    """
    solid = grid.cells >= SOLID
    by_rows, by_columns = _merged_runs(solid), _merged_runs(solid.T)[:, [1, 0, 3, 2]]
    return by_rows if len(by_rows) <= len(by_columns) else by_columns


def _merged_runs(solid: NDArray[np.bool_]) -> Rectangles:
    """Return rectangles (n, 4) of equal runs in consecutive rows."""
    change = np.diff(np.pad(solid, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    rows, starts = np.nonzero(change == 1)
    ends = np.nonzero(change == -1)[1]
    order = np.lexsort((rows, ends, starts))
    rows, starts, ends = rows[order], starts[order], ends[order]
    follows = (np.diff(rows) == 1) & (np.diff(starts) == 0) & (np.diff(ends) == 0)
    is_first = np.ones(rows.size, bool)
    is_first[1:] = ~follows
    first = np.flatnonzero(is_first)
    last = np.append(first[1:], rows.size) - 1 if rows.size else first
    return np.stack((starts[first], rows[first], ends[first], rows[last] + 1), -1)
