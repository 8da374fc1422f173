"""Ways of a robot that is no circle, for which its heading counts where something is near.

A state lattice (M. Pivtoraiko, R. Knepper and A. Kelly, Differentially Constrained Mobile Robot Motion Planning in
State Lattices, Journal of Field Robotics 26, 2009) of a base that drives ahead and turns on the spot: where nothing is
near, a state is a cell, elsewhere a cell and one of sixteen headings. In a state, and halfway in a turn, nothing
is within its outline and a little around it.

Nav2's Smac planners do the same for the 2D case with a circle, for cars with curves (Hybrid-A*) and with motions from a
file (State Lattice); this one needs no motions but those of its grid, and no heading where there is room for all.
"""

from __future__ import annotations

import math

from rbxcompose.base.arrays import Array, Bools, Ints32, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Pose2
from rbxcompose.domains.navigation.costs import LayeredCosts
from rbxcompose.domains.worlds.contact import outside_polygon
from rbxcompose.domains.worlds.shapes import PolygonFootprint

_QUARTER = ((0, 1), (1, 2), (1, 1), (2, 1))
STEPS = tuple(  # (rows, columns) to where each heading leads, turning left
    step
    for up, right in ((1, 0), (0, 1), (-1, 0), (0, -1))
    for step in [(row * up + column * right, column * up - row * right) for row, column in _QUARTER]
)
HEADINGS = len(STEPS)
ANGLES = np.unwrap([math.atan2(up, right) for up, right in STEPS])  # [rad]
TURN = 50.0  # cost of a turn from one heading to the next: that of a cell where nothing is near
KEPT = 0.012  # [m] to everything: a little more than those who follow the way
TOUCHED = 1000.0  # of a state in which the robot touches something

Cell = tuple[int, int]


@dataclass(frozen=True, slots=True)
class LatticeWay:
    """The cells of the cheapest way, and how far its end is from the goal, counted in cells: infinite for no way."""

    cells: list[Cell]
    misses: float


def search(costs: LayeredCosts, weights: Array, outline: PolygonFootprint, start: Pose2, goal: Pose2) -> LatticeWay:
    """Return the cheapest way to the cell and heading of a goal, or to the state of its heading that is nearest to it.

    `weights` (rows, columns) are what it costs to cross each cell, -1 where the robot must not be at any heading. A
    robot that touches something at the start may leave it.
    """
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import dijkstra

    states = _States(costs, weights, outline, start)
    first, last = (costs.cell_of(pose.x, pose.y) for pose in (start, goal))
    begin = states.number_at(first, start.heading)
    ends = states.numbers[states.heading_at(goal.heading)]
    graph = csr_matrix(states.edges(), shape=(states.count, states.count))
    spent, before = dijkstra(graph, indices=begin, return_predecessors=True)
    is_end = (ends >= 0) & np.isfinite(spent[ends])
    rows, columns = np.divmod(np.flatnonzero(is_end), states.width)
    if not rows.size:
        return LatticeWay([], math.inf)
    misses = np.hypot(rows - 1 - last[0], columns - 1 - last[1])
    best = int(misses.argmin())
    way = [int(ends[rows[best] * states.width + columns[best]])]
    while way[-1] != begin:
        way.append(int(before[way[-1]]))
    rows, columns = np.divmod(states.cells[way[::-1]], states.width)
    cells = list(zip((rows - 1).tolist(), (columns - 1).tolist(), strict=True))
    # States of one cell in a row are turns.
    return LatticeWay([cell for at, cell in enumerate(cells) if not at or cell != cells[at - 1]], float(misses[best]))


def margin(side: float) -> float:
    """Return how far the middle of an obstacle's cell is from a robot at least, so that its corners are KEPT [m]."""
    return math.sqrt(0.5) * side + KEPT


class _States:
    """The states of a map, numbered; its cells are counted with a margin of one, row by row."""

    def __init__(self, costs: LayeredCosts, weights: Array, outline: PolygonFootprint, start: Pose2) -> None:
        self._turned = costs.grid.origin.heading
        around = np.pad(weights, 1, constant_values=-1.0)
        self.width, self._weights = around.shape[1], around.ravel()
        side = costs.grid.resolution
        tight = np.pad(costs.away <= outline.reach + margin(side), 1).ravel() & (self._weights > 0)
        blocked = _blocked(costs, outline, tight.reshape(around.shape))
        first = costs.cell_of(start.x, start.y)
        at = (first[0] + 1) * self.width + first[1] + 1
        places = np.flatnonzero(tight)
        self._touches = np.zeros((HEADINGS, places.size), bool)
        here = np.searchsorted(places, at)
        if tight[at] and blocked[2 * self.heading_at(start.heading), here]:
            rows, columns = np.divmod(places, self.width)
            near = np.hypot(rows - 1 - first[0], columns - 1 - first[1]) * side <= outline.reach
            self._touches[:, near] = blocked[::2, near]
            blocked[:, near] = False
        free = ~blocked[::2]
        opened = np.flatnonzero((self._weights > 0) & ~tight)
        self.numbers = np.full((HEADINGS, self._weights.size), -1, np.int32)
        """(headings, cells): the number of the state of each cell at each heading, -1 if the robot must not be so."""
        self.numbers[:, opened] = np.arange(opened.size)
        heading, place = np.nonzero(free)
        self.numbers[heading, places[place]] = opened.size + np.arange(place.size)
        self.cells = np.concatenate((opened, places[place]))
        """(states,): the cell of each."""
        self.count = self.cells.size
        self._costs = self._weights[self.cells]
        self._costs[opened.size :] += TOUCHED * self._touches[heading, place]
        self._places, self._turns = places, ~blocked[1::2]

    def heading_at(self, heading: float) -> int:
        """Return the number of the heading that is nearest to one in `map` [rad]."""
        return int(np.cos(ANGLES - (heading - self._turned)).argmax())

    def number_at(self, cell: Cell, heading: float) -> int:
        """Return the number of the state that is nearest to a heading in a cell."""
        return int(self.numbers[self.heading_at(heading), (cell[0] + 1) * self.width + cell[1] + 1])

    def edges(self) -> tuple[Array, tuple[Ints32, Ints32]]:
        """Return what each motion costs, and the states between which it leads."""
        found: list[tuple[Array, Ints32, Ints32]] = []
        for heading, (up, right) in enumerate(STEPS):
            numbers, step = self.numbers[heading], up * self.width + right
            cells = np.flatnonzero(numbers >= 0)
            cells = cells[numbers[cells + step] >= 0]
            here, there = numbers[cells], numbers[cells + step]
            found.append(((self._costs[here] + self._costs[there]) * (math.hypot(up, right) / 2), here, there))
            here, there = numbers[self._places], self.numbers[(heading + 1) % HEADINGS][self._places]
            both = (here >= 0) & (there >= 0) & self._turns[heading]
            here, there = here[both], there[both]
            found += [(np.full(here.size, TURN), here, there), (np.full(here.size, TURN), there, here)]
        costs, here, there = (np.concatenate(part) for part in zip(*found, strict=True))
        return costs, (here, there)


def _blocked(costs: LayeredCosts, outline: PolygonFootprint, tight: Bools) -> Bools:
    """Return whether the robot comes too near to something in cells, at headings and halfway between them:
    (2 headings, cells).

    `tight` are those cells, with a margin of one.
    """
    side = costs.grid.resolution
    reach = math.ceil((outline.reach + margin(side)) / side) + 1
    solid = np.pad(costs.solid, reach)
    width, before = solid.shape[1], np.concatenate(((0,), np.cumsum(solid, dtype=np.int32)))
    rows, columns = np.nonzero(tight)
    middles = (rows - 1 + reach) * width + columns - 1 + reach
    steps = np.arange(-reach, reach + 1)
    places = np.stack(np.meshgrid(steps, steps), -1) * side  # by row and column
    found = np.zeros((2 * HEADINGS, middles.size), bool)
    halfway = (ANGLES + np.append(ANGLES[1:], math.tau)) / 2
    for turn, angle in enumerate(np.stack((ANGLES, halfway), -1).ravel().tolist()):
        cos, sin = math.cos(angle), math.sin(angle)
        covered = outside_polygon(outline, places @ np.array([[cos, -sin], [sin, cos]])) <= margin(side)
        for up, row in zip(steps.tolist(), covered, strict=True):
            if row.any():  # it covers columns that follow each other
                begin, end = middles + up * width + steps[row][[0], None], middles + up * width + steps[row][[-1], None]
                found[turn] |= (before[end + 1] > before[begin])[0]
    return found
