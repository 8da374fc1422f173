"""How far the hull of some points is at least from a box, a cylinder or another hull, in code that numba compiles.

A plane between both tells it: all of one is on one side, all of the other is that far on the other side. So what is
called apart is apart, wherever the search for the plane ends.

Sources: Gilbert, Johnson, Keerthi, A fast procedure for computing the distance between complex objects (1988); van den
Bergen, A Fast and Robust GJK Implementation (1999).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbxcompose.motion.numba_cache import inlined

Array = NDArray[np.float64]

TREE, BOX, CYLINDER, HALF_SPACE = 0, 1, 2, 3
"""What a shape is beside its spheres."""
LITTLE = 1e-6  # [m], much more than rounding
TURNS = 24  # planes that are tried
GOOD = 0.7  # of the distance: a plane that shows so much of it is good enough
SAME, FLAT = 1e-9, 1e-12  # a plane is no better than another one; a simplex is as flat as rounding


class HullWork(NamedTuple):
    """Memory for tests."""

    simplex: Array
    """Differences of points of both, of shape (4, 3)."""
    nearest: Array
    turned: Array
    gram: Array
    stack: NDArray[np.int64]
    """Nodes of two trees that are still to be regarded, of shape (k, 2)."""


def hull_work(most: int) -> HullWork:
    """Return memory for tests, and for descents of trees with at most so many nodes waiting."""
    stack = np.zeros((most, 2), dtype=np.int64)
    return HullWork(np.zeros((4, 3)), np.zeros(3), np.zeros(3), np.zeros((3, 4)), stack)


@inlined
def away(kind: int, size: Array, x: float, y: float, z: float) -> float:
    """Return how far a point in the frame of a solid is from it [m]; below 0 within it."""
    if kind == HALF_SPACE:
        return float(size[0] * x + size[1] * y + size[2] * z + size[3])
    if kind == BOX:
        a, b, c = abs(x) - size[0], abs(y) - size[1], abs(z) - size[2]
    else:
        a, b, c = np.sqrt(x * x + y * y) - size[0], -np.inf, abs(z) - size[1]
    deepest = max(a, b, c)
    if deepest <= 0.0:
        return float(deepest)
    a, b, c = max(a, 0.0), max(b, 0.0), max(c, 0.0)
    return float(np.sqrt(a * a + b * b + c * c))


@inlined
def hull_gap(
    points: Array, between: Array, kind: int, size: Array, others: Array, least: float, axis: Array, work: HullWork
) -> float:
    """Return by how much the hull of points is farther than `least` [m] from a shape; at most 0 if no plane shows that.

    `between` is the frame of the points in that of the shape: a solid of a kind and a size, or the hull of `others`.
    `axis`, of shape (4,), is the plane that is tried first, and gets the one that was found: its normal in the frame of
    the points, of any length, and the distance that it showed. The normal in `work.nearest` is tried second.
    """
    if kind == HALF_SPACE:
        return _above(points, between, size) - least
    simplex, v, used = work.simplex, work.nearest, 0
    x, y, z = v[0], v[1], v[2]
    v[0], v[1], v[2] = axis[0], axis[1], axis[2]
    for turn in range(TURNS):
        _support(points, between, kind, size, others, v, work.turned, simplex[used])
        square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
        length, along = np.sqrt(square), _dot(simplex[used], v)
        if along > (least + LITTLE) * length and along >= GOOD * (axis[3] * length if turn < 2 else square):
            axis[0], axis[1], axis[2], axis[3] = v[0] / length, v[1] / length, v[2] / length, along / length
            return float(along / length - least)
        if turn > 1 and (length <= least + LITTLE or square - along <= SAME * square):
            break  # it is nearer than that, or no plane is better than this one
        if turn == 0:
            v[0], v[1], v[2] = x, y, z
        elif turn == 1:
            v[0], v[1], v[2] = simplex[0, 0], simplex[0, 1], simplex[0, 2]
            used = 1
        else:
            used = _reduced(simplex, used + 1, v, work.gram)
        if used == 0 and turn > 1:
            break  # they meet
    return 0.0


@inlined
def _above(points: Array, between: Array, size: Array) -> float:
    """Return how far the lowest point is above a half space [m]."""
    x, y, z = size[0], size[1], size[2]
    a = x * between[0, 0] + y * between[1, 0] + z * between[2, 0]
    b = x * between[0, 1] + y * between[1, 1] + z * between[2, 1]
    c = x * between[0, 2] + y * between[1, 2] + z * between[2, 2]
    lowest = np.inf
    for index in range(len(points)):
        lowest = min(lowest, a * points[index, 0] + b * points[index, 1] + c * points[index, 2])
    return float(lowest + x * between[0, 3] + y * between[1, 3] + z * between[2, 3] + size[3])


@inlined
def _dot(one: Array, other: Array) -> float:
    return float(one[0] * other[0] + one[1] * other[1] + one[2] * other[2])


@inlined
def _support(
    points: Array, between: Array, kind: int, size: Array, others: Array, v: Array, turned: Array, found: Array
) -> None:
    """Write the difference of two points of both shapes that is least along a direction, in the frame of the points."""
    lowest, at = np.inf, 0
    a, b, c = v[0], v[1], v[2]
    for index in range(len(points)):
        along = points[index, 0] * a + points[index, 1] * b + points[index, 2] * c
        if along < lowest:
            lowest, at = along, index
    for row in range(3):
        turned[row] = between[row, 0] * a + between[row, 1] * b + between[row, 2] * c
    x, y, z = turned[0], turned[1], turned[2]
    if kind == TREE:
        highest, best = -np.inf, 0
        for index in range(len(others)):
            along = others[index, 0] * x + others[index, 1] * y + others[index, 2] * z
            if along > highest:
                highest, best = along, index
        a, b, c = others[best, 0], others[best, 1], others[best, 2]
    elif kind == BOX:
        a = size[0] if x >= 0.0 else -size[0]
        b = size[1] if y >= 0.0 else -size[1]
        c = size[2] if z >= 0.0 else -size[2]
    else:
        across = np.sqrt(x * x + y * y)
        share = size[0] / across if across > 0.0 else 0.0
        a, b, c = x * share, y * share, size[1] if z >= 0.0 else -size[1]
    a, b, c = a - between[0, 3], b - between[1, 3], c - between[2, 3]
    for axis in range(3):
        there = between[0, axis] * a + between[1, axis] * b + between[2, axis] * c
        found[axis] = points[at, axis] - there


@inlined
def _reduced(simplex: Array, count: int, v: Array, gram: Array) -> int:
    """Write the point of a simplex nearest to the origin to `v`, and keep those corners that it lies between.

    Return how many these are; 0 if the origin is within the simplex. The last corner is among them: it is the new one.
    """
    last, most = simplex[count - 1], count - 1
    for one in range(most):
        for other in range(one, most):
            total = 0.0
            for axis in range(3):
                total += (simplex[one, axis] - last[axis]) * (simplex[other, axis] - last[axis])
            gram[one, other] = gram[other, one] = total
        gram[one, 3] = -(_dot(simplex[one], last) - _dot(last, last))
    best, kept = np.inf, 0
    a = b = 0.0
    for mask in range(1 << most):
        first, second, size = 0, 0, 0
        for index in range(most):
            if mask >> index & 1:
                first, second, size = second, index, size + 1
        if size == 3:
            if _is_within(gram):
                return 0
            continue
        t = u = 0.0
        if size == 1:
            if gram[second, second] <= 0.0:
                continue
            u = gram[second, 3] / gram[second, second]
        elif size == 2:
            det = gram[first, first] * gram[second, second] - gram[first, second] ** 2
            if det <= FLAT * gram[first, first] * gram[second, second]:
                continue
            t = (gram[first, 3] * gram[second, second] - gram[second, 3] * gram[first, second]) / det
            u = (gram[second, 3] * gram[first, first] - gram[first, 3] * gram[first, second]) / det
        if t < 0.0 or u < 0.0 or t + u > 1.0:
            continue
        square = 0.0
        for axis in range(3):
            at = last[axis] + t * (simplex[first, axis] - last[axis]) + u * (simplex[second, axis] - last[axis])
            square += at * at
        if square < best:
            best, kept, a, b = square, mask, t, u
    return _keep(simplex, count, kept, a, b, v)


@inlined
def _keep(simplex: Array, count: int, mask: int, t: float, u: float, v: Array) -> int:
    """Write the point `t` and `u` of the way from the last corner to others; move corners of the mask to the front."""
    most, kept = count - 1, 0
    for index in range(most):
        if mask >> index & 1:
            for axis in range(3):
                simplex[kept, axis] = simplex[index, axis]
            kept += 1
    for axis in range(3):
        simplex[kept, axis] = at = simplex[most, axis]
        v[axis] = at
        if kept == 2:
            v[axis] += t * (simplex[0, axis] - at) + u * (simplex[1, axis] - at)
        elif kept == 1:
            v[axis] += u * (simplex[0, axis] - at)
    return kept + 1


@inlined
def _is_within(gram: Array) -> bool:
    """Return whether the origin is within a simplex of four corners."""
    a, b, c, d, e, f = gram[0, 0], gram[0, 1], gram[0, 2], gram[1, 1], gram[1, 2], gram[2, 2]
    p, q, r = gram[0, 3], gram[1, 3], gram[2, 3]
    det = a * (d * f - e * e) - b * (b * f - e * c) + c * (b * e - d * c)
    if det <= FLAT * a * d * f:
        return False
    t = (p * (d * f - e * e) - b * (q * f - e * r) + c * (q * e - d * r)) / det
    u = (a * (q * f - e * r) - p * (b * f - e * c) + c * (b * r - q * c)) / det
    w = (a * (d * r - q * e) - b * (b * r - q * c) + p * (b * e - d * c)) / det
    return bool(t >= 0.0 and u >= 0.0 and w >= 0.0 and t + u + w <= 1.0)
