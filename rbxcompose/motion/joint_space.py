"""The positions that the joints of an arm may have, as arrays in the order of its joints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rbxcompose.control.limits import MotionLimits
from rbxcompose.dataclass import dataclass

Array = NDArray[np.float64]

UNLIMITED = math.pi
"""[rad], how far from 0 positions of joints without an end are sampled."""


@dataclass(frozen=True, slots=True)
class ArmJoint:
    """A joint of an arm; without an end if it is continuous."""

    name: str
    limits: MotionLimits
    is_continuous: bool = False
    slides: bool = False

    def shown(self, position: float) -> str:
        """Return a position for people."""
        return f"{position * 100:.1f} cm" if self.slides else f"{math.degrees(position):.1f} deg"


@dataclass(frozen=True, slots=True)
class JointSpace:
    """The joints of an arm. All arrays of positions have the shape (n,), in [rad] or [m]."""

    joints: tuple[ArmJoint, ...]

    def inside(self, spare: float) -> JointSpace:
        """Return the space whose joints stay away from their limits by `spare` [rad or m], if there is room for it."""
        return JointSpace(tuple(_inside(one, spare) for one in self.joints))

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the joints."""
        return tuple(one.name for one in self.joints)

    @property
    def lower(self) -> Array:
        """Return the least positions; -inf without a limit."""
        return np.array([-math.inf if one.is_continuous else one.limits.least for one in self.joints])

    @property
    def upper(self) -> Array:
        """Return the greatest positions; inf without a limit."""
        return np.array([math.inf if one.is_continuous else one.limits.greatest for one in self.joints])

    def outside(self, values: Array, tolerance: float = 0.0) -> str:
        """Return which joints are outside of their limits, in words; nothing if none is."""
        return "; ".join(self._outside(values, tolerance))

    def _outside(self, values: Array, tolerance: float) -> list[str]:
        found = []
        for one, value in zip(self.joints, values.tolist(), strict=True):
            if not math.isfinite(value):
                found.append(f"'{one.name}' at {value} is at no position")
            elif not one.is_continuous and abs(one.limits.clamped(value) - value) > tolerance:
                ends = (one.limits.lower, one.limits.upper)
                bounds = " to ".join("any" if end is None else one.shown(end) for end in ends)
                found.append(f"'{one.name}' at {one.shown(value)} is beyond {bounds}")
        return found

    def clamped(self, values: Array) -> Array:
        """Return the nearest positions within the limits."""
        return np.clip(values, self.lower, self.upper)

    def nearest_turns(self, values: Array, reference: Array) -> Array:
        """Return the same positions, those of joints without an end at most half a turn from `reference`."""
        turning = np.array([one.is_continuous for one in self.joints])
        turns = np.round((reference - values) / math.tau) * math.tau
        return np.asarray(values + np.where(turning, turns, 0.0))

    def samples(self, count: int, seed: int) -> Array:
        """Return random positions within the limits, of shape (count, n)."""
        low = np.where(np.isfinite(self.lower), self.lower, -UNLIMITED)
        high = np.where(np.isfinite(self.upper), self.upper, UNLIMITED)
        return np.random.default_rng(seed).uniform(low, high, (count, len(self.joints)))


def interpolated(waypoints: Sequence[Array] | Array, step: float) -> Array:
    """Return points on the straight lines between waypoints, at most `step` [rad or m] apart in each joint."""
    found = [np.asarray(waypoints[0])[None]]
    for first, second in pairwise(waypoints):
        count = max(1, math.ceil(float(np.max(np.abs(second - first))) / step))
        found.append(first + (second - first) * (np.arange(1, count + 1) / count)[:, None])
    return np.concatenate(found)


def _inside(joint: ArmJoint, spare: float) -> ArmJoint:
    limits = joint.limits
    if joint.is_continuous or limits.greatest - limits.least < 4 * spare:
        return joint
    lower = None if limits.lower is None else limits.lower + spare
    upper = None if limits.upper is None else limits.upper - spare
    return replace(joint, limits=replace(limits, lower=lower, upper=upper))
