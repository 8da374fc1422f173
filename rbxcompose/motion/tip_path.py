"""The way of a tip through space: straight lines and arcs, with corners that are cut or passed at rest.

Lengths along it are [m]. Where the tip turns more than it moves, a radian counts as `TURN`, so that a tip that turns on
the spot takes time, too.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import accumulate, pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import Quaternion, Transform3, Vector3, conjugate, lerp, multiply, slerp

Array = NDArray[np.float64]

TURN = 0.1  # [m/rad]
SAME = 1e-6  # [m or rad] between poses that are the same
CORNER_STEPS = 200  # of the table of its lengths
STRAIGHT = 1e-3  # [rad] between lines that are one
SMOOTH = math.radians(0.1)  # between directions, or of turns, that need no rest


class WrongWayError(ValueError):
    """Raised for points through which no way leads, with the reason."""


@dataclass(frozen=True, slots=True)
class WayPoint:
    """A pose of the tip; `is_via` if it is in the middle of an arc, which ends at the next one."""

    pose: Transform3
    is_via: bool = False


class Leg(Protocol):
    """A smooth piece of the way; `share` goes from 0 to 1."""

    @property
    def length(self) -> float:
        """Return how long it is [m]."""
        ...

    def at(self, share: float) -> Transform3:
        """Return the pose there."""
        ...


@dataclass(frozen=True, slots=True)
class Line:
    """A straight line, on which the tip turns evenly."""

    first: Transform3
    last: Transform3

    @property
    def length(self) -> float:
        """Return how long it is [m]."""
        turned = angle_between(self.first.rotation, self.last.rotation)
        return max(math.dist(self.first.translation, self.last.translation), TURN * turned)

    def at(self, share: float) -> Transform3:
        """Return the pose there."""
        return Transform3(
            lerp(self.first.translation, self.last.translation, share),
            slerp(self.first.rotation, self.last.rotation, share),
        )


@dataclass(frozen=True, slots=True)
class Arc:
    """A part of a circle, `angle` [rad] long, on which the tip turns evenly.

    From the middle, `x` leads to its beginning, and `y` is where it goes from there, as long as the radius [m].
    """

    middle: Array
    x: Array
    y: Array
    angle: float
    first: Quaternion
    last: Quaternion

    @property
    def length(self) -> float:
        """Return how long it is [m]."""
        return max(self.angle * float(np.linalg.norm(self.x)), TURN * angle_between(self.first, self.last))

    def at(self, share: float) -> Transform3:
        """Return the pose there."""
        turn = self.angle * share
        x, y, z = (self.middle + self.x * math.cos(turn) + self.y * math.sin(turn)).tolist()
        return Transform3((x, y, z), slerp(self.first, self.last, share))


@dataclass(frozen=True, slots=True)
class Corner:
    """A parabola from one line to another, as a Bezier curve of three poses; it begins and ends as the lines go."""

    first: Transform3
    corner: Transform3
    last: Transform3
    lengths: Array
    """From its beginning to even steps of the curve's parameter [m]."""

    @classmethod
    def between(cls, first: Transform3, corner: Transform3, last: Transform3) -> Corner:
        """Return the corner with its lengths."""
        shares = np.linspace(0.0, 1.0, CORNER_STEPS + 1)[:, None]
        a, b, c = (np.array(one.translation) for one in (first, corner, last))
        points = a * (1 - shares) ** 2 + 2 * b * shares * (1 - shares) + c * shares**2
        lengths = np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))
        return cls(first, corner, last, np.concatenate(([0.0], lengths)))

    @property
    def length(self) -> float:
        """Return how long it is [m]."""
        return float(self.lengths[-1])

    def at(self, share: float) -> Transform3:
        """Return the pose there."""
        steps = np.linspace(0.0, 1.0, CORNER_STEPS + 1)
        inner = float(np.interp(share * self.length, self.lengths, steps))
        before, after = Line(self.first, self.corner).at(inner), Line(self.corner, self.last).at(inner)
        return Line(before, after).at(inner)


@dataclass(frozen=True, slots=True)
class TipStretch:
    """Legs that the tip passes without coming to rest between them."""

    legs: tuple[Leg, ...]

    @property
    def length(self) -> float:
        """Return how long it is [m]."""
        return sum(one.length for one in self.legs)

    @property
    def ends(self) -> list[float]:
        """Return at which lengths its legs end [m]."""
        return list(accumulate(one.length for one in self.legs))

    def at(self, length: float) -> Transform3:
        """Return the pose there; beyond an end it is that of the end."""
        for leg in self.legs:
            if length <= leg.length or leg is self.legs[-1]:
                return leg.at(min(1.0, max(0.0, length / leg.length)))
            length -= leg.length
        raise AssertionError("a stretch has legs")


def angle_between(one: Quaternion, other: Quaternion) -> float:
    """Return by which angle two rotations differ [rad]."""
    x, y, z, w = multiply(conjugate(one), other)
    return 2.0 * math.atan2(math.hypot(x, y, z), abs(w))


def stretches(start: Transform3, points: Sequence[WayPoint], blend: float) -> tuple[TipStretch, ...]:
    """Return the way from `start` through points; corners of lines are cut from `blend` [m] before them on.

    The tip comes to rest where two stretches meet. Points where it is already are left out.

    Raises:
        WrongWayError: if an arc has no end or is none, or if a corner is longer than its legs.
    """
    return tuple(_joined(_cut(list(_legs(start, points)), blend)))


def _legs(start: Transform3, points: Sequence[WayPoint]) -> Iterator[Leg]:
    here, via = start, None
    for number, point in enumerate(points, 1):
        if via is not None and point.is_via:
            raise WrongWayError(f"point {number} is another one in the middle of an arc")
        if point.is_via:
            via = point.pose
            continue
        leg = Line(here, point.pose) if via is None else _arc(here, via, point.pose, number)
        if leg.length > SAME:
            yield leg
        here, via = point.pose, None
    if via is not None:
        raise WrongWayError("the last point is in the middle of an arc, which has no end")


def _arc(start: Transform3, via: Transform3, end: Transform3, number: int) -> Arc:
    """Return the arc through three points; how the tip is turned at the one in the middle does not count."""
    a, b, c = (np.array(one.translation) for one in (start, via, end))
    first, second = b - a, c - a
    normal = np.cross(first, second)
    square = float(normal @ normal)
    if square <= (STRAIGHT * float(np.linalg.norm(first) * np.linalg.norm(second))) ** 2:
        raise WrongWayError(f"the arc to point {number} is none: its three points are in one line")
    middle = a + np.cross((first @ first) * second - (second @ second) * first, normal) / (2.0 * square)
    x = a - middle
    y = np.cross(normal / math.sqrt(square), x)
    angle = math.atan2(float((c - middle) @ y), float((c - middle) @ x)) % math.tau
    return Arc(middle, x, y, angle, start.rotation, end.rotation)


def _cut(legs: list[Leg], blend: float) -> list[Leg]:
    """Return the legs with an arc at each corner of two lines."""
    cut = [_can_cut(one, other) and blend > 0.0 for one, other in pairwise(legs)]
    found: list[Leg] = []
    for number, leg in enumerate(legs):
        before, after = number > 0 and cut[number - 1], number < len(cut) and cut[number]
        if not isinstance(leg, Line) or not (before or after):
            found.append(leg)
            continue
        away = _reach(leg)
        if away < blend * (before + after) - SAME:
            text = f"line {number + 1} is {away * 100:.1f} cm long, too short for corners of {blend * 100:.1f} cm"
            raise WrongWayError(text)
        inner = Line(leg.at(blend / away) if before else leg.first, leg.at(1.0 - blend / away) if after else leg.last)
        if inner.length > SAME:
            found.append(inner)
        if after:
            next_ = legs[number + 1]
            found.append(Corner.between(inner.last, leg.last, next_.at(blend / _reach(next_))))
    return found


def _reach(leg: Leg) -> float:
    return math.dist(leg.at(0.0).translation, leg.at(1.0).translation)


def _can_cut(one: Leg, other: Leg) -> bool:
    """Return whether two lines have a corner between them that is no turn on the spot and not back."""
    if not (isinstance(one, Line) and isinstance(other, Line)):
        return False
    first, second = _direction(one, 0.5), _direction(other, 0.5)
    cosine = float(first @ second)
    return bool(first.any() and second.any()) and -math.cos(SMOOTH) < cosine


def _joined(legs: list[Leg]) -> Iterator[TipStretch]:
    """Yield the legs, in one stretch if one goes on where the other went to, and turns as fast."""
    together: list[Leg] = []
    for leg in legs:
        if together and not _goes_on(together[-1], leg):
            yield TipStretch(tuple(together))
            together = []
        together.append(leg)
    if together:
        yield TipStretch(tuple(together))


def _goes_on(one: Leg, other: Leg) -> bool:
    before, after = _velocity(one, 1.0 - 1e-4), _velocity(other, 1e-4)
    return float(np.linalg.norm(before - after)) < 0.02


def _velocity(leg: Leg, share: float) -> Array:
    """Return how the tip moves [m/m] and turns [rad/m times TURN] per length, of shape (6,)."""
    step = 1e-4
    here, there = leg.at(share - step / 2), leg.at(share + step / 2)
    x, y, z, w = multiply(there.rotation, conjugate(here.rotation))
    turned = 2.0 * TURN * math.copysign(1.0, w) * np.array((x, y, z))
    moved = np.subtract(there.translation, here.translation)
    return np.concatenate((moved, turned)) / (step * leg.length)


def _direction(leg: Leg, share: float) -> Array:
    """Return where the tip moves, of length 1; 0 if it only turns."""
    moved = _velocity(leg, share)[:3]
    size = float(np.linalg.norm(moved))
    return moved / size if size > SAME else np.zeros(3)


def shifted(pose: Transform3, frame: Transform3, by: Vector3, turn: Quaternion) -> Transform3:
    """Return a pose that is moved by a vector [m], and turned in its place, both along the axes of a frame."""
    moved = np.add(pose.translation, replace(frame, translation=(0.0, 0.0, 0.0)).apply(by)).tolist()
    turned = multiply(multiply(frame.rotation, turn), multiply(conjugate(frame.rotation), pose.rotation))
    return Transform3((moved[0], moved[1], moved[2]), turned)
