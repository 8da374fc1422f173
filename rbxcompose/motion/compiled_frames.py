"""Arithmetic of frames for compiled code: a rotation and a translation [m] beside each other, of shape (3, 4)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbxcompose.motion.numba_cache import inlined

Array = NDArray[np.float64]


@inlined
def multiply(one: Array, other: Array, found: Array) -> None:
    """Write the product of two frames."""
    for row in range(3):
        for column in range(4):
            found[row, column] = (
                one[row, 0] * other[0, column] + one[row, 1] * other[1, column] + one[row, 2] * other[2, column]
            )
        found[row, 3] += one[row, 3]


@inlined
def multiply_inverse(one: Array, other: Array, found: Array) -> None:
    """Write the product of the inverse of a frame and another one."""
    for row in range(3):
        for column in range(4):
            total = 0.0
            for inner in range(3):
                away = other[inner, column] - (one[inner, 3] if column == 3 else 0.0)
                total += one[inner, row] * away
            found[row, column] = total


@inlined
def apply(frame: Array, point: Array, found: Array) -> None:
    """Write where a point of a frame is."""
    for row in range(3):
        found[row] = frame[row, 0] * point[0] + frame[row, 1] * point[1] + frame[row, 2] * point[2] + frame[row, 3]
