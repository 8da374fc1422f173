"""The body of a robot: links and joints, and where each link is for given positions of the joints.

Units are those of URDF: metres, radians, kilograms. The model is frozen, so that checks, transforms and pictures can
share it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Span
from rbxcompose.base.geometry import Transform3, Vector3, quaternion_about

MOVING = ("revolute", "continuous", "prismatic")
"""Kinds of joints with one degree of freedom."""
FLOATING = ("planar", "floating")
"""Kinds of joints whose child is placed by something else, such as a localisation."""
KINDS = (*MOVING, "fixed", *FLOATING)


@dataclass(frozen=True, slots=True)
class Geometry:
    """A shape: `box` with three lengths, `cylinder` and `capsule` with radius and length, `sphere`, or `mesh`.

    Beside these, the planning scene has `cone`, `plane` and `octree`. A mesh is in a file, or has its triangles here.
    """

    kind: str
    size: tuple[float, ...] = ()  # of a mesh: its scale
    file: str = ""
    points: tuple[float, ...] = ()  # x, y, z of each corner of a mesh, or of the middle of each cell of an octree
    triangles: tuple[int, ...] = ()  # three of the corners each


@dataclass(frozen=True, slots=True)
class Shape:
    """A visual or collision element of a link; `colour` is red, green, blue and opacity from 0 to 1."""

    geometry: Geometry
    origin: Transform3
    span: Span
    colour: tuple[float, float, float, float] | None = None
    size_span: Span | None = None
    """The place of its size, or of the mesh that has it, if that is known."""


@dataclass(frozen=True, slots=True)
class Inertial:
    """Mass [kg], centre of mass, and the inertia ixx, ixy, ixz, iyy, iyz, izz [kg m^2] about it."""

    mass: float
    origin: Transform3
    inertia: tuple[float, ...]
    span: Span
    mass_span: Span | None = None
    """The place of the mass, if it is known."""
    inertia_span: Span | None = None
    """The place of the inertia, if it is known."""


@dataclass(frozen=True, slots=True)
class BodyLink:
    """A rigid part of the body; its frame has the same name."""

    name: str
    span: Span
    inertial: Inertial | None = None
    visuals: tuple[Shape, ...] = ()
    collisions: tuple[Shape, ...] = ()


@dataclass(frozen=True, slots=True)
class JointLimits:
    """Range [rad or m], greatest effort [Nm or N] and speed [rad/s or m/s]; None where nothing is written."""

    lower: float | None
    upper: float | None
    effort: float | None
    velocity: float | None
    span: Span

    @property
    def range(self) -> tuple[float, float]:
        """Return the least and greatest position, infinite where nothing is written."""
        return -math.inf if self.lower is None else self.lower, math.inf if self.upper is None else self.upper

    @property
    def may_be_degrees(self) -> bool:
        """Return whether these are angles that only degrees have: round ones, of many turns if they were radians."""
        written = [abs(value) for value in (self.lower, self.upper) if value]
        return bool(written) and all(30 <= value <= 360 and value % 5 == 0 for value in written)


@dataclass(frozen=True, slots=True)
class Mimic:
    """A joint that follows another one: `multiplier * position + offset`."""

    joint: str
    multiplier: float
    offset: float
    span: Span


@dataclass(frozen=True, slots=True)
class BodyJoint:
    """A joint between two links. `origin` is the child's frame in the parent's at position 0, `axis` a unit vector."""

    name: str
    kind: str
    parent: str
    child: str
    origin: Transform3
    axis: Vector3
    span: Span
    limits: JointLimits | None = None
    mimic: Mimic | None = None
    link_spans: tuple[Span, ...] = ()
    """The places of its parent and its child, if they are known."""
    axis_span: Span | None = None
    """The place of its axis, if it is written."""

    @property
    def moves(self) -> bool:
        """Return whether it has a position."""
        return self.kind in MOVING

    @property
    def slides(self) -> bool:
        """Return whether its positions are lengths."""
        return self.kind == "prismatic"

    @property
    def rest(self) -> float:
        """Return the position nearest to 0 within its limits."""
        if self.limits is None or self.kind == "continuous":
            return 0.0
        return min(max(0.0, self.limits.lower or 0.0), self.limits.upper or 0.0)

    def at(self, position: float) -> Transform3:
        """Return the child's frame in the parent's at a position [rad or m]; 0 if it does not move."""
        x, y, z = self.axis
        if self.slides:
            return self.origin.compose(Transform3((x * position, y * position, z * position)))
        if self.moves:
            return self.origin.compose(Transform3(rotation=quaternion_about(self.axis, position)))
        return self.origin

    def position_of(self, child: Transform3) -> float:
        """Return the position [rad or m] at which the child's frame is there in the parent's; 0 if it does not move."""
        moved = self.origin.inverse().compose(child)
        (x, y, z), (ax, ay, az) = moved.translation, self.axis
        if self.slides:
            return ax * x + ay * y + az * z
        if not self.moves:
            return 0.0
        qx, qy, qz, qw = moved.rotation
        return math.remainder(2.0 * math.atan2(ax * qx + ay * qy + az * qz, qw), math.tau)

    @property
    def led_within(self) -> tuple[float, float]:
        """Return the range of the joint that it mimics in which it is within its own limits."""
        if self.limits is None or self.mimic is None or self.mimic.multiplier == 0.0 or self.kind == "continuous":
            return -math.inf, math.inf
        least, greatest = sorted((end - self.mimic.offset) / self.mimic.multiplier for end in self.limits.range)
        return least, greatest


ROUNDING = 1e-6  # of numbers that are written in a URDF


def led(joints: Mapping[str, BodyJoint]) -> dict[str, BodyJoint]:
    """Return joints whose limits also keep those that mimic them within theirs, unless nothing is left of the range."""
    found = dict(joints)
    for one in joints.values():
        leader = found.get(one.mimic.joint) if one.mimic else None
        if one.mimic is None or one.limits is None or leader is None or leader.limits is None:
            continue
        own, (least, greatest), speed = leader.limits, one.led_within, one.limits.velocity
        lower, upper = _nearer(own.lower, least, max), _nearer(own.upper, greatest, min)
        if leader.kind != "continuous" and (lower is None or upper is None or lower < upper):
            own = replace(own, lower=lower, upper=upper)
        if speed and one.mimic.multiplier:  # a speed of 0 is a filler
            own = replace(own, velocity=_nearer(own.velocity, abs(speed / one.mimic.multiplier), min))
        found[leader.name] = replace(leader, limits=own)
    return found


def _nearer(own: float | None, other: float, nearer: Callable[[float, float], float]) -> float | None:
    if own is None:
        return other if math.isfinite(other) else None
    return own if math.isclose(own, other, rel_tol=ROUNDING, abs_tol=ROUNDING) else nearer(own, other)


@dataclass(frozen=True)
class Body:
    """Links and joints by name, in the order of the file. They form one tree."""

    name: str
    links: Mapping[str, BodyLink] = field(default_factory=dict)
    joints: Mapping[str, BodyJoint] = field(default_factory=dict)
    frame: str = ""
    """The root, if a fixed virtual joint brings it and not the URDF."""

    @cached_property
    def joint_above(self) -> Mapping[str, BodyJoint]:
        """Return the joint that places each link, by link; the root has none."""
        return {joint.child: joint for joint in self.joints.values()}

    def joints_above(self, link: str) -> Iterator[BodyJoint]:
        """Yield the joints from a link up to the root."""
        while (joint := self.joint_above.get(link)) is not None:
            yield joint
            link = joint.parent

    @cached_property
    def joints_below(self) -> Mapping[str, list[BodyJoint]]:
        """Return the joints that each link carries, by link."""
        found: dict[str, list[BodyJoint]] = {name: [] for name in self.links}
        for joint in self.joints.values():
            found[joint.parent].append(joint)
        return found

    @cached_property
    def joints_downwards(self) -> Sequence[BodyJoint]:
        """Return the joints, each before those below it."""
        return [joint for link, _ in self.walk() for joint in self.joints_below[link]]

    @cached_property
    def root(self) -> str:
        """Return the link that no joint places."""
        return next(name for name in self.links if name not in self.joint_above)

    @cached_property
    def still(self) -> Mapping[str, Transform3]:
        """Return the links that never move in the frame of the root, with their poses in it."""
        found = {self.root: Transform3()}
        for joint in self.joints_downwards:
            if joint.parent in found and joint.kind == "fixed":
                found[joint.child] = found[joint.parent].compose(joint.origin)
        return found

    @property
    def own_root(self) -> str:
        """Return the root of the URDF, without the frame of a virtual joint."""
        return self.joints_below[self.frame][0].child if self.frame else self.root

    def carried(self, link: str) -> list[str]:
        """Return all links that a link carries."""
        children = [joint.child for joint in self.joints_below[link]]
        return [name for child in children for name in (child, *self.carried(child))]

    @property
    def moving(self) -> list[BodyJoint]:
        """Return the joints that have a position of their own; one that mimics another has none."""
        return [joint for joint in self.joints.values() if joint.moves and joint.mimic is None]

    def walk(self) -> Iterator[tuple[str, int]]:
        """Yield every link with its depth, the root first and each link before those it carries."""
        waiting = [(self.root, 0)] if self.links else []
        while waiting:
            link, depth = waiting.pop()
            yield link, depth
            waiting += [(joint.child, depth + 1) for joint in reversed(self.joints_below[link])]

    def position(self, joint: BodyJoint, positions: Mapping[str, float]) -> float:
        """Return the position of a joint; one that is not in `positions` is at rest."""
        if joint.mimic is None:
            known = positions.get(joint.name)
            return joint.rest if known is None else known
        return joint.mimic.multiplier * self.position(self.joints[joint.mimic.joint], positions) + joint.mimic.offset

    def poses(self, positions: Mapping[str, float]) -> dict[str, Transform3]:
        """Return the frame of every link in that of the root."""
        found = {self.root: Transform3()}
        for joint in self.joints_downwards:
            at = joint.at(self.position(joint, positions)) if joint.moves else joint.origin
            found[joint.child] = found[joint.parent].compose(at)
        return found
