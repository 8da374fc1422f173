"""Hulls and what is around them: what is called apart is apart, and by little less than coal says."""

from __future__ import annotations

from typing import Any

import coal
import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from rbxcompose.domains.arms.motion.collisions import coal_shape
from rbxcompose.domains.arms.motion.compiled_collisions import BOX, CYLINDER, HALF_SPACE, TREE, hull_gap, hull_work
from rbxcompose.domains.arms.motion.numba_cache import compiled
from rbxcompose.domains.body.model import Geometry

Array = NDArray[np.float64]
SEEDS = st.integers(0, 2**31)
LEAST = 1e-3


@compiled
def gap(points: Array, between: Array, kind: int, size: Array, others: Array, axis: Array, work: Any) -> float:
    """Return what compiled code is told."""
    return hull_gap(points, between, kind, size, others, LEAST, axis, work)


def compile_gap() -> None:
    """Compile it, or read what was compiled before."""
    gap(
        np.zeros((4, 3)), np.eye(3, 4), TREE, np.zeros(4), np.ones((8, 3)), np.array((1.0, 0.0, 0.0, 0.0)), hull_work(1)
    )


def frame(rng: np.random.Generator, spread: float) -> Array:
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn[:, 0] *= np.linalg.det(turn)
    return np.column_stack((turn, rng.uniform(-spread, spread, 3)))


def hull(points: Array) -> Any:
    return coal.Convex.convexHull(coal_points(points), True, "Qt")


def coal_points(points: Array) -> Any:
    made = coal.StdVec_Vec3s()
    for point in points:
        made.append(point)
    return made


@given(st.sampled_from((TREE, BOX, CYLINDER, HALF_SPACE)), st.integers(4, 40), st.floats(0.2, 3.0), SEEDS)
def test_the_gap_is_never_more_than_the_distance_and_there_where_that_is(
    kind: int, count: int, spread: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    points, others, between = rng.normal(size=(count, 3)) * 0.3, rng.normal(size=(8, 3)) * 0.3, frame(rng, spread)
    size = np.array((*rng.uniform(0.05, 0.5, 3), 0.0))
    if kind == HALF_SPACE:
        size = np.array((*(size[:3] / np.linalg.norm(size[:3])), 0.1))
        found = min(float(size[:3] @ (between[:, :3] @ point + between[:, 3]) + 0.1) for point in points)
    else:
        geometry = {BOX: Geometry("box", tuple(2 * size[:3])), CYLINDER: Geometry("cylinder", (size[0], 2 * size[1]))}
        other = hull(others) if kind == TREE else coal_shape(geometry[kind], {})
        result, place = coal.DistanceResult(), coal.Transform3s(between[:, :3], between[:, 3])
        found = coal.distance(hull(points), place, other, coal.Transform3s(), coal.DistanceRequest(), result)
    told = gap(points, between, kind, size, others, np.append(rng.normal(size=3), 0.0), hull_work(1))
    assert told <= max(0.0, found - LEAST) + 1e-6
    if found > 2 * LEAST:
        assert told > 0.0
