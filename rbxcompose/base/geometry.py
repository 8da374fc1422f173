"""Geometry of poses: planar ones for a base, spatial transforms for frames.

Lengths are metres, angles radians, turning left is positive. `T_a_b` is the pose of frame b in frame a, so that
`T_a_b.compose(T_b_c)` is `T_a_c`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from rbxcompose.base.dataclass import dataclass

Vector3 = tuple[float, float, float]  # x, y, z
Quaternion = tuple[float, float, float, float]  # x, y, z, w

NO_TRANSLATION: Vector3 = (0.0, 0.0, 0.0)
NO_ROTATION: Quaternion = (0.0, 0.0, 0.0, 1.0)
SMALL_SINE = 1e-4  # of half an angle, below which an arc is as good as its chord and its sine is inexact


def wrap_angle(angle: float) -> float:
    """Return `angle` [rad] wrapped to (-pi, pi]."""
    wrapped = math.remainder(angle, math.tau)
    return math.pi if wrapped == -math.pi else wrapped


@dataclass(frozen=True, slots=True)
class Velocity2:
    """Velocity of a base in its own frame: `linear` forwards [m/s], `angular` to the left [rad/s]."""

    linear: float = 0.0
    angular: float = 0.0

    @property
    def is_finite(self) -> bool:
        """Return whether both parts are finite numbers."""
        return math.isfinite(self.linear) and math.isfinite(self.angular)


AT_REST = Velocity2()


@dataclass(frozen=True, slots=True)
class Pose2:
    """Pose in the plane: `x`, `y` [m] and `heading` [rad]; poses returned by methods have it in (-pi, pi]."""

    x: float = 0.0
    y: float = 0.0
    heading: float = 0.0

    def compose(self, other: Pose2) -> Pose2:
        """Return `other`, given in the frame of this pose, in the frame in which this pose is given."""
        cos, sin = math.cos(self.heading), math.sin(self.heading)
        return Pose2(
            self.x + cos * other.x - sin * other.y,
            self.y + sin * other.x + cos * other.y,
            wrap_angle(self.heading + other.heading),
        )

    def inverse(self) -> Pose2:
        """Return the pose of the outer frame in the frame of this pose."""
        cos, sin = math.cos(self.heading), math.sin(self.heading)
        return Pose2(-cos * self.x - sin * self.y, sin * self.x - cos * self.y, wrap_angle(-self.heading))

    def distance(self, other: Pose2) -> float:
        """Return the straight-line distance to `other` [m]; headings are ignored."""
        return math.hypot(other.x - self.x, other.y - self.y)

    def bearing(self, other: Pose2) -> float:
        """Return the angle to turn left [rad] to face `other`, within (-pi, pi]."""
        return wrap_angle(math.atan2(other.y - self.y, other.x - self.x) - self.heading)

    def moved(self, velocity: Velocity2, duration: float) -> Pose2:
        """Return the pose after `duration` [s] at a constant `velocity`: the exact arc, computed by its chord."""
        half_turn = velocity.angular * duration / 2
        chord = velocity.linear * duration * (math.sin(half_turn) / half_turn if half_turn else 1.0)
        direction = self.heading + half_turn
        return Pose2(
            self.x + chord * math.cos(direction),
            self.y + chord * math.sin(direction),
            wrap_angle(self.heading + 2 * half_turn),
        )


def quaternion_from_yaw(yaw: float) -> Quaternion:
    """Return the rotation by `yaw` [rad] about z."""
    return (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


def quaternion_about(axis: Vector3, angle: float) -> Quaternion:
    """Return the rotation by `angle` [rad] about a unit vector."""
    sine = math.sin(angle / 2)
    return (axis[0] * sine, axis[1] * sine, axis[2] * sine, math.cos(angle / 2))


def quaternion_between(before: Vector3, after: Vector3) -> Quaternion:
    """Return a rotation that turns one unit vector into another."""
    (ax, ay, az), (bx, by, bz) = before, after
    w = 1.0 + ax * bx + ay * by + az * bz
    if w < 1e-9:  # opposite: half a turn about anything normal to it
        return (0.0, 1.0, 0.0, 0.0) if abs(ay) < 0.9 else (1.0, 0.0, 0.0, 0.0)
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    length = math.sqrt(x * x + y * y + z * z + w * w)
    return (x / length, y / length, z / length, w / length)


def quaternion_from_rpy(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the rotation by `roll` about x, then `pitch` about y, then `yaw` about z [rad], as URDF has it."""
    about_x = quaternion_about((1.0, 0.0, 0.0), roll)
    about_y = quaternion_about((0.0, 1.0, 0.0), pitch)
    return multiply(quaternion_from_yaw(yaw), multiply(about_y, about_x))


def rpy_from_quaternion(rotation: Quaternion) -> tuple[float, float, float]:
    """Return roll, pitch and yaw [rad] of a unit quaternion, as `quaternion_from_rpy` takes them.

    Straight up or down, where only a sum of roll and yaw counts, roll is 0.
    """
    x, y, z, w = rotation
    sine = 2 * (w * y - z * x)
    if abs(sine) > 1 - 1e-12:
        return 0.0, math.copysign(math.pi / 2, sine), wrap_angle(2 * math.atan2(z, w))
    return math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)), math.asin(sine), yaw_of(rotation)


def yaw_of(rotation: Quaternion) -> float:
    """Return the yaw [rad] of a unit quaternion: the direction of its x axis seen from above."""
    x, y, z, w = rotation
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the rotation that turns by `b` first and then by `a`."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def conjugate(rotation: Quaternion) -> Quaternion:
    """Return the inverse of a unit quaternion."""
    x, y, z, w = rotation
    return (-x, -y, -z, w)


def angle_between(a: Quaternion, b: Quaternion) -> float:
    """Return by which angle [rad] one rotation differs from another."""
    x, y, z, w = multiply(conjugate(a), b)
    return 2.0 * math.atan2(math.hypot(x, y, z), abs(w))


def rotate(rotation: Quaternion, vector: Vector3) -> Vector3:
    """Return `vector` turned by a unit quaternion."""
    x, y, z, w = rotation
    vx, vy, vz = vector
    # v + w t + u x t, where t = 2 u x v: half of the products of two quaternions
    tx, ty, tz = 2 * (y * vz - z * vy), 2 * (z * vx - x * vz), 2 * (x * vy - y * vx)
    return (vx + w * tx + y * tz - z * ty, vy + w * ty + z * tx - x * tz, vz + w * tz + x * ty - y * tx)


def lerp(a: Vector3, b: Vector3, fraction: float) -> Vector3:
    """Return the vector at a fraction of the line from `a` to `b`."""
    (ax, ay, az), (bx, by, bz) = a, b
    return (ax + (bx - ax) * fraction, ay + (by - ay) * fraction, az + (bz - az) * fraction)


def slerp(a: Quaternion, b: Quaternion, fraction: float) -> Quaternion:
    """Return the unit quaternion at a fraction of the shortest arc from `a` to `b`, at a constant angular speed."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    cos = ax * bx + ay * by + az * bz + aw * bw
    sign = -1.0 if cos < 0 else 1.0  # b and -b are the same rotation
    angle = math.acos(min(1.0, cos * sign))
    sine = math.sin(angle)
    if sine < SMALL_SINE:
        start, end = 1.0 - fraction, fraction * sign
        x, y, z, w = start * ax + end * bx, start * ay + end * by, start * az + end * bz, start * aw + end * bw
        length = math.hypot(x, y, z, w)
        return (x / length, y / length, z / length, w / length)
    start, end = math.sin((1.0 - fraction) * angle) / sine, sign * math.sin(fraction * angle) / sine
    return (start * ax + end * bx, start * ay + end * by, start * az + end * bz, start * aw + end * bw)


@dataclass(frozen=True, slots=True)
class Transform3:
    """Pose of one frame in another: `translation` [m] and `rotation`, a unit quaternion (x, y, z, w)."""

    translation: Vector3 = NO_TRANSLATION
    rotation: Quaternion = NO_ROTATION

    @classmethod
    def from_pose2(cls, pose: Pose2) -> Transform3:
        """Return the transform of a pose on the ground."""
        return cls((pose.x, pose.y, 0.0), quaternion_from_yaw(pose.heading))

    def to_pose2(self) -> Pose2:
        """Return the pose seen from above, without height, roll and pitch."""
        return Pose2(self.translation[0], self.translation[1], yaw_of(self.rotation))

    def apply(self, point: Vector3) -> Vector3:
        """Return a point [m] of the inner frame in the outer frame."""
        x, y, z = rotate(self.rotation, point)
        return (self.translation[0] + x, self.translation[1] + y, self.translation[2] + z)

    def compose(self, other: Transform3) -> Transform3:
        """Return `T_a_c` from this `T_a_b` and `other`, which is `T_b_c`."""
        return Transform3(self.apply(other.translation), multiply(self.rotation, other.rotation))

    def inverse(self) -> Transform3:
        """Return the pose of the outer frame in the inner one."""
        back = conjugate(self.rotation)
        x, y, z = rotate(back, self.translation)
        return Transform3((-x, -y, -z), back)


def composed(poses: Iterable[Transform3]) -> Transform3:
    """Return the pose of the innermost frame in the outermost one, from poses that begin with the innermost.

    It does what `compose` does again and again, without an object for each step.
    """
    at, turn = NO_TRANSLATION, NO_ROTATION
    for pose in poses:
        x, y, z = pose.translation
        dx, dy, dz = rotate(pose.rotation, at)
        at, turn = (x + dx, y + dy, z + dz), multiply(pose.rotation, turn)
    return Transform3(at, turn)
