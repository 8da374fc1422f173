"""A layered layout from left to right: each band (a process) has rows of its own, so that bands never overlap."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from rbxcompose.seeing.layering import Edge, layers_of, to_the_right

COLUMN_GAP, ROW_GAP = 28.0, 12.0  # between boxes [px]
MOST_LANES = 110.0  # more room between layers that many lines connect [px]
BAND_GAP, BAND_HEAD, BAND_EDGE, MARGIN = 22.0, 26.0, 14.0, 10.0  # round bands [px]
THIN = 6.0  # height of the room that a line has between boxes [px]
_SWEEPS, _SETTLINGS = 12, 24
_SECOND, _LAST_BUT_ONE = 1, -2  # of a chain: what its ends look at

Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Item:
    """Something to be placed: its size [px] and its band."""

    key: str
    width: float
    height: float
    band: int


@dataclass(frozen=True, slots=True)
class Rect:
    """A rectangle by its upper left corner [px]."""

    x: float
    y: float
    width: float
    height: float


@dataclass(frozen=True, slots=True)
class Layout:
    """Where everything is [px]; a path runs through its points from where the edge begins to where it ends."""

    places: Mapping[str, Rect]
    paths: Mapping[Edge, tuple[Point, ...]]
    bands: Mapping[int, Rect]
    width: float
    height: float


@dataclass(slots=True, eq=False)
class _Cell:
    """An item, or the room for a line that passes through a layer."""

    item: Item
    layer: int
    before: list[_Cell] = field(default_factory=list)
    after: list[_Cell] = field(default_factory=list)
    y: float = 0.0  # of its middle
    rank: float = 0.0  # in its layer

    @property
    def neighbours(self) -> list[_Cell]:
        return [*self.before, *self.after]


def lay_out(items: Sequence[Item], edges: Sequence[Edge]) -> Layout:
    """Return a place for each item and a path for each edge; the same input gives the same picture.

    Edges from an item to one that stands before it in `items` lead to the left.
    """
    keys = [item.key for item in items]
    forward = to_the_right(keys, edges)
    level = layers_of(keys, list(forward.values()))
    cells = {item.key: _Cell(item, level[item.key]) for item in items}
    chains = {edge: _chain(cells, *forward[edge]) for edge in edges}
    columns = _columns(list(dict.fromkeys([*cells.values(), *(cell for chain in chains.values() for cell in chain)])))
    _order(columns)
    bands = _bands(columns)
    _settle(columns, bands)
    return _drawn(cells, chains, forward, columns, bands)


def _chain(cells: Mapping[str, _Cell], begin: str, end: str) -> list[_Cell]:
    """Link two cells by room for the line in each layer between them."""
    first, last = cells[begin], cells[end]
    between = [_Cell(Item("", 0.0, THIN, last.item.band), layer) for layer in range(first.layer + 1, last.layer)]
    chain = [first, *between, last]
    for one, other in pairwise(chain):
        one.after.append(other)
        other.before.append(one)
    return chain


def _columns(cells: Sequence[_Cell]) -> list[list[_Cell]]:
    columns: list[list[_Cell]] = [[] for _ in range(max((cell.layer for cell in cells), default=0) + 1)]
    for cell in cells:
        columns[cell.layer].append(cell)
    for column in columns:
        column.sort(key=lambda cell: cell.item.band)
        _rank(column)
    return columns


def _rank(column: list[_Cell]) -> None:
    for index, cell in enumerate(column):
        cell.rank = index / max(len(column) - 1, 1)


def _order(columns: list[list[_Cell]]) -> None:
    """Sort each layer, band by band, by the mean of what its cells are linked to; keep what crosses least."""
    best, fewest = [list(column) for column in columns], _crossings(columns)
    for sweep in range(_SWEEPS):
        is_forward = sweep % 2 == 0
        for column in columns if is_forward else reversed(columns):
            for cell in column:
                linked = (cell.before if is_forward else cell.after) or cell.neighbours
                cell.y = sum(one.rank for one in linked) / len(linked) if linked else cell.rank
            column.sort(key=lambda cell: (cell.item.band, cell.y))
            _rank(column)
        if (crossings := _crossings(columns)) < fewest:
            best, fewest = [list(column) for column in columns], crossings
    for column, ordered in zip(columns, best, strict=True):
        column[:] = ordered


def _crossings(columns: list[list[_Cell]]) -> int:
    count = 0
    for column, following in pairwise(columns):
        position = {cell: index for index, cell in enumerate(following)}
        links = [(index, position[one]) for index, cell in enumerate(column) for one in cell.after]
        count += sum(a < c and b > d for index, (a, b) in enumerate(links) for c, d in links[index + 1 :])
    return count


def _parts(column: list[_Cell]) -> dict[int, list[_Cell]]:
    """Return the cells of a layer by band, in their order."""
    parts: dict[int, list[_Cell]] = {}
    for cell in column:
        parts.setdefault(cell.item.band, []).append(cell)
    return parts


def _bands(columns: list[list[_Cell]]) -> dict[int, tuple[float, float]]:
    """Return the upper and the lower end of the rows of each band, and put the cells there."""
    heights: dict[int, float] = {}
    for column in columns:
        for band, cells in _parts(column).items():
            height = sum(cell.item.height for cell in cells) + ROW_GAP * (len(cells) - 1)
            heights[band] = max(heights.get(band, 0.0), height)
    bands, y = {}, MARGIN
    for band in sorted(heights):
        top = y + BAND_HEAD
        bands[band] = (top, top + heights[band])
        y = top + heights[band] + BAND_EDGE + BAND_GAP
    for column in columns:
        for band, cells in _parts(column).items():
            _place(cells, [sum(bands[band]) / 2] * len(cells), *bands[band])
    return bands


def _settle(columns: list[list[_Cell]], bands: Mapping[int, tuple[float, float]]) -> None:
    """Move all cells towards what they are linked to, again and again, without changing their order."""
    for turn in range(_SETTLINGS):
        for column in columns if turn % 2 == 0 else reversed(columns):
            for band, cells in _parts(column).items():
                wanted = [_wanted(cell) for cell in cells]
                _place(cells, wanted, *bands[band])


def _wanted(cell: _Cell) -> float:
    linked = cell.neighbours
    return sum(one.y for one in linked) / len(linked) if linked else cell.y


def _place(cells: list[_Cell], wanted: list[float], top: float, bottom: float) -> None:
    """Give cells of one layer and band places near to those wanted, in order and without overlap."""
    down = _packed([cell.item.height for cell in cells], wanted, top, bottom)
    turned = _packed([cell.item.height for cell in reversed(cells)], [-y for y in reversed(wanted)], -bottom, -top)
    for cell, one, other in zip(cells, down, reversed(turned), strict=True):
        cell.y = (one - other) / 2  # either way keeps the distances, so their mean does


def _packed(heights: list[float], wanted: list[float], top: float, bottom: float) -> list[float]:
    """Return middles from the top down, each at its wanted place or below, and all above the bottom."""
    places: list[float] = []
    edge = top
    for height, y in zip(heights, wanted, strict=True):
        places.append(max(y, edge + height / 2))
        edge = places[-1] + height / 2 + ROW_GAP
    edge = bottom
    for index in range(len(places) - 1, -1, -1):
        places[index] = min(places[index], edge - heights[index] / 2)
        edge = places[index] - heights[index] / 2 - ROW_GAP
    return places


def _drawn(
    cells: Mapping[str, _Cell],
    chains: Mapping[Edge, list[_Cell]],
    forward: Mapping[Edge, Edge],
    columns: list[list[_Cell]],
    bands: Mapping[int, tuple[float, float]],
) -> Layout:
    lefts, widths = _across(columns)
    places = {
        key: Rect(
            lefts[cell.layer] + (widths[cell.layer] - cell.item.width) / 2,
            cell.y - cell.item.height / 2,
            cell.item.width,
            cell.item.height,
        )
        for key, cell in cells.items()
    }
    tips = _tips(chains)
    paths = {}
    for edge, chain in chains.items():
        first, last = places[forward[edge][0]], places[forward[edge][1]]
        middle = [
            (x, cell.y) for cell in chain[1:-1] for x in (lefts[cell.layer], lefts[cell.layer] + widths[cell.layer])
        ]
        points = ((first.x + first.width, tips[edge][0]), *middle, (last.x, tips[edge][1]))
        paths[edge] = points if forward[edge] == edge else points[::-1]
    members: dict[int, list[Rect]] = {}
    for key, cell in cells.items():
        members.setdefault(cell.item.band, []).append(places[key])
    rects = {band: _around(members[band], *ends) for band, ends in bands.items()}
    width = max((rect.x + rect.width for rect in rects.values()), default=0.0) + MARGIN
    height = max((rect.y + rect.height for rect in rects.values()), default=0.0) + MARGIN
    return Layout(places, paths, rects, width, height)


def _across(columns: list[list[_Cell]]) -> tuple[list[float], list[float]]:
    """Return the left end and the width of each layer; between layers there is more room for more lines."""
    lefts, widths, x = [], [], MARGIN + BAND_EDGE
    for column in columns:
        lefts.append(x)
        widths.append(max((cell.item.width for cell in column), default=0.0))
        x += widths[-1] + COLUMN_GAP + min(2.0 * sum(len(cell.after) for cell in column), MOST_LANES)
    return lefts, widths


def _tips(chains: Mapping[Edge, list[_Cell]]) -> dict[Edge, tuple[float, float]]:
    """Return how high each path leaves its first and reaches its last cell: side by side, ordered by where they go."""
    sides: dict[tuple[_Cell, int], list[Edge]] = {}
    for edge, chain in chains.items():
        sides.setdefault((chain[0], _SECOND), []).append(edge)
        sides.setdefault((chain[-1], _LAST_BUT_ONE), []).append(edge)
    heights: dict[tuple[Edge, int], float] = {}
    for (cell, side), edges in sides.items():
        edges.sort(key=lambda edge: chains[edge][side].y)
        step = min(9.0, (cell.item.height - 8.0) / len(edges))
        for index, edge in enumerate(edges):
            heights[edge, side] = cell.y + (index - (len(edges) - 1) / 2) * step
    return {edge: (heights[edge, _SECOND], heights[edge, _LAST_BUT_ONE]) for edge in chains}


def _around(rects: Sequence[Rect], top: float, bottom: float) -> Rect:
    """Return the rectangle of a band round what is in it."""
    left = min(rect.x for rect in rects) - BAND_EDGE
    right = max(rect.x + rect.width for rect in rects) + BAND_EDGE
    return Rect(left, top - BAND_HEAD, right - left, bottom - top + BAND_HEAD + BAND_EDGE)
