"""Inertia by plain floats is what matrices of a library give."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.geometry import Transform3, quaternion_from_rpy, rotate
from rbxcompose.domains.body.lint import Tensor, about, added, principal_moments

MOMENTS = st.floats(-10.0, 10.0) | st.floats(-1e-9, 1e-9)
TENSORS = st.builds(lambda xx, xy, xz, yy, yz, zz: ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)), *[MOMENTS] * 6)
ANGLES, PLACES = st.floats(-math.pi, math.pi), st.floats(-10.0, 10.0)
POSES = st.builds(
    lambda x, y, z, roll, pitch, yaw: Transform3((x, y, z), quaternion_from_rpy(roll, pitch, yaw)),
    *[PLACES] * 3,
    *[ANGLES] * 3,
)


@given(TENSORS)
def test_principal_moments_are_the_eigenvalues(tensor: Tensor) -> None:
    largest = max(abs(value) for row in tensor for value in row)
    assert principal_moments(tensor) == pytest.approx(
        np.linalg.eigvalsh(tensor), rel=0.0, abs=max(1e-14 * largest, 1e-300)
    )


@given(TENSORS, st.sampled_from([1e-300, 1e-150, 1e150, 1e300]))
def test_moments_of_any_size_are_found(tensor: Tensor, scale: float) -> None:
    scaled = tuple(tuple(value * scale for value in row) for row in tensor)
    least, middle, most = principal_moments(scaled)  # type: ignore[arg-type]
    assert least <= middle <= most
    assert all(map(math.isfinite, (least, middle, most)))


@given(PLACES, PLACES, PLACES, POSES, st.floats(0.0, 100.0), TENSORS)
def test_about_another_point_is_the_parallel_axis_theorem(
    x: float, y: float, z: float, at: Transform3, mass: float, own: Tensor
) -> None:
    turn = np.transpose([rotate(at.rotation, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))])
    arm = np.array(at.translation) - (x, y, z)
    wanted = turn @ np.array(own) @ turn.T + mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    assert np.array(about((x, y, z), at, mass, own)) == pytest.approx(wanted, rel=1e-12, abs=1e-9)


@given(st.lists(TENSORS, min_size=1, max_size=4))
def test_bodies_together_have_the_sum_of_their_tensors(tensors: list[Tensor]) -> None:
    assert np.array(added(tensors)) == pytest.approx(np.sum(tensors, axis=0), abs=1e-12)
