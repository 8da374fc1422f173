"""What an arm keeps on its whole way: how the tip is turned, where it is, what is seen, and where joints are."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import field, replace

import numpy as np
from numpy.typing import NDArray

from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import Transform3, conjugate, multiply
from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.joint_space import ArmJoint, JointSpace
from rbxcompose.motion.sight import KeptSight, SeesThings, SightLine

Array = NDArray[np.float64]
KeptRange = tuple[float, float]

MEASURES = ("x", "y", "z", "roll", "pitch", "yaw")
INSIDE = 0.98  # share of a tolerance that is aimed at, so that rounding decides nothing
MOST_STEPS = 30  # of a projection
OVERSHOT = 1e-6  # [m or rad] beyond a bound that is aimed at, since a step ends a little too early
SINGULAR = 1e-4  # share of the largest singular value, below which a direction is none
ROUNDING = 1e-9  # [m or rad] beyond a bound


@dataclass(frozen=True, slots=True)
class Keep:
    """What is asked for; tolerances in [rad], ranges in [m], those of joints in [rad or m]."""

    turned: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """By how much the tip may be turned from how it was about x, y and z of the frame; 0 is any."""
    inside: tuple[KeptRange | None, KeptRange | None, KeptRange | None] = (None, None, None)
    """Where the tip may be along x, y and z of the frame."""
    joints: Mapping[str, KeptRange] = field(default_factory=dict)
    frame: str = ""
    """A link; without one, the root."""
    sight: KeptSight | None = None
    """What a sensor sees."""

    @property
    def is_any(self) -> bool:
        """Return whether it asks for nothing."""
        return not (self.is_about_tip or self.joints)

    @property
    def is_about_tip(self) -> bool:
        """Return whether it asks for something besides ranges of joints."""
        return any(self.turned) or any(self.inside) or self.sight is not None

    def mistake(self, kinematics: ArmKinematics) -> str:
        """Return why it cannot be asked for; nothing if it can."""
        if not all(0.0 <= one <= math.pi for one in self.turned):
            return "a tolerance of 'keep' is below 0 or above 180 deg"
        ranges = [*filter(None, self.inside), *self.joints.values()]
        if not all(low < high and math.isfinite(low) and math.isfinite(high) for low, high in ranges):
            return "a range of 'keep' does not go from less to more"
        odd = [name for name in self.joints if name not in kinematics.group.joints]
        if odd:
            return f"'{odd[0]}' of 'keep' is no joint of this arm"
        is_known = not self.frame or self.frame in kinematics.body.links
        if not is_known:
            return f"there is no link '{self.frame}'"
        return self.sight.mistake(kinematics.body) if self.sight is not None else ""

    def narrowed(self, space: JointSpace) -> JointSpace:
        """Return the space within the ranges of joints."""
        return JointSpace(tuple(_narrowed(one, self.joints.get(one.name)) for one in space.joints))


def _narrowed(joint: ArmJoint, span: KeptRange | None) -> ArmJoint:
    if span is None:
        return joint
    outer = (-math.inf, math.inf) if joint.is_continuous else (joint.limits.least, joint.limits.greatest)
    limits = replace(joint.limits, lower=max(outer[0], span[0]), upper=min(outer[1], span[1]))
    return replace(joint, limits=limits, is_continuous=False)


class KeptTip:
    """What is asked for of the tip, in the frame where it was at the start. All values have the shape (n,).

    Turns are measured as the angles a, b and c of the rotation about x, then y, then z of axes that turn with them.
    """

    def __init__(self, kinematics: ArmKinematics, keep: Keep, start: Array, things: SeesThings | None = None) -> None:
        """Build it; `things` know what may be before a target that is to be seen, and are needed for that alone."""
        self._kinematics = kinematics
        if keep.sight is not None and things is None:
            raise ValueError("nothing knows what is before a target that is to be seen")
        self._sight = SightLine(kinematics, keep.sight, things) if keep.sight and things is not None else None
        frame = kinematics.poses(start)[keep.frame] if keep.frame else Transform3()
        self._to_frame, self._first = frame.inverse(), kinematics.tip_pose(start).rotation
        spans = [*keep.inside, *((-one, one) if one else None for one in keep.turned)]
        self._rows = [index for index, one in enumerate(spans) if one is not None]
        self._lower = np.array([one[0] for one in spans if one is not None])
        self._upper = np.array([one[1] for one in spans if one is not None])
        if self._sight is not None:
            self._lower, self._upper = np.append(self._lower, 0.0), np.append(self._upper, self._sight.wanted.angle)
        inner = (self._upper - self._lower) * (1.0 - INSIDE) / 2.0
        self._aims = self._lower + inner, self._upper - inner
        if self._sight is not None:
            self._aims[0][-1] = 0.0  # an angle has no margin there
        self._turn = _matrix(self._to_frame.rotation)
        self._back = _matrix(multiply(conjugate(self._first), conjugate(self._to_frame.rotation)))
        self._shift = np.array(self._to_frame.translation)

    def beyond(self, values: Array) -> str:
        """Return which bounds are exceeded, in words; nothing if none is. It uses our own kinematics."""
        return "; ".join(self._beyond(values))

    def _beyond(self, values: Array) -> Iterator[str]:
        tip = self._to_frame.compose(self._kinematics.tip_pose(values))
        turn = _matrix(tip.rotation) @ self._back
        found = np.array((*tip.translation, *_angles(turn)))[self._rows]
        for index, value, low, high in zip(self._rows, found, self._lower, self._upper, strict=False):
            if not low - ROUNDING <= value <= high + ROUNDING:
                shown = [_shown(index, one) for one in (value, low, high)]
                yield f"the tip's {MEASURES[index]} is {shown[0]}, and is to be from {shown[1]} to {shown[2]}"
        if self._sight is not None:
            yield from self._sight.beyond(values)

    def is_kept(self, values: Array) -> bool:
        """Return whether all bounds are kept, with the margin that searches keep."""
        found, _ = self._measured(values, with_rates=False)
        is_within = bool(np.all(found >= self._aims[0]) and np.all(found <= self._aims[1]))
        return is_within and (self._sight is None or self._sight.is_free(values))

    def projected(self, values: Array, space: JointSpace) -> Array | None:
        """Return positions near by that keep all bounds, by Newton's method; None if it finds none."""
        for _ in range(MOST_STEPS):
            found, rates = self._measured(values)
            away = found - np.clip(found, *self._aims)
            if not away.any():
                return values if self._sight is None or self._sight.is_free(values) else None
            active = away != 0.0
            wanted = -away[active] - np.copysign(OVERSHOT, away[active])
            step, *_ = np.linalg.lstsq(rates[active], wanted, rcond=SINGULAR)
            values = np.clip(values + step, space.lower, space.upper)
        return None

    def _measured(self, values: Array, *, with_rates: bool = True) -> tuple[Array, Array]:
        """Return what is bounded, of shape (m,), and how joints change it, of shape (m, n)."""
        found, rates = self._measured_of_tip(values, with_rates=with_rates)
        if self._sight is None:
            return found, rates
        found = np.append(found, self._sight.angle(values))
        return found, np.concatenate((rates, self._sight.rates(values)[None])) if with_rates else rates

    def _measured_of_tip(self, values: Array, *, with_rates: bool) -> tuple[Array, Array]:
        position, rotation, jacobian = self._kinematics.tip(values, with_jacobian=with_rates)
        turn = self._turn @ rotation @ self._back
        a, b, c = _angles(turn)
        found = np.concatenate((self._turn @ position + self._shift, (a, b, c)))[self._rows]
        if not with_rates:
            return found, jacobian
        sa, ca, sb, cb = math.sin(a), math.cos(a), math.sin(b), math.cos(b)
        x, y, z = self._turn @ jacobian[3:]  # the rates of turning about the axes of the frame
        last = (ca * z - sa * y) / (cb if abs(cb) > SINGULAR else SINGULAR)
        turns = np.stack((x - sb * last, ca * y + sa * z, last))
        return found, np.concatenate((self._turn @ jacobian[:3], turns))[self._rows]


def _shown(index: int, value: float) -> str:
    return f"{math.degrees(value):.1f} deg" if index >= MEASURES.index("roll") else f"{value * 100:.1f} cm"


def _matrix(rotation: tuple[float, float, float, float]) -> Array:
    x, y, z, w = rotation
    return np.array(
        (
            (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        )
    )


def _angles(turn: Array) -> tuple[float, float, float]:
    a = math.atan2(-turn[1, 2], turn[2, 2])
    b = math.asin(min(1.0, max(-1.0, turn[0, 2])))
    return a, b, math.atan2(-turn[0, 1], turn[0, 0])
