"""Where a head's joints must be so that its camera looks at a point, and how they follow one that moves.

A camera looks along x of its frame. The angle by which it looks past a point has two parts: how far the point is to the
left of that axis, and how far above it. Both are brought to 0 by damped least squares with numeric derivatives
(Levenberg 1944): the joints of a head need neither cross in a point nor be perpendicular.

A head follows by positions or by speeds, and does something when what it follows is lost. The laws are those of the
head tracker in P. Goebel, ROS By Example, volume 2 (2015), chapter 9, with angles of joints in place of ratios in a
picture, and with the speed of the target known from where it was.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import StrEnum
from itertools import product

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3, Vector3, composed, quaternion_between
from rbxcompose.domains.arms.section_models import HeadTracking
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


SLOWS, EACH = 1.1, 0.05  # by which speeds are divided in each such time [s] without a target
SMOOTH = 0.1  # [s] over which the speed of a target is averaged
LEAP = 0.5  # [rad] at once: it is another target, whose speed is not known
STEADY = 0.3  # [s] after a picture of a target, for which that goes on as it did
HELD = 0.5  # [s] by which joints may be late while they move calmly
CLOSE = 0.02  # [rad] from the middle that is as good as there


class HeadTrackingState(StrEnum):
    """What a head does."""

    FOLLOWS = "follows"
    SLOWS = "slows down"
    SEARCHES = "searches"
    RECENTRES = "recentres"
    RESTS = "rests"


class HeadTracker:
    """Tells joints where to go; positions and speeds are in rad and rad/s, by joint."""

    def __init__(self, limits: Mapping[str, MotionLimits]) -> None:
        """Know the joints with their limits; the first one turns the head when it looks around."""
        self._limits = limits
        self._target: Mapping[str, float] | None = None
        self._speeds = dict.fromkeys(limits, 0.0)  # of the target
        self._seen = -math.inf  # [s]
        self._told: dict[str, float] = {}
        self._rates = dict.fromkeys(limits, 0.0)  # at which it goes by speeds
        self._side = 1.0
        self.state = HeadTrackingState.RESTS

    def see(self, target: Mapping[str, float], time: float) -> None:
        """Take the positions at which the head would look at the target at a time [s]."""
        passed = time - self._seen
        if passed <= 0.0:
            return
        known, self._target, self._seen = self._target, target, time
        for name, position in target.items():
            moved = position - known[name] if known is not None else math.inf
            if abs(moved) > LEAP or passed > STEADY:
                self._speeds[name] = 0.0
            else:
                share = 1.0 - math.exp(-passed / SMOOTH)
                self._speeds[name] += share * (moved / passed - self._speeds[name])

    def update(
        self, settings: HeadTracking, time: float, dt: float, present: Mapping[str, float]
    ) -> dict[str, float] | None:
        """Return where joints that are at `present` shall go, `dt` [s] after the last time; None if they may rest."""
        gone = time - self._seen
        told: dict[str, float] | None
        if gone <= settings.lost and self._target is not None:
            self.state = HeadTrackingState.FOLLOWS
            told = self._followed(settings, self._target, gone, dt, present)
        elif self._target is None or settings.recentre <= 0.0 or gone <= settings.lost + settings.recentre:
            told = self._slower(settings, dt)
        elif gone <= settings.lost + settings.recentre + settings.search:
            told = self._around(settings, dt, present)
        else:
            told = self._back(settings, dt, present)
        self._told = told if told is not None else {}
        return told

    def _expected(self, settings: HeadTracking, target: Mapping[str, float], gone: float, name: str) -> float:
        return target[name] + self._speeds[name] * (min(gone, STEADY) + settings.delay)

    def _followed(
        self, settings: HeadTracking, target: Mapping[str, float], gone: float, dt: float, present: Mapping[str, float]
    ) -> dict[str, float]:
        """Go to where the target is, or at a speed by how far away that is."""
        told = {}
        for name in self._limits:
            here, before = present[name], self._told.get(name, present[name])
            if settings.mode == "position":
                missing = self._expected(settings, target, gone + dt, name) - here
                step = min(max(missing * min(settings.gain, 1.0), -settings.ahead), settings.ahead)
                there = before if abs(target[name] - here) <= settings.threshold else here + step
            else:
                missing = self._expected(settings, target, gone, name) - before
                rate = 0.0 if abs(missing) <= settings.threshold else missing * settings.gain + self._speeds[name]
                if rate:
                    rate = math.copysign(min(max(abs(rate), settings.slowest), settings.speed), rate)
                self._rates[name] = rate
                there = min(max(before + rate * dt, here - settings.ahead), here + settings.ahead)
            told[name] = self._within(name, there)
        return told

    def _slower(self, settings: HeadTracking, dt: float) -> dict[str, float] | None:
        """Go on, slower and slower, if it went by speeds."""
        moving = settings.mode == "speed" and self._told and max(map(abs, self._rates.values())) > settings.slowest
        if not moving:
            self.state = HeadTrackingState.RESTS
            return None
        self.state = HeadTrackingState.SLOWS
        for name in self._rates:
            self._rates[name] *= SLOWS ** (-dt / EACH)
        return {name: self._within(name, at + self._rates[name] * dt) for name, at in self._told.items()}

    def _around(self, settings: HeadTracking, dt: float, present: Mapping[str, float]) -> dict[str, float]:
        """Turn to one side and to the other, by a quarter turn from ahead if the limits allow it."""
        self.state = HeadTrackingState.SEARCHES
        told = {name: self._calmly(settings, name, present) for name in self._limits}
        first = next(iter(self._limits))
        wanted, ahead = told[first] + self._side * settings.calm * dt, self._within(first, 0.0)
        told[first] = self._within(first, wanted)
        if wanted >= self._within(first, ahead + math.pi / 2):
            self._side = -1.0
        elif wanted <= self._within(first, ahead - math.pi / 2):
            self._side = 1.0
        return told

    def _back(self, settings: HeadTracking, dt: float, present: Mapping[str, float]) -> dict[str, float] | None:
        """Look ahead."""
        told = {}
        for name in self._limits:
            at, most = self._calmly(settings, name, present), settings.calm * dt
            told[name] = at + min(max(self._within(name, 0.0) - at, -most), most)
        if all(abs(self._within(name, 0.0) - present[name]) <= CLOSE for name in self._limits):
            self.state = HeadTrackingState.RESTS
            return None
        self.state = HeadTrackingState.RECENTRES
        return told

    def _calmly(self, settings: HeadTracking, name: str, present: Mapping[str, float]) -> float:
        """Return where a joint was sent last, but near where it is, so that one that was held does not jump."""
        here, most = present[name], settings.calm * HELD
        return self._within(name, min(max(self._told.get(name, here), here - most), here + most))

    def _within(self, name: str, position: float) -> float:
        limits = self._limits[name]
        return min(max(position, limits.least), limits.greatest)
