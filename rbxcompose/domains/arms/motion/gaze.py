"""Where a head's joints must be so that its camera looks at a point.

A camera looks along x of its frame. The angle by which it looks past a point has two parts: how far the point is to the
left of that axis, and how far above it. Both are brought to 0 by damped least squares with numeric derivatives
(Levenberg 1944): the joints of a head need neither cross in a point nor be perpendicular.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import product

import numpy as np

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3, Vector3, composed, quaternion_between
from rbxcompose.domains.arms.motion.groups import Array
from rbxcompose.domains.body.model import Body
from rbxcompose.domains.servos.limits import MotionLimits

NEAREST = 0.01  # [m] from the camera to a point that it can look at
STEPS, ENOUGH = 40, 1e-4  # of the search from one position; [rad] that is good enough
DAMPING, DELTA = 1e-3, 1e-5  # [rad] of a joint for a derivative
FARTHEST = math.tau / 4  # [rad] by which the search goes at once
GRID, WIDEST = 5, math.pi  # positions of each joint from which it begins; [rad] of one that has no limits


@dataclass(frozen=True, slots=True)
class Aiming:
    """Positions of the head's joints [rad or m], and the angle by which the camera then looks past the point [rad]."""

    positions: Mapping[str, float]
    angle: float
    blocked: tuple[str, ...] = ()
    """Its joints that are at a limit."""


class Gaze:
    """Aims a camera; `joints` are those of the head with their limits, all between the body's root and the camera.

    It may look along another unit vector than x of its frame: `axis`.
    """

    def __init__(
        self, body: Body, camera: str, joints: Mapping[str, MotionLimits], axis: Vector3 = (1.0, 0.0, 0.0)
    ) -> None:
        self._turned = Transform3(rotation=quaternion_between((1.0, 0.0, 0.0), axis))
        self._body, self._chain, self._names = body, tuple(body.joints_above(camera)), tuple(joints)
        self._least = np.array([max(joint.least, -WIDEST) for joint in joints.values()])
        self._greatest = np.array([min(joint.greatest, WIDEST) for joint in joints.values()])

    def angle(self, point: Vector3, positions: Mapping[str, float]) -> float:
        """Return by how much the camera looks past a point of the root's frame now [rad]."""
        return past(self._camera_at(positions).inverse().apply(point))

    def distance(self, point: Vector3, positions: Mapping[str, float]) -> float:
        """Return how far a point of the root's frame is from the camera [m]."""
        return math.dist(self._camera_at(positions).translation, point)

    def aimed(self, point: Vector3, positions: Mapping[str, float]) -> Aiming:
        """Return how to look at a point of the root's frame; with `positions` the joints of the body are now.

        It is what the search from here finds, or the nearest of those that it finds from a grid of positions.
        """
        here = np.array([positions.get(name, 0.0) for name in self._names])
        found = self._search(point, positions, np.clip(here, self._least, self._greatest))
        if self._past(point, positions, found) > ENOUGH:
            begins = product(*map(np.linspace, self._least, self._greatest, [GRID] * len(self._names)))
            some = sorted(map(np.array, begins), key=lambda one: self._past(point, positions, one))[:GRID]
            found = min(
                (found, *(self._search(point, positions, item) for item in some)),
                key=lambda array: (
                    round(self._past(point, positions, array) / ENOUGH),
                    float(np.max(np.abs(array - here))),
                ),
            )
        at_limit = (np.abs(found - self._least) < ENOUGH) | (np.abs(found - self._greatest) < ENOUGH)
        blocked = tuple(name for name, is_there in zip(self._names, at_limit, strict=True) if is_there)
        together = dict(zip(self._names, found.tolist(), strict=True))
        return Aiming(together, self._past(point, positions, found), blocked)

    def _search(self, point: Vector3, positions: Mapping[str, float], start: Array) -> Array:
        here, damping = start, DAMPING
        off = self._off(point, positions, here)
        for _ in range(STEPS):
            if np.hypot(*off) < ENOUGH / 10:
                break
            nudges = np.eye(len(here)) * DELTA
            slopes = np.array(
                [(self._off(point, positions, here + nudge) - off) / DELTA for nudge in nudges]
            ).T  # (2, n)
            step = slopes.T @ np.linalg.solve(slopes @ slopes.T + damping * np.eye(2), -off)
            step *= min(1.0, FARTHEST / max(float(np.max(np.abs(step))), ENOUGH / 10))
            there = np.clip(here + step, self._least, self._greatest)
            new = self._off(point, positions, there)
            if np.hypot(*new) < np.hypot(*off):
                here, off, damping = there, new, damping / 4
            elif damping > 1e3:
                break
            else:
                damping *= 8
        return here

    def _off(self, point: Vector3, positions: Mapping[str, float], values: Array) -> Array:
        """Return how far the point is to the left of where the camera looks, and above it [rad]."""
        x, y, z = self._seen(point, positions, values)
        return np.array((math.atan2(y, x), math.atan2(z, math.hypot(x, y))))

    def _past(self, point: Vector3, positions: Mapping[str, float], values: Array) -> float:
        return past(self._seen(point, positions, values))

    def _seen(self, point: Vector3, positions: Mapping[str, float], values: Array) -> Vector3:
        there = {**positions, **dict(zip(self._names, values.tolist(), strict=True))}
        return self._camera_at(there).inverse().apply(point)

    def _camera_at(self, positions: Mapping[str, float]) -> Transform3:
        body = self._body
        links = (item.at(body.position(item, positions)) if item.moves else item.origin for item in self._chain)
        return composed(links).compose(self._turned)


def past(point: Vector3) -> float:
    """Return the angle between x and a point in the frame of a camera [rad]."""
    x, y, z = point
    return math.atan2(math.hypot(y, z), x)
