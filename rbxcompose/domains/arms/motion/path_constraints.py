"""What an arm keeps on its whole way: how the tip is turned, where it is, what a sensor sees."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import field, replace
from typing import Any

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3, Vector3, conjugate, multiply, quaternion_between
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.collisions import Checker
from rbxcompose.domains.arms.motion.groups import ArmJoint, JointSpace, solid_link
from rbxcompose.domains.body.model import Body, Geometry
from rbxcompose.domains.worlds.physics.solids import rotation_matrix

RADIUS, ANGLE = 0.01, math.radians(30)  # [m], [rad]; the usual ones
LARGEST = 10.0  # [m], a radius
NEAREST = 1e-3  # [m] to a target, below which there is no direction
STEP = 1e-6  # [rad or m] of a joint, by which a rate is measured
AXES = "xyz"


@dataclass(frozen=True, slots=True)
class KeptSight:
    """What is to be seen: a disc that faces the sensor, `at` [m] in the frame of the link `target` or the root."""

    sensor: str
    target: str = ""
    at: Vector3 = (0.0, 0.0, 0.0)
    radius: float = RADIUS
    angle: float = ANGLE
    """By which the target may be off the axis of the sensor [rad]."""
    along: str = ""
    """The axis of the sensor's frame along which it looks; without it, z of an optical frame (REP 103), else x."""
    through: tuple[str, ...] = ()
    """Links and objects that may be in between."""

    @property
    def axis(self) -> int:
        """Return the number of the axis."""
        return AXES.index(self.along or ("z" if self.sensor.endswith("optical_frame") else "x"))

    def mistake(self, body: Body) -> str:
        """Return why it cannot be asked for; nothing if it can."""
        unknown = [link for link in (self.sensor, self.target) if link and link not in body.links]
        if unknown or not self.sensor:
            return f"there is no link '{unknown[0]}'" if unknown else "'sight' of 'keep' needs a 'sensor', a link"
        if self.along not in ("", *AXES):
            return f"a sensor looks along x, y or z of its frame, not along '{self.along}'"
        if not (all(map(math.isfinite, self.at)) and 0.0 < self.radius <= LARGEST and 0.0 < self.angle <= math.pi):
            return "'sight' of 'keep' has no finite target, a radius that is not above 0, or an angle beyond 180 deg"
        return ""


class SightLine:
    """Whether a sensor sees its target, at positions of joints of shape (n,)."""

    def __init__(self, kinematics: ArmKinematics, wanted: KeptSight, things: Checker) -> None:
        self.wanted, self._kinematics, self._things = wanted, kinematics, things
        body = kinematics.body
        self._target = wanted.target or body.root
        self._ignored = {*wanted.through, *(solid_link(body, text) for text in (wanted.sensor, self._target))}

    def beyond(self, values: Array) -> Iterator[str]:
        """Yield in words what is in the way, or that the target is off the axis; it uses our own kinematics."""
        poses, wanted = self._kinematics.poses(values), self.wanted
        eye, point = poses[wanted.sensor], poses[self._target].apply(wanted.at)
        axis = np.subtract(eye.apply(_unit(wanted.axis)), eye.translation)
        if (angle := _angle(axis, np.subtract(point, eye.translation))) > wanted.angle:
            shown, most = math.degrees(angle), math.degrees(wanted.angle)
            yield f"what '{wanted.sensor}' is to see is {shown:.1f} deg off its axis, and may be {most:.1f} deg off"
        if there := self.blocking(values, np.array(eye.translation), np.array(point)):
            words = " and ".join(f"'{text}'" for text in there[:3])
            yield f"{words} {'is' if len(there) == 1 else 'are'} before what '{wanted.sensor}' is to see"

    def is_free(self, values: Array) -> bool:
        """Return whether nothing is in between."""
        eye, _, point = self._ends(values)
        return not self.blocking(values, eye, point)

    def blocking(self, values: Array, eye: Array, point: Array) -> list[str]:
        """Return what is in the cone from the sensor to the disc."""
        away = eye - point
        length = float(np.linalg.norm(away))
        if length < NEAREST:
            return []
        (x, y, z), (a, b, c) = ((eye + point) / 2).tolist(), (away / length).tolist()
        there = Transform3((x, y, z), quaternion_between(_unit(2), (a, b, c)))
        return self._things.in_the_way(values, Geometry("cone", (self.wanted.radius, length)), there, self._ignored)

    def angle(self, values: Array) -> float:
        """Return by how much the target is off the axis [rad]."""
        eye, axis, point = self._ends(values)
        return _angle(axis, point - eye)

    def rates(self, values: Array) -> Array:
        """Return how joints change the angle, of shape (n,)."""
        here, found = self.angle(values), np.empty(len(values))
        for index in range(len(values)):
            moved = values.copy()
            moved[index] += STEP
            found[index] = (self.angle(moved) - here) / STEP
        return found

    def _ends(self, values: Array) -> tuple[Array, Array, Array]:
        """Return where the sensor is, its axis, and where the target is."""
        import pinocchio

        whole = self._kinematics.whole
        pinocchio.forwardKinematics(whole.model, whole.data, self._kinematics.q(values))
        frames: list[Any] = [
            pinocchio.updateFramePlacement(whole.model, whole.data, whole.frames[name])
            for name in (self.wanted.sensor, self._target)
        ]
        axis = np.array(frames[0].rotation[:, self.wanted.axis])
        return np.array(frames[0].translation), axis, np.asarray(frames[1].act(np.array(self.wanted.at)))


def _unit(axis: int) -> Vector3:
    return (float(axis == 0), float(axis == 1), float(axis == 2))


def _angle(array: Array, other: Array) -> float:
    """Return the angle between two directions [rad]; the largest one if there is no direction."""
    if float(np.linalg.norm(other)) < NEAREST:
        return math.pi
    return math.atan2(float(np.linalg.norm(np.cross(array, other))), float(array @ other))


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
    def is_about_tip(self) -> bool:
        """Return whether it asks for something besides ranges of joints."""
        return any(self.turned) or any(self.inside) or self.sight is not None

    def mistake(self, kinematics: ArmKinematics) -> str:
        """Return why it cannot be asked for; nothing if it can."""
        if not all(0.0 <= value <= math.pi for value in self.turned):
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
        return JointSpace(tuple(_narrowed(joint, self.joints.get(joint.name)) for joint in space.joints))


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

    def __init__(self, kinematics: ArmKinematics, keep: Keep, start: Array, things: Checker | None = None) -> None:
        """Build it; `things` know what may be before a target that is to be seen, and are needed for that alone."""
        self._kinematics = kinematics
        if keep.sight is not None and things is None:
            raise ValueError("nothing knows what is before a target that is to be seen")
        self._sight = SightLine(kinematics, keep.sight, things) if keep.sight and things is not None else None
        frame = kinematics.poses(start)[keep.frame] if keep.frame else Transform3()
        self._to_frame, self._first = frame.inverse(), kinematics.tip_pose(start).rotation
        spans = [*keep.inside, *((-value, value) if value else None for value in keep.turned)]
        self._rows = [index for index, span in enumerate(spans) if span is not None]
        self._lower = np.array([span[0] for span in spans if span is not None])
        self._upper = np.array([span[1] for span in spans if span is not None])
        if self._sight is not None:
            self._lower, self._upper = np.append(self._lower, 0.0), np.append(self._upper, self._sight.wanted.angle)
        inner = (self._upper - self._lower) * (1.0 - INSIDE) / 2.0
        self._aims = self._lower + inner, self._upper - inner
        if self._sight is not None:
            self._aims[0][-1] = 0.0  # an angle has no margin there
        self._turn = rotation_matrix(self._to_frame.rotation)
        self._back = rotation_matrix(multiply(conjugate(self._first), conjugate(self._to_frame.rotation)))
        self._shift = np.array(self._to_frame.translation)

    def beyond(self, values: Array) -> str:
        """Return which bounds are exceeded, in words; nothing if none is. It uses our own kinematics."""
        return "; ".join(self._beyond(values))

    def _beyond(self, values: Array) -> Iterator[str]:
        tip = self._to_frame.compose(self._kinematics.tip_pose(values))
        turn = rotation_matrix(tip.rotation) @ self._back
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


def _angles(turn: Array) -> tuple[float, float, float]:
    a = math.atan2(-turn[1, 2], turn[2, 2])
    b = math.asin(min(1.0, max(-1.0, turn[0, 2])))
    return a, b, math.atan2(-turn[0, 1], turn[0, 0])
