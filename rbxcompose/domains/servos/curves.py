"""Curves of one joint over time: polynomials between knots.

Positions are [rad] or [m], times [s] since the curve began. A curve keeps its first position before it begins and its
last one, at rest, after its end. Formulas: cubic and quintic Hermite interpolation, and the C2 cubic spline with given
velocities at its ends (de Boor, A Practical Guide to Splines, chapter IV).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cached_property

from rbxcompose.base.arrays import np
from rbxcompose.base.dataclass import dataclass

NEGLIGIBLE = 1e-13  # a coefficient of the highest power that is smaller than this times the greatest one
Coefficients = tuple[float, ...]  # of 1, t, t^2 and so on, up to t^5


@dataclass(frozen=True, slots=True)
class JointSample:
    """Where a joint is, or should be."""

    position: float
    velocity: float = 0.0
    acceleration: float = 0.0

    @property
    def is_finite(self) -> bool:
        """Return whether all of it are finite numbers."""
        return all(map(math.isfinite, (self.position, self.velocity, self.acceleration)))


@dataclass(frozen=True)
class Curve:
    """`pieces[i]` holds between `times[i]` and `times[i + 1]` and counts its time from there; times increase."""

    times: tuple[float, ...]
    pieces: tuple[Coefficients, ...]
    least: float = -math.inf
    """Positions are clamped to this and `greatest`; at them the joint rests."""
    greatest: float = math.inf

    def clamped(self, least: float, greatest: float) -> Curve:
        """Return the same curve, clamped to a range."""
        return replace(self, least=least, greatest=greatest)

    @property
    def first(self) -> float:
        """The position at the beginning."""
        return self.pieces[0][0]

    @property
    def duration(self) -> float:
        """When the curve ends [s]."""
        return self.times[-1]

    @cached_property
    def last(self) -> float:
        """The position at the end."""
        return _value(self.pieces[-1], self.times[-1] - self.times[-2])

    def sample(self, time: float) -> JointSample:
        """Return position, velocity and acceleration at `time`."""
        if time >= self.times[-1]:
            return JointSample(self.last)
        if time < self.times[0]:
            return JointSample(self.first)
        index = bisect_right(self.times, time) - 1
        piece, since = self.pieces[index], time - self.times[index]
        slope, position = _derived(piece), _value(piece, since)
        if not self.least <= position <= self.greatest:
            return JointSample(max(self.least, min(self.greatest, position)))
        return JointSample(position, _value(slope, since), _value(_derived(slope), since))

    @cached_property
    def extent(self) -> tuple[float, float]:
        """The least and the greatest position."""
        return _extremes(self._spans(self.pieces))

    @cached_property
    def speed(self) -> float:
        """The greatest speed."""
        low, high = _extremes(self._spans(_derived(piece) or (0.0,) for piece in self.pieces))
        return max(-low, high)

    def _spans(self, pieces: Iterable[Coefficients]) -> list[tuple[Coefficients, float]]:
        """Return pieces, each with how long it holds."""
        return [(piece, self.times[i + 1] - self.times[i]) for i, piece in enumerate(pieces)]


def straight(times: Sequence[float], positions: Sequence[float]) -> Curve:
    """Return straight lines between positions: the velocity jumps at each of them."""
    pairs = zip(positions, _slopes(times, positions), strict=False)
    return Curve(tuple(times), tuple(pairs))


def cubic(times: Sequence[float], positions: Sequence[float], velocities: Sequence[float]) -> Curve:
    """Return the cubic Hermite curve: C1."""
    pieces = []
    for i, slope in enumerate(_slopes(times, positions)):
        h, first, second = times[i + 1] - times[i], velocities[i], velocities[i + 1]
        pieces.append(
            (positions[i], first, (3 * slope - 2 * first - second) / h, (first + second - 2 * slope) / (h * h))
        )
    return Curve(tuple(times), tuple(pieces))


def quintic(times: Sequence[float], samples: Sequence[JointSample]) -> Curve:
    """Return the quintic Hermite curve: C2."""
    return Curve(
        tuple(times),
        tuple(_quintic(samples[i], samples[i + 1], times[i + 1] - times[i]) for i in range(len(times) - 1)),
    )


def _quintic(start: JointSample, end: JointSample, h: float) -> Coefficients:
    p, v, a = start.position, start.velocity, start.acceleration / 2
    # What is left at the end for the terms of t^3, t^4 and t^5 to do, in units of the piece's duration.
    way = end.position - p - (v + a * h) * h
    speed = (end.velocity - v - 2 * a * h) * h
    bend = (end.acceleration - 2 * a) * h * h
    third, fourth, fifth = 10 * way - 4 * speed + bend / 2, -15 * way + 7 * speed - bend, 6 * way - 3 * speed + bend / 2
    return (p, v, a, third / h**3, fourth / h**4, fifth / h**5)


def spline_velocities(times: Sequence[float], positions: Sequence[float], first: float, last: float) -> list[float]:
    """Return velocities at the knots with which `cubic` is C2; `first` and `last` are those of its ends."""
    slopes = _slopes(times, positions)
    h = [times[i + 1] - times[i] for i in range(len(slopes))]
    # Of row i: h[i + 1] v[i] + 2 (h[i] + h[i + 1]) v[i + 1] + h[i] v[i + 2] = right. Elimination needs no pivots, since
    # the diagonal dominates.
    diagonals, rights = [1.0], [first]
    for i in range(len(h) - 1):
        factor = h[i + 1] / diagonals[-1]
        above = h[i - 1] if i else 0.0
        diagonals.append(2 * (h[i] + h[i + 1]) - factor * above)
        rights.append(3 * (h[i + 1] * slopes[i] + h[i] * slopes[i + 1]) - factor * rights[-1])
    velocities = [last]
    for i in range(len(h) - 2, -1, -1):
        velocities.append((rights[i + 1] - h[i] * velocities[-1]) / diagonals[i + 1])
    return [first, *reversed(velocities)]


def calmed_velocities(times: Sequence[float], positions: Sequence[float], velocities: Sequence[float]) -> list[float]:
    """Return velocities with which `cubic` does not overshoot between its knots; the first one is kept.

    A knot where the direction changes is passed at rest; elsewhere the velocity is at most 3 times the smaller slope
    (Fritsch and Carlson, Monotone Piecewise Cubic Interpolation, 1980: sufficient with equal bounds on both sides).
    """
    slopes = _slopes(times, positions)
    calm = list(velocities)
    for i in range(1, len(calm) - 1):
        before, after = slopes[i - 1], slopes[i]
        most = 3 * min(abs(before), abs(after)) if before * after > 0.0 else 0.0
        same = calm[i] * before > 0.0
        calm[i] = math.copysign(min(abs(calm[i]), most), before) if same else 0.0
    return calm


def braking(start: JointSample, acceleration: float | None, least: float, greatest: float) -> Curve:
    """Return how a joint that moves comes to rest: with `acceleration`, harder if it would leave its range.

    Without a limit of acceleration it stops at once.
    """
    position, velocity = start.position, start.velocity
    room = max(0.0, greatest - position if velocity > 0.0 else position - least)
    if not velocity or acceleration is None or not room:
        return resting(position)
    needed = velocity * velocity / (2 * room)
    rate = max(acceleration, needed)
    return Curve((0.0, abs(velocity) / rate), ((position, velocity, -math.copysign(rate / 2, velocity)),))


def resting(position: float) -> Curve:
    """Return a curve that stays at a position."""
    return Curve((0.0, 0.0), ((position,),))


def _slopes(times: Sequence[float], positions: Sequence[float]) -> list[float]:
    return [(positions[i + 1] - positions[i]) / (times[i + 1] - times[i]) for i in range(len(times) - 1)]


def _value(piece: Coefficients, time: float) -> float:
    value = 0.0
    for coefficient in reversed(piece):
        value = value * time + coefficient
    return value


def _derived(piece: Coefficients) -> Coefficients:
    return tuple(power * piece[power] for power in range(1, len(piece)))


def _extremes(spans: Sequence[tuple[Coefficients, float]]) -> tuple[float, float]:
    """Return the least and the greatest value of polynomials, each over a span from 0."""
    scaled = [tuple(value * span**power for power, value in enumerate(piece)) for piece, span in spans]  # over 0 to 1
    ends = [value for piece in scaled for value in (piece[0], sum(piece))]
    low, high = min(ends), max(ends)
    for piece in scaled:
        hull = _hull(piece)
        if min(hull) < low or max(hull) > high:
            values = [_value(piece, time) for time in _roots(_derived(piece)) if 0.0 < time < 1.0]
            low, high = min([low, *values]), max([high, *values])
    return low, high


def _hull(piece: Coefficients) -> list[float]:
    """Return numbers between which a polynomial stays over 0 to 1: its coefficients in Bernstein's basis."""
    degree = len(piece) - 1
    return [sum(math.comb(j, i) / math.comb(degree, i) * piece[i] for i in range(j + 1)) for j in range(degree + 1)]


def _roots(polynomial: Coefficients) -> list[float]:
    """Return the real roots of a polynomial; double ones may come with some error."""
    least = NEGLIGIBLE * max(map(abs, polynomial), default=0.0)
    kept = list(polynomial)
    while kept and abs(kept[-1]) <= least:
        kept.pop()
    if len(kept) < 2:
        return []
    if len(kept) == 2:
        return [-kept[0] / kept[1]]
    return [float(root.real) for root in np.roots(kept[::-1]) if abs(root.imag) <= 1e-6]
