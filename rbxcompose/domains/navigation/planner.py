"""Ways through costs: the cheapest one on the grid, made straight where that costs nothing."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

from rbxcompose.base.arrays import Array, Bools, Ints32, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Pose2, wrap_angle
from rbxcompose.base.units import LENGTH, format_quantity
from rbxcompose.domains.navigation.costs import DEAREST, INSCRIBED, LETHAL, NO_INFORMATION, LayeredCosts
from rbxcompose.domains.navigation.lattice import margin, search
from rbxcompose.domains.worlds.shapes import PolygonFootprint

NEUTRAL = 50.0  # cost of a cell far from all obstacles
UNKNOWN_COST = 100.0  # of a cell of which nothing is known
TOUCHED = 1000.0  # of a cell in which the robot touches something
LARGE = 200_000  # cells of a grid that is searched roughly first
ROUGH = 8  # cells of such a grid that become one
SAMPLES = 4  # of a straight line in each cell
ASIDE = 0.02  # [m] to everything that a robot which is no circle keeps on a straight line: it may get a little off
CORRIDOR = 1  # rough cells to each side of the rough way in which the exact one is searched

Cell = tuple[int, int]


class NoPathError(Exception):
    """Raised if there is no way; `nearest` is how near the robot could get [m], infinite if that is not known.

    One that `is_final` will not go away while the map is the same; one that `is_occupied` is because of something at
    the goal that the map does not know.
    """

    def __init__(
        self, reason: str, nearest: float = math.inf, *, is_final: bool = False, is_occupied: bool = False
    ) -> None:
        super().__init__(reason)
        self.nearest, self.is_final, self.is_occupied = nearest, is_final, is_occupied


@dataclass(frozen=True, slots=True)
class PlannedPath:
    """A way through `map`: poses about a cell apart, each looking along it, the last one as the goal does."""

    poses: tuple[Pose2, ...]

    def is_blocked(self, pose: Pose2, costs: LayeredCosts) -> bool:
        """Return whether something is on the rest of it, which a robot comes to with the heading of the pose before."""
        near = min(range(len(self.poses)), key=lambda index: self.poses[index].distance(pose))
        rest = self.poses[near:]
        arrivals = [Pose2(after.x, after.y, before.heading) for before, after in pairwise(rest)]
        return costs.clear_at(*rest, *arrivals) < 0


def plan(costs: LayeredCosts, start: Pose2, goal: Pose2, tolerance: float) -> PlannedPath:
    """Return the cheapest way from a pose to another in `map`, or to a place within `tolerance` [m] of it.

    Raises:
        NoPathError: if there is none, with the reason.
    """
    weights = _weights(costs)
    first, last = costs.cell_of(start.x, start.y), costs.cell_of(goal.x, goal.y)
    if not _is_in(first, weights):
        raise NoPathError("the robot is outside of the map")
    if not _is_in(last, weights):
        raise NoPathError("the goal is outside of the map", is_final=True)
    if weights[first] < 0:
        if not (weights > 0).any() and not costs.has_room:
            size = f"it covers a circle with a radius of {format_quantity(costs.settings.radius, LENGTH)}"
            raise NoPathError(f"the robot fits nowhere on the map: {size}", is_final=True)
        _open_around(costs, weights, first)
    if costs.settings.outline is not None:
        return _plan_for(costs.settings.outline, costs, weights, start, goal, tolerance)
    is_open = weights[last] > 0
    cells = _search(weights, first, last) if is_open else None
    if cells is None:
        reached = _reached(weights, first)
        last, away = _nearest(reached, last, costs.grid.resolution)
        if away > tolerance:
            words = "no way leads to the goal" if is_open else _at_goal(costs, goal)
            is_wall = costs.is_wall(goal.x, goal.y)
            raise NoPathError(words, away, is_final=is_wall, is_occupied=not (is_open or is_wall))
        cells = _search(weights, first, last)
        if cells is None:
            raise NoPathError("no way leads to the goal", away)
    return _smoothed(costs, weights, cells, start, goal)


def _at_goal(costs: LayeredCosts, goal: Pose2) -> str:
    """Return what is at a goal, in words."""
    zone = costs.zone_at(goal.x, goal.y)
    return f"the zone '{zone}' keeps the robot from the goal" if zone else "an obstacle is at the goal"


def _plan_for(
    outline: PolygonFootprint, costs: LayeredCosts, weights: Array, start: Pose2, goal: Pose2, tolerance: float
) -> PlannedPath:
    """Return the way of a robot that is no circle, on which there is room for it at each heading that it has there."""
    first, last = costs.cell_of(start.x, start.y), costs.cell_of(goal.x, goal.y)
    # A circle keeps off by the side of a cell more. Where the outline fits, there may be less.
    spare = costs.away > costs.settings.radius + margin(costs.grid.resolution)
    weights[spare & (costs.values == INSCRIBED)] = NEUTRAL + DEAREST
    found = None
    if weights.size > LARGE and (corridor := _corridor(weights, first, last)) is not None:
        found = search(costs, np.where(corridor, weights, -1.0), outline, start, goal)
    if found is None or found.misses:
        found = search(costs, weights, outline, start, goal)
    if (away := found.misses * costs.grid.resolution) > tolerance:
        words = "no way leads to the goal"
        if weights[last] < 0:
            words = _at_goal(costs, goal)
        elif costs.clear_at(goal) < 0:
            words = "with its heading, the robot does not fit at the goal"
        raise NoPathError(words, away, is_final=costs.is_wall(goal.x, goal.y))
    end = _end_with_room(costs, found.cells, start, goal)
    return _smoothed(costs, weights, found.cells, start, end if end.distance(goal) <= tolerance else goal)


def _end_with_room(costs: LayeredCosts, cells: list[Cell], start: Pose2, goal: Pose2) -> Pose2:
    """Return the goal, or the middle of its cell if there is room for the last step of the way only to that.

    The step is short, so its heading depends much on where in the cell it ends.
    """
    if len(cells) == 1 or costs.cell_of(goal.x, goal.y) != cells[-1]:
        return goal
    places = costs.grid.to_points(np.array([(column + 0.5, row + 0.5) for row, column in cells[-3:]]))
    if len(cells) <= len(places):
        places[0] = start.x, start.y
    columns, rows = np.diff(places[:-1], axis=0).T
    before = math.atan2(rows[-1], columns[-1]) if rows.size else start.heading
    if _has_room(costs, places[-2], np.array((goal.x, goal.y)), before, goal.heading):
        return goal
    x, y = places[-1].tolist()
    return Pose2(x, y, goal.heading)


def _weights(costs: LayeredCosts) -> Array:
    """Return what it costs to cross each cell; -1 where the robot must not be."""
    table = NEUTRAL + np.arange(256.0)
    table[[LETHAL, INSCRIBED]] = -1.0
    table[NO_INFORMATION] = UNKNOWN_COST if costs.settings.unknown_is_free else -1.0
    return table.take(costs.values)


def _open_around(costs: LayeredCosts, weights: Array, at: Cell) -> None:
    """Let a robot that touches something leave it, on the shortest way: through what is near, but not nearer to it."""
    side = costs.grid.resolution
    reach = math.ceil(costs.settings.radius / side) + 1
    near = tuple(slice(max(0, index - reach), index + reach + 1) for index in at)
    weights[near][(costs.values[near] == INSCRIBED) & (costs.away[near] >= costs.away[at] - side)] = TOUCHED
    weights[at] = TOUCHED


def _is_in(cell: Cell, grid: Array) -> bool:
    return all(0 <= index < size for index, size in zip(cell, grid.shape, strict=True))


def _search(weights: Array, first: Cell, last: Cell) -> list[Cell] | None:
    """Return the cells of the cheapest way, None if there is none; a large grid is searched roughly first."""
    if weights.size > LARGE and (corridor := _corridor(weights, first, last)) is not None:
        found = _exact(np.where(corridor, weights, -1.0), first, last)
        if found is not None:
            return found
    return _exact(weights, first, last)


def _exact(weights: Array, first: Cell, last: Cell) -> list[Cell] | None:
    """Return the cells of the cheapest way from one to another of eight neighbours, None if there is none."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import dijkstra

    around = np.pad(weights, 1, constant_values=-1.0)
    flat, width = around.ravel(), around.shape[1]
    free = np.flatnonzero(flat > 0)
    number = np.full(flat.size, -1, np.int32)
    number[free] = np.arange(free.size)
    starts: list[Ints32] = []
    ends: list[Ints32] = []
    costs: list[Array] = []
    for step, length in ((1, 1.0), (width, 1.0), (width + 1, math.sqrt(2)), (width - 1, math.sqrt(2))):
        open_ends = number[free + step] >= 0
        here = free[open_ends]
        starts.append(number[here])
        ends.append(number[here + step])
        costs.append((flat[here] + flat[here + step]) * (length / 2))
    edges = np.concatenate(costs), (np.concatenate(starts), np.concatenate(ends))
    graph = csr_matrix(edges, shape=(free.size, free.size))
    begin, end = (number[(row + 1) * width + column + 1] for row, column in (first, last))
    away, before = dijkstra(graph, directed=False, indices=begin, return_predecessors=True)
    if not math.isfinite(away[end]):
        return None
    way = [int(end)]
    while way[-1] != begin:
        way.append(int(before[way[-1]]))
    return [(int(cell) // width - 1, int(cell) % width - 1) for cell in free[way[::-1]]]


def _corridor(weights: Array, first: Cell, last: Cell) -> Bools | None:
    """Return which cells are near to the cheapest way on a grid of fewer cells."""
    rows, columns = (math.ceil(size / ROUGH) for size in weights.shape)
    padded = np.full((rows * ROUGH, columns * ROUGH), -1.0)
    padded[: weights.shape[0], : weights.shape[1]] = weights
    blocks = padded.reshape(rows, ROUGH, columns, ROUGH)
    # Rows first: numpy adds and compares them as a whole.
    free = (blocks > 0).sum(1, np.int32).sum(2)
    rough = np.where(2 * free > ROUGH * ROUGH, blocks.max(1).max(2), -1.0)  # a rough cell stands for its free part
    ends = tuple((row // ROUGH, column // ROUGH) for row, column in (first, last))
    for end in ends:
        rough[end] = max(rough[end], NEUTRAL)
    way = _exact(rough, *ends)
    if way is None:
        return None
    near = np.zeros((rows, columns), bool)
    for row, column in way:
        near[max(0, row - CORRIDOR) : row + CORRIDOR + 1, max(0, column - CORRIDOR) : column + CORRIDOR + 1] = True
    return near.repeat(ROUGH, 0).repeat(ROUGH, 1)[: weights.shape[0], : weights.shape[1]]


def _reached(weights: Array, first: Cell) -> Bools:
    """Return the cells that the robot can come to."""
    from scipy.ndimage import label

    areas, _ = label(weights > 0, np.ones((3, 3)))
    return np.asarray(areas == areas[first])


def _nearest(cells: Bools, to: Cell, side: float) -> tuple[Cell, float]:
    """Return the cell that is nearest to another one, and its distance [m]."""
    rows, columns = np.nonzero(cells)
    away = np.hypot(rows - to[0], columns - to[1])
    best = int(away.argmin())
    return (int(rows[best]), int(columns[best])), float(away[best]) * side


def _smoothed(costs: LayeredCosts, weights: Array, cells: list[Cell], start: Pose2, goal: Pose2) -> PlannedPath:
    """Return the way without corners that save nothing, with poses about a cell apart."""
    points = np.array([(column + 0.5, row + 0.5) for row, column in cells])  # (column, row)
    ends_there = costs.cell_of(goal.x, goal.y) == cells[-1]
    rest = costs.grid.to_cells([(goal.x, goal.y)]) if ends_there else points[-1:]
    outline = costs.settings.outline
    if outline is not None:  # it may have no room to turn to the middles of the first cell and the last one
        points = points[1:-1] if ends_there else points[1:]
    points = np.concatenate((costs.grid.to_cells([(start.x, start.y)]), points, rest))
    places, turns = costs.grid.to_points(points), [0]
    headings = np.arctan2(*np.diff(places, axis=0).T[::-1])
    headings = np.concatenate(((start.heading,), headings, (goal.heading,)))

    def may_skip(at: int, to: int) -> bool:
        if not _is_as_cheap(weights, points[at : to + 1]):
            return False
        return outline is None or _has_room(costs, places[at], places[to], headings[at], headings[to + 1])

    while turns[-1] < len(points) - 1:
        turns.append(_furthest(may_skip, len(points), turns[-1]))
    corners = costs.grid.to_points(points[turns])
    poses: list[Pose2] = []
    for before, after in pairwise(corners):
        count = round(math.dist(before, after) / costs.grid.resolution)
        heading = math.atan2(after[1] - before[1], after[0] - before[0])
        places = before + (after - before) * np.arange(count)[:, None] / max(1, count)
        poses += (Pose2(x, y, heading) for x, y in places.tolist())
    first = poses[0] if poses else Pose2(start.x, start.y, goal.heading)
    x, y = corners[-1].tolist()
    return PlannedPath((first, *poses[1:], Pose2(x, y, goal.heading)))


def _furthest(may_skip: Callable[[int, int], bool], count: int, at: int) -> int:
    """Return the furthest of `count` places on a way to which a straight line may lead from one of them."""
    reach, step = at + 1, 2
    while at + step < count and may_skip(at, at + step):
        reach, step = at + step, 2 * step
    high = min(count, at + step)
    while high - reach > 1:
        middle = (reach + high) // 2
        if may_skip(at, middle):
            reach = middle
        else:
            high = middle
    return reach


def _has_room(costs: LayeredCosts, begin: Array, end: Array, before: float, after: float) -> bool:
    """Return whether there is room for a robot on a line in `map` [m], and to turn to it and from it [rad]."""
    (x, y), heading = (end - begin).tolist(), math.atan2(*(end - begin)[::-1])
    count = math.ceil(math.hypot(x, y) / costs.grid.resolution)
    parts = np.linspace(0.0, 1.0, count + 1)[:, None]
    poses = [np.column_stack((begin + (end - begin) * parts, np.full(count + 1, heading)))]
    for place, turn in ((begin, wrap_angle(before - heading)), (end, wrap_angle(after - heading))):
        count = math.ceil(abs(turn) * costs.settings.reach / costs.grid.resolution)
        turned = heading + turn * np.linspace(0.0, 1.0, count + 1)
        poses.append(np.column_stack((np.broadcast_to(place, (count + 1, 2)), turned)))
    return costs.clearance(np.concatenate(poses)) >= ASIDE


def _is_as_cheap(weights: Array, points: Array) -> bool:
    """Return whether the straight line between the ends of a way crosses nothing dearer than the way does."""
    first, last = points[0], points[-1]
    count = math.ceil(SAMPLES * float(np.abs(last - first).max())) + 1
    line = first + (last - first) * np.linspace(0.0, 1.0, count)[:, None]
    crossed, along = (weights[cells[:, 1], cells[:, 0]] for cells in (line.astype(int), points.astype(int)))
    return bool(crossed.min() > 0 and crossed.max() <= max(along.max(), NEUTRAL))
