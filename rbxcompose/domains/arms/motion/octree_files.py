"""Files of occupied space: octrees of OctoMap (`.bt`), and points as text, one in a line."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.files import read_regular
from rbxcompose.domains.arms.motion.scene import MOST_POINTS
from rbxcompose.domains.body.model import Geometry

LARGEST = 20_000_000  # [bytes]
DEPTH = 16  # levels of OctoMap's trees
BINARY = ".bt"
_HEAD = b"# Octomap OcTree binary file"
MOST_NODES = 2 * MOST_POINTS  # of a tree; some seconds of work
_FREE, _OCCUPIED, _INNER = 1, 2, 3  # the two bits that OctoMap stores for each of eight children; 0 is unknown


def read_cells(path: Path, side: float) -> tuple[Array, float]:
    """Return the middles of occupied cells [m], shape (n, 3), and the side of a cell [m]: that of the tree in a `.bt`.

    Raises:
        ValueError: if the file is none, or has too much in it.
    """
    try:
        data = read_regular(path, LARGEST)
    except OSError as error:
        raise ValueError(f"the file '{path.name}' cannot be read: {error}") from error
    if path.suffix.lower() == BINARY:
        return _octomap(data, path.name)
    try:
        points = np.array([[float(word) for word in line.split()[:3]] for line in data.decode().splitlines() if line])
    except (ValueError, UnicodeDecodeError) as error:
        raise ValueError(f"'{path.name}' has no point in each line: {error}") from error
    if points.ndim != 2 or points.shape[1] != 3 or not np.all(np.isfinite(points)):
        raise ValueError(f"'{path.name}' does not have three numbers in each line")
    return cells_of(points, side), side


def cells_in(shape: Geometry) -> tuple[Array, float]:
    """Return what `read_cells` does, of an octree, which has its cells in a file or with it."""
    side = shape.size[0]
    return read_cells(Path(shape.file), side) if shape.file else (np.array(shape.points).reshape(-1, 3), side)


def cells_of(points: Array, side: float) -> Array:
    """Return the middles of the cells with these points [m], each once.

    Raises:
        ValueError: if there are too many.
    """
    found = (np.unique(np.floor(points / side), axis=0) + 0.5) * side
    if len(found) > MOST_POINTS:
        raise ValueError(f"there are {len(found):,} cells of {side:g} m, and may be {MOST_POINTS:,}: use larger ones")
    return np.asarray(found, dtype=np.float64)


def _octomap(data: bytes, name: str) -> tuple[Array, float]:
    head, separator, rest = data.partition(b"\ndata\n")
    words = dict(line.split(None, 1) for line in head.split(b"\n") if len(line.split(None, 1)) == 2)
    try:
        side = float(words[b"res"])
        is_tree = head.startswith(_HEAD) and separator and words.get(b"id", b"OcTree").strip() == b"OcTree"
    except (KeyError, ValueError):
        is_tree = False
    if not is_tree:
        raise ValueError(f"'{name}' is no binary octree of OctoMap")
    return cells_of_octomap(rest, side), side


def cells_of_octomap(data: bytes, side: float) -> Array:
    """Return the middles of the occupied cells [m] of a tree of OctoMap, shape (n, 3), from the bits of its nodes.

    Raises:
        ValueError: if there are too many, if one is too large or too small, or if the tree is cut short.
    """
    if not 1e-3 <= side <= 1.0:
        raise ValueError(f"a cell is {side:g} m wide: from 1 mm to 1 m")
    try:
        return np.array(list(_occupied(data, side)), dtype=np.float64).reshape(-1, 3)
    except struct.error as error:
        raise ValueError("the tree is cut short") from error


def _occupied(data: bytes, side: float) -> Iterator[tuple[float, float, float]]:
    """Yield the middles of occupied cells; a large occupied cell is yielded as all that it consists of."""
    place, count = 0, 0
    waiting = [(0, (0, 0, 0))]  # depth, and the lowest corner in cells of the deepest level
    while waiting:
        if place > 2 * MOST_NODES:
            raise ValueError(f"there are more than {MOST_NODES:,} nodes")
        depth, corner = waiting.pop()
        (bits,) = struct.unpack_from("<H", data, place)
        place += 2
        inner = []
        width = 1 << (DEPTH - depth - 1)
        for child in range(8):
            state = bits >> (2 * child) & 3
            x, y, z = (low + width * (child >> axis & 1) for axis, low in enumerate(corner))
            if state == _INNER and depth + 1 < DEPTH:
                inner.append((depth + 1, (x, y, z)))
            elif state == _OCCUPIED:
                count += width**3
                if count > MOST_POINTS:
                    raise ValueError(f"there are more than {MOST_POINTS:,} occupied cells")
                yield from _cells((x, y, z), width, side)
        waiting += reversed(inner)  # children follow their parent, the first one first


def _cells(corner: tuple[int, int, int], width: int, side: float) -> Iterator[tuple[float, float, float]]:
    middle = 1 << (DEPTH - 1)
    at = [[(low + step - middle + 0.5) * side for step in range(width)] for low in corner]
    yield from ((x, y, z) for x in at[0] for y in at[1] for z in at[2])
