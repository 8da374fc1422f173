"""That a sensor sees a target: it is near the sensor's axis, and nothing is in the cone between them.

As MoveIt's `VisibilityConstraint`, whose disc may be turned; the one here always faces the sensor.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from rbxcompose.body.model import Body, Geometry
from rbxcompose.dataclass import dataclass
from rbxcompose.geometry import Quaternion, Transform3, Vector3
from rbxcompose.motion.arm_kinematics import ArmKinematics

Array = NDArray[np.float64]

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


class SeesThings(Protocol):
    """What knows all shapes of the body, and the things around it."""

    def in_the_way(self, values: Array, shape: Geometry, at: Transform3, ignored: Collection[str]) -> list[str]:
        """Return the links and objects that a shape at a pose in the root's frame would be within."""
        ...


class SightLine:
    """Whether a sensor sees its target, at positions of joints of shape (n,)."""

    def __init__(self, kinematics: ArmKinematics, wanted: KeptSight, things: SeesThings) -> None:
        self.wanted, self._kinematics, self._things = wanted, kinematics, things
        body = kinematics.body
        self._target = wanted.target or body.root
        self._ignored = {*wanted.through, *(_carrier(body, one) for one in (wanted.sensor, self._target))}

    def beyond(self, values: Array) -> Iterator[str]:
        """Yield in words what is in the way, or that the target is off the axis; it uses our own kinematics."""
        poses, wanted = self._kinematics.poses(values), self.wanted
        eye, point = poses[wanted.sensor], poses[self._target].apply(wanted.at)
        axis = np.subtract(eye.apply(_unit(wanted.axis)), eye.translation)
        if (angle := _angle(axis, np.subtract(point, eye.translation))) > wanted.angle:
            shown, most = math.degrees(angle), math.degrees(wanted.angle)
            yield f"what '{wanted.sensor}' is to see is {shown:.1f} deg off its axis, and may be {most:.1f} deg off"
        if there := self.blocking(values, np.array(eye.translation), np.array(point)):
            words = " and ".join(f"'{one}'" for one in there[:3])
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
        x, y, z = ((eye + point) / 2).tolist()
        cone = Geometry("cone", (self.wanted.radius, length))
        return self._things.in_the_way(values, cone, Transform3((x, y, z), _towards(away / length)), self._ignored)

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
            pinocchio.updateFramePlacement(whole.model, whole.data, whole.frames[one])
            for one in (self.wanted.sensor, self._target)
        ]
        axis = np.array(frames[0].rotation[:, self.wanted.axis])
        return np.array(frames[0].translation), axis, np.asarray(frames[1].act(np.array(self.wanted.at)))


def _carrier(body: Body, link: str) -> str:
    """Return the link whose shapes are around a frame: itself, or the one that a frame without shapes is fixed to."""
    while not body.links[link].collisions and link in body.joint_above and not body.joint_above[link].moves:
        link = body.joint_above[link].parent
    return link


def _unit(axis: int) -> Vector3:
    return (float(axis == 0), float(axis == 1), float(axis == 2))


def _angle(one: Array, other: Array) -> float:
    """Return the angle between two directions [rad]; the largest one if there is no direction."""
    if float(np.linalg.norm(other)) < NEAREST:
        return math.pi
    return math.atan2(float(np.linalg.norm(np.cross(one, other))), float(one @ other))


def _towards(direction: Array) -> Quaternion:
    """Return a rotation that turns z into a direction."""
    x, y, z = direction.tolist()
    if z < -1.0 + 1e-9:
        return (1.0, 0.0, 0.0, 0.0)
    size = math.sqrt(2.0 * (1.0 + z))
    return (-y / size, x / size, 0.0, size / 2.0)
