"""Tables with things as a camera with depth sees them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rbxcompose.base.geometry import Pose2, Transform3, quaternion_from_rpy
from rbxcompose.domains.worlds.optics import TO_OPTICAL, Intrinsics
from rbxcompose.domains.worlds.shapes import WorldBox, WorldCylinder, WorldShape
from rbxcompose.domains.worlds.view import WorldView
from rbxcompose.domains.worlds.world import SimulatedWorld

TOP = 0.74  # height of the table [m]
CAMERA = Intrinsics.of_view(320, 240, math.radians(60))
TABLE = WorldShape("table", WorldBox((0.7, 1.2, TOP)), Pose2(1.0, 0.0, 0.1))


def box(x: float, y: float, size: tuple[float, float, float], heading: float = 0.0) -> WorldShape:
    return WorldShape(f"box_{x:g}_{y:g}", WorldBox(size), Pose2(x, y, heading), TOP)


def cylinder(x: float, y: float, radius: float, height: float) -> WorldShape:
    return WorldShape(f"cylinder_{x:g}_{y:g}", WorldCylinder(radius, height), Pose2(x, y), TOP)


def eye(height: float = 1.15, pitch: float = 0.5, roll: float = 0.0, yaw: float = 0.0, x: float = 0.1) -> Transform3:
    """Return the pose of the optical frame of a camera that looks along x, and down by `pitch` [rad]."""
    return Transform3((x, 0.0, height), quaternion_from_rpy(roll, pitch, yaw)).compose(TO_OPTICAL)


def cloud(
    shapes: Sequence[WorldShape], pose: Transform3, camera: Intrinsics = CAMERA, noise: float = 0.0, seed: int = 1
) -> NDArray[np.float64]:
    """Return what a camera measures (h, w, 3) [m], nan where that is nothing; `noise` is that of a depth of 1 m."""
    depths = WorldView(SimulatedWorld("", shapes=tuple(shapes))).seen(pose, camera, 0.0, 10.0).depths.astype(float)
    depths += np.random.default_rng(seed).normal(0.0, noise, depths.shape) * np.nan_to_num(depths, posinf=0.0) ** 2
    depths[~np.isfinite(depths)] = math.nan
    return np.asarray(camera.rays * depths[:, :, None])
