"""Trees of spheres that cover shapes: coarse ones above finer ones, for tests of collisions in compiled code.

**What is promised:** each sphere of a tree contains all of the shape that the spheres below it are for. A triangle is
in a sphere if its corners are, since spheres are convex; so triangles of a mesh are covered by arithmetic, not by
samples, and so are the cells into which a box or a cylinder is cut. Boxes, cylinders and spheres are covered as solids,
meshes as the surfaces that coal examines, too. Every radius is greater by `SLACK`, which is far more than rounding.

Source of the smallest balls: Badoiu and Clarkson, Smaller core-sets for balls (2003).
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from rbxcompose.dataclass import dataclass

Array = NDArray[np.float64]
Whole = NDArray[np.int64]
Ball = tuple[Array, float]
C = TypeVar("C")

SLACK = 1e-6  # [m]
LEAVES = 96  # spheres at the finest level of one shape, at most
FINEST = 0.004  # [m], a sphere that is smaller is not divided
AT_EDGE = 0.01  # of a cell from its edge, within which rounding decides in which cell a point is
SEGMENTS = 12  # sides of triangles that are longer than this part of the whole are halved first
MOST_TRIANGLES = 60_000  # of a mesh whose long triangles are halved
STEPS = 12  # towards the middle of the smallest ball


@dataclass(frozen=True, slots=True)
class SphereTree:
    """Spheres: `centres` [m] of shape (k, 3), `radii` [m] of shape (k,); the first one covers all.

    `children` of shape (k,) is the first of two spheres that together cover what a sphere is for; -1 if there are none.
    """

    centres: Array
    radii: Array
    children: Whole

    @property
    def leaves(self) -> tuple[Array, Array]:
        """Return the centres and radii of the finest level."""
        there = (self.children < 0) & (self.radii >= 0.0)
        return self.centres[there], self.radii[there]


NOTHING = SphereTree(np.zeros((1, 3)), np.full(1, -math.inf), np.full(1, -1))


def ball_tree(radius: float) -> SphereTree:
    """Return a sphere about the origin as a tree."""
    return SphereTree(np.zeros((1, 3)), np.array([radius + SLACK]), np.array([-1]))


def box_tree(size: Sequence[float]) -> SphereTree:
    """Return the tree of a solid box about the origin, of three lengths [m]."""
    half = np.array(size[:3]) / 2
    return _tree((-half, half), _box_ball, _halves)


def cylinder_tree(radius: float, length: float) -> SphereTree:
    """Return the tree of a solid cylinder about the origin along z [m]."""
    half = np.array((radius, radius, length / 2))

    def ball(cell: tuple[Array, Array]) -> Ball:
        """Return the smaller one of a ball about the cell and one about the slice of the cylinder that it is in."""
        low, high = cell
        slice_ = (np.array((0.0, 0.0, (low[2] + high[2]) / 2)), math.hypot(radius, (high[2] - low[2]) / 2))
        return min(_box_ball(cell), slice_, key=lambda one: one[1])

    def parts(cell: tuple[Array, Array]) -> list[tuple[Array, Array]]:
        halves = _halves(cell)
        inside = [one for one in halves if math.hypot(*np.clip(0.0, one[0][:2], one[1][:2]).tolist()) <= radius]
        return parts(inside[0]) if len(inside) == 1 else inside

    return _tree((-half, half), ball, parts)


def mesh_tree(triangles: Array) -> SphereTree:
    """Return the tree of the surface of a mesh, whose triangles have the shape (t, 3, 3) [m]."""
    if not len(triangles):
        return NOTHING
    extent = float(np.max(np.ptp(triangles.reshape(-1, 3), axis=0)))
    return _tree(_halved_sides(triangles, extent / SEGMENTS), lambda some: _ball(some.reshape(-1, 3)), _parted)


def cells_tree(points: Array, side: float) -> SphereTree:
    """Return the tree of the cells of a grid about the origin that points are in, of shape (n, 3) [m]; a leaf for each.

    Cells are those of OctoMap, from 0 to `side` and so on. It rounds points, so that one at the edge of a cell may be
    in the next one: its leaf covers both. They are put in the order of a curve that keeps near ones together, and
    joined two by two.
    """
    steps = points / side
    is_clear = np.all(np.abs(steps - np.round(steps)) > AT_EDGE, axis=1)
    middles = np.where(is_clear[:, None], (np.floor(steps) + 0.5) * side, points)
    order = np.argsort(_interleaved(np.floor(steps - steps.min(axis=0)).astype(np.uint64)))
    size = 1 << max(0, (len(middles) - 1).bit_length())
    centres, radii = np.zeros((size, 3)), np.full(size, -math.inf)  # what is beyond the cells is nothing
    centres[: len(order)] = middles[order]
    radii[: len(order)] = np.where(is_clear, 0.5, 1.0)[order] * (side * math.sqrt(3.0)) + SLACK
    levels, children = [(centres, radii)], [np.full(size, -1)]
    while len(levels[0][1]) > 1:
        levels.insert(0, _joined(*levels[0]))
        children.insert(0, 2 * np.arange(len(levels[0][1])))
    starts = np.cumsum([0, *(len(one) for _, one in levels)])
    found = [one if one[0] < 0 else one + start for one, start in zip(children, starts[1:], strict=True)]
    return SphereTree(
        np.concatenate([one for one, _ in levels]), np.concatenate([one for _, one in levels]), np.concatenate(found)
    )


def _tree(whole: C, ball: Callable[[C], Ball], parts: Callable[[C], Sequence[C]]) -> SphereTree:
    """Divide the largest ball again and again."""
    balls, children = [ball(whole)], [-1]
    waiting = [(-balls[0][1], 0, whole)]
    leaves = 1
    while waiting and leaves < LEAVES:
        radius, index, cell = heapq.heappop(waiting)
        if -radius <= FINEST or len(both := parts(cell)) < 2:
            continue
        children[index] = len(balls)
        for one in both:
            found = ball(one)
            heapq.heappush(waiting, (-found[1], len(balls), one))
            balls.append(found)
            children.append(-1)
        leaves += 1
    radii = np.array([one for _, one in balls]) + SLACK
    return SphereTree(np.array([one for one, _ in balls]), radii, np.array(children))


def _box_ball(cell: tuple[Array, Array]) -> Ball:
    low, high = cell
    return (low + high) / 2, math.hypot(*((high - low) / 2).tolist())


def _halves(cell: tuple[Array, Array]) -> list[tuple[Array, Array]]:
    """Return both halves of a cell along its longest side."""
    low, high = cell
    axis = int(np.argmax(high - low))
    upper, lower = high.copy(), low.copy()
    upper[axis] = lower[axis] = (low[axis] + high[axis]) / 2
    return [(low, upper), (lower, high)]


def _ball(points: Array) -> Ball:
    """Return a ball about points that is little larger than the smallest one."""
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    best, least = centre, math.inf
    for step in range(1, STEPS + 1):
        away = np.linalg.norm(points - centre, axis=1)
        farthest = int(np.argmax(away))
        if away[farthest] < least:
            best, least = centre, float(away[farthest])
        centre = centre + (points[farthest] - centre) / (step + 1)
    return best, least


def _parted(triangles: Array) -> list[Array]:
    """Return both halves of triangles, across the direction in which they reach farthest."""
    if len(triangles) < 2:
        return []
    middles = triangles.mean(axis=1)
    _, axes = np.linalg.eigh(np.cov(middles.T))
    along = middles @ axes[:, -1]
    order = np.argsort(along, kind="stable")
    half = len(order) // 2
    return [triangles[order[:half]], triangles[order[half:]]]


def _halved_sides(triangles: Array, longest: float) -> Array:
    """Return the same surface; triangles with a side that is too long are halved across it."""
    done: list[Array] = []
    rest = triangles
    while len(rest) and sum(len(one) for one in done) + len(rest) < MOST_TRIANGLES:
        sides = np.linalg.norm(rest - np.roll(rest, -1, axis=1), axis=2)
        is_long = sides.max(axis=1) > longest
        done.append(rest[~is_long])
        rest, which = rest[is_long], sides[is_long].argmax(axis=1)
        each = np.arange(len(rest))
        first, second, third = (rest[each, (which + turn) % 3] for turn in range(3))
        middle = (first + second) / 2
        rest = np.concatenate((np.stack((first, middle, third), axis=1), np.stack((middle, second, third), axis=1)))
    return np.concatenate((*done, rest))


def _interleaved(cells: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Return the bits of three numbers of at most 21 bits, in turn (Morton's code)."""
    found = np.zeros(len(cells), dtype=np.uint64)
    for bit in range(21):
        for axis in range(3):
            found |= (cells[:, axis] >> np.uint64(bit) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return found


def _joined(centres: Array, radii: Array) -> tuple[Array, Array]:
    """Return balls about each two balls; a radius of -inf is nothing."""
    (one, other), (small, large) = (centres[::2], centres[1::2]), (radii[::2], radii[1::2])
    apart = np.linalg.norm(other - one, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        radius = (apart + small + large) / 2
        share = np.where(apart > 0.0, (radius - small) / apart, 0.0)
    holds, held = (small >= apart + large) | ~np.isfinite(large), large >= apart + small
    middle = one + (other - one) * np.clip(np.nan_to_num(share), 0.0, 1.0)[:, None]
    centre = np.where(holds[:, None], one, np.where(held[:, None], other, middle))
    return centre, np.where(holds, small, np.where(held, large, radius)) + SLACK
