"""Pictures of tags as a camera sees them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbxcompose.base.geometry import Transform3, multiply, quaternion_about
from rbxcompose.domains.worlds.optics import Intrinsics
from rbxcompose.domains.worlds.tag_pictures import DEFAULT_FAMILY, tag_picture

Picture = NDArray[np.uint8]
FINE = 4  # each pixel is the mean of so many by so many rays
CAMERA = Intrinsics.of_view(640, 480, math.radians(60))


def facing(x: float, y: float, z: float, *, tilt: float = 0.0, about: float = 0.0, roll: float = 0.0) -> Transform3:
    """Return the pose of a tag in the optical frame [m, rad]: upright before the camera, rolled, and then tilted."""
    towards = multiply(quaternion_about((1, 0, 0), math.pi), quaternion_about((0, 0, 1), roll))
    return Transform3((x, y, z), multiply(quaternion_about((math.cos(about), math.sin(about), 0), tilt), towards))


def picture(
    tags: dict[int, Transform3],
    size: float,
    camera: Intrinsics = CAMERA,
    noise: float = 3.0,
    family: str = DEFAULT_FAMILY,
    seed: int = 1,
) -> Picture:
    """Return tags with black squares of `size` [m] before a grey wall, in grey with noise."""
    import cv2

    seen = np.full((camera.height * FINE, camera.width * FINE), 110, np.uint8)
    for number, pose in sorted(tags.items(), key=lambda tag: -tag[1].translation[2]):
        painted = tag_picture(number, family, module=16)
        half = size / 2 * painted.shape[0] / (painted.shape[0] - 32)
        corners = np.array([pose.apply((half * x, half * y, 0)) for x, y in ((-1, 1), (1, 1), (1, -1), (-1, -1))])
        on_picture = (corners @ camera.matrix.T)[:, :2] / corners[:, 2:]
        wide = painted.shape[0]
        source: NDArray[Any] = np.array([(0, 0), (wide, 0), (wide, wide), (0, wide)]) - 0.5
        target = (on_picture + 0.5) * FINE - 0.5
        turned = cv2.getPerspectiveTransform(source.astype(np.float32), target.astype(np.float32))
        whole = (seen.shape[1], seen.shape[0])
        cv2.warpPerspective(painted, turned, whole, seen, cv2.INTER_NEAREST, cv2.BORDER_TRANSPARENT)
    means = cv2.resize(seen, (camera.width, camera.height), interpolation=cv2.INTER_AREA).astype(float)
    means = means * 0.8 + 20 + np.random.default_rng(seed).normal(0, noise, means.shape)
    return np.clip(means, 0, 255).astype(np.uint8)
