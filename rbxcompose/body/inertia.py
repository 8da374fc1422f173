"""Inertia tensors of rigid bodies: their principal moments, and the tensor about another point. Pure.

Plain floats: for matrices of three rows, importing numpy takes longer than all that is computed here.
"""

from __future__ import annotations

import math

from rbxcompose.geometry import Transform3, Vector3, rotate

Tensor = tuple[Vector3, Vector3, Vector3]
"""A symmetric matrix [kg m^2], row by row."""
_SWEEPS = 12  # half of them suffice: each squares what is left beside the diagonal
_PLANES = ((0, 1, 2), (0, 2, 1), (1, 2, 0))  # two axes, and the one that they turn about


def principal_moments(tensor: Tensor) -> tuple[float, float, float]:
    """Return the moments about the principal axes, the smallest first: the eigenvalues, by Jacobi's rotations.

    As those of a library, they are exact but for the rounding of the largest one.
    """
    rows = [list(row) for row in tensor]
    for _ in range(_SWEEPS):
        for first, second, other in _PLANES:
            if rows[first][second]:
                _turn(rows, first, second, other)
    least, middle, most = sorted(rows[axis][axis] for axis in range(3))
    return least, middle, most


def _turn(rows: list[list[float]], first: int, second: int, other: int) -> None:
    """Turn two axes about the third so that nothing remains beside the diagonal between them."""
    beside = rows[first][second]
    half = (rows[second][second] - rows[first][first]) / (2.0 * beside)
    tangent = math.copysign(1.0, half) / (abs(half) + math.hypot(half, 1.0))
    cosine = 1.0 / math.hypot(tangent, 1.0)
    sine = tangent * cosine
    rows[first][first] -= tangent * beside
    rows[second][second] += tangent * beside
    rows[first][second] = rows[second][first] = 0.0
    one, two = rows[first][other], rows[second][other]
    rows[first][other] = rows[other][first] = cosine * one - sine * two
    rows[second][other] = rows[other][second] = sine * one + cosine * two


def about(point: Vector3, at: Transform3, mass: float, own: Tensor) -> Tensor:
    """Return the inertia about a point [m], by the parallel axis theorem; `own` is that about the centre of mass."""
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = _turned(own, at)
    x, y, z = (place - origin for place, origin in zip(at.translation, point, strict=True))
    xy, xz, yz = xy - mass * x * y, xz - mass * x * z, yz - mass * y * z
    return (
        (xx + mass * (y * y + z * z), xy, xz),
        (xy, yy + mass * (x * x + z * z), yz),
        (xz, yz, zz + mass * (x * x + y * y)),
    )


def _turned(tensor: Tensor, at: Transform3) -> Tensor:
    """Return a tensor along the axes of the frame in which its own frame is turned as `at` says."""
    a, b, c = (rotate(at.rotation, row) for row in tensor)
    first, second, third = (rotate(at.rotation, row) for row in zip(a, b, c, strict=True))
    return first, second, third


def added(tensors: list[Tensor]) -> Tensor:
    """Return the inertia of several bodies together, of tensors about one point."""
    first, second, third = (_sum([tensor[row] for tensor in tensors]) for row in range(3))
    return first, second, third


def _sum(rows: list[Vector3]) -> Vector3:
    x, y, z = map(sum, zip(*rows, strict=True))
    return x, y, z
