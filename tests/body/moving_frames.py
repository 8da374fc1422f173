"""Chains of frames that move at random, and what tests compare of their poses."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hypothesis import strategies as st

from rbxcompose.base.geometry import Quaternion, Transform3, Vector3, conjugate, multiply
from rbxcompose.base.transforms import TransformTree

SECOND = 1_000_000_000  # [ns]
MOST = 8 * SECOND  # less than a history spans
AXES: st.SearchStrategy[Vector3] = st.tuples(*[st.floats(-5, 5)] * 3)
Move = tuple[int, Transform3]


@st.composite
def rotations(draw: st.DrawFn) -> Quaternion:
    x, y, z, w = (draw(st.floats(-1, 1)) for _ in range(4))
    length = math.hypot(x, y, z, w)
    return (x / length, y / length, z / length, w / length) if length > 0.01 else (0.0, 0.0, 0.0, 1.0)


POSES = st.builds(Transform3, AXES, rotations())
STAMPS = st.lists(st.integers(0, MOST), min_size=1, max_size=6, unique=True).map(sorted)


@st.composite
def moves(draw: st.DrawFn) -> list[Move]:
    """Poses of one frame with their stamps [ns], in order, from 0 to `MOST` at least."""
    stamps = [0, *(stamp for stamp in draw(STAMPS) if 0 < stamp < MOST), MOST]
    return [(stamp, draw(POSES)) for stamp in stamps]


def fill(tree: TransformTree, parent: str, child: str, poses: Sequence[Move]) -> None:
    for stamp, pose in poses:
        tree.set(parent, child, pose, stamp=stamp / SECOND, static=False, measured=stamp)


def apart(a: Transform3, b: Transform3) -> tuple[float, float]:
    """Return by how far two poses differ: [m] and [rad]."""
    return math.dist(a.translation, b.translation), angle_between(a.rotation, b.rotation)


def angle_between(a: Quaternion, b: Quaternion) -> float:
    x, y, z, w = multiply(conjugate(a), b)
    return 2 * math.atan2(math.hypot(x, y, z), abs(w))


def is_same(a: Transform3, b: Transform3) -> bool:
    return max(apart(a, b)) < 1e-6
