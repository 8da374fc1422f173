"""A transform tree as one writes it with numpy, in the way of tf2: a history by bisect, slerp, 4x4 matrices."""

from __future__ import annotations

from bisect import bisect_left, insort
from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[np.float64]]


def matrix(at: Array, turn: Array) -> Array:
    """Return the 4x4 matrix of a translation and a unit quaternion (x, y, z, w)."""
    x, y, z, w = turn
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), at[0]],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), at[1]],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), at[2]],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def slerp(a: Array, b: Array, fraction: float) -> Array:
    """Return the quaternion at a fraction of the shortest arc."""
    cos = float(a @ b)
    if cos < 0:
        b, cos = -b, -cos
    if cos > 0.9995:
        mixed = a + fraction * (b - a)
        return np.asarray(mixed / np.linalg.norm(mixed))
    angle = np.arccos(cos)
    return np.asarray((np.sin((1 - fraction) * angle) * a + np.sin(fraction * angle) * b) / np.sin(angle))


class NumpyFrames:
    """The tree: a parent for each frame, its poses by stamp, and the matrix of the newest one."""

    def __init__(self) -> None:
        self.parents: dict[str, str] = {}
        self.poses: dict[str, list[tuple[int, Array, Array]]] = {}
        self.newest: dict[str, Array] = {}

    def set(self, parent: str, child: str, at: Array, turn: Array, stamp: int) -> None:
        """Add a pose."""
        self.parents[child] = parent
        insort(self.poses.setdefault(child, []), (stamp, at, turn), key=lambda one: one[0])
        self.newest[child] = matrix(at, turn)

    def lookup(self, target: str, source: str, stamp: int | None = None) -> Array:
        """Return the pose of a frame in one above it, newest or interpolated at a stamp."""
        found = np.eye(4)
        while source != target:
            found = (self.newest[source] if stamp is None else self._at(source, stamp)) @ found
            source = self.parents[source]
        return found

    def _at(self, frame: str, stamp: int) -> Array:
        poses = self.poses[frame]
        after = bisect_left(poses, stamp, key=lambda one: one[0])
        (start, at, turn), (end, other, turned) = poses[after - 1], poses[after]
        fraction = (stamp - start) / (end - start)
        return matrix(at + fraction * (other - at), slerp(turn, turned, fraction))
