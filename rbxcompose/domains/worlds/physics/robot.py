"""What a robot is to a physics engine: its body, which wheels drive it, and how its joints are held."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Span
from rbxcompose.base.geometry import Transform3, Vector3, rotate
from rbxcompose.domains.body.model import Body, BodyLink, Geometry, Shape
from rbxcompose.domains.worlds.physics.rigid import RigidPart
from rbxcompose.domains.worlds.physics.solids import apply

FOOTPRINT = "base_footprint"
LEVEL = 5e-3  # what ends within this above the lowest point of a robot reaches the ground, too [m]
STEADY = 0.01  # so far the centre of mass is within what carries the robot [m]
DIRECTIONS = 32  # in which that is tried


@dataclass(frozen=True, slots=True)
class PhysicsWheels:
    """The joints of the wheels that drive, by side."""

    left: tuple[str, ...]
    right: tuple[str, ...]
    radius: float
    """From the axle to the ground [m]."""
    distance: float
    """Between the middles of the left and the right wheels [m]."""

    @property
    def names(self) -> tuple[str, ...]:
        """Return all of their joints."""
        return (*self.left, *self.right)


@dataclass(frozen=True)
class PhysicsRobot:
    """A body with what its URDF does not say."""

    body: Body
    meshes: Mapping[str, Path] = field(default_factory=dict)
    """The file of each mesh, by its name in the URDF."""
    drives: bool | None = None
    """Whether it moves freely on wheels; else it is fixed to the ground. Default: whether wheels are found."""
    wheel_radius: float = 0.035
    """Of the wheels that are added if the body has none [m]."""
    wheel_distance: float = 0.23
    """Between the middles of the wheels that are added [m]."""
    servos: Mapping[str, float | None] = field(default_factory=dict)
    """The greatest torque [Nm] or force [N] that holds joints; None is what the URDF says, as for other joints."""
    positions: Mapping[str, float] = field(default_factory=dict)
    """Of joints at the start [rad or m]. Default: at rest."""

    @property
    def base_link(self) -> str:
        """Return the link that is put at the start."""
        return FOOTPRINT if FOOTPRINT in self.body.links else self.body.own_root


def outline_body(radius: float, height: float) -> Body:
    """Return the body of a robot of which only the outline is known: a cylinder 1 cm above the ground.

    It is not seen: the robot's own camera is within it.
    """
    span = Span("", 1, 1, 1, 1)
    length = max(height - 0.01, 0.01)
    shape = Shape(Geometry("cylinder", (radius, length)), Transform3((0.0, 0.0, 0.01 + length / 2)), span)
    return Body("robot", {FOOTPRINT: BodyLink(FOOTPRINT, span, collisions=(shape,))})


@dataclass(frozen=True, slots=True, eq=False)
class PlacedParts:
    """Rigid parts, and where each is in the frame of the base while all joints are where they start."""

    parts: Sequence[RigidPart]
    poses: Sequence[Transform3]

    @property
    def lowest(self) -> float:
        """Return the height of the lowest point of a shape [m]; 0 if there are no shapes."""
        return min((self.lowest_of(index) for index in range(len(self.parts)) if self.parts[index].shapes), default=0.0)

    def lowest_of(self, index: int) -> float:
        """Return the height of the lowest point of a part [m], inf without shapes."""
        return float(min((points[:, 2].min() for points in self.points_of(index)), default=math.inf))

    def points_of(self, index: int) -> list[Array]:
        """Return the outermost points of each shape of a part in the frame of the base (n, 3) [m]."""
        pose = self.poses[index]
        return [apply(pose.compose(at), solid.points) for _, solid, at in self.parts[index].shapes]

    @property
    def centre(self) -> Array:
        """Return the centre of all mass in the frame of the base (3,) [m]."""
        masses = np.array([part.mass for part in self.parts])
        centres = [apply(pose, part.centre[None])[0] for part, pose in zip(self.parts, self.poses, strict=True)]
        return np.asarray(masses @ np.array(centres) / masses.sum())

    def axis_of(self, index: int) -> Vector3:
        """Return the axis of the joint of a part in the frame of the base."""
        joint = self.parts[index].joint
        return rotate(self.poses[index].rotation, joint.axis) if joint else (0.0, 0.0, 0.0)


def placed_parts(robot: PhysicsRobot, parts: Sequence[RigidPart]) -> PlacedParts:
    """Return parts with their places at the start."""
    poses = [Transform3()]
    for part, joint in ((part, part.joint) for part in parts if part.joint is not None):
        moved = joint.origin.inverse().compose(joint.at(robot.body.position(joint, robot.positions)))
        poses.append(poses[part.parent].compose(part.origin).compose(moved))
    base = next(
        pose.compose(part.links[robot.base_link])
        for part, pose in zip(parts, poses, strict=True)
        if robot.base_link in part.links
    ).inverse()
    return PlacedParts(parts, [base.compose(pose) for pose in poses])


def find_wheels(placed: PlacedParts) -> PhysicsWheels | None:
    """Return the wheels that a body shows, or None.

    A wheel hangs on the base, or on its suspension, by a continuous joint whose axis points left or right; it reaches
    the ground, and is at one side. Without one at each side there are none.
    """
    ground = placed.lowest
    found: dict[str, tuple[Vector3, float]] = {}
    for index, part in enumerate(placed.parts):
        joint = part.joint
        if joint is None or joint.kind != "continuous" or joint.mimic is not None:
            continue
        x, y, z = placed.poses[index].translation
        middles = [points.mean(0) for points in placed.points_of(index)]
        centre = tuple(np.mean(middles, 0).tolist()) if middles else (x, y, z)
        is_wheel = (
            _is_on_base(placed.parts, part)
            and abs(placed.axis_of(index)[1]) > 0.9
            and placed.lowest_of(index) < ground + LEVEL
            and abs(centre[1]) > LEVEL
        )
        if is_wheel:
            found[joint.name] = (x, centre[1], z), z - min(placed.lowest_of(index), ground + LEVEL)
    left = tuple(name for name, (at, _) in found.items() if at[1] > 0)
    right = tuple(name for name, (at, _) in found.items() if at[1] < 0)
    if not (left and right):
        return None
    sides = [float(np.mean([found[name][0][1] for name in side])) for side in (left, right)]
    radius = float(np.mean([found[name][1] for name in (*left, *right)]))
    return PhysicsWheels(left, right, radius, sides[0] - sides[1])


def _is_on_base(parts: Sequence[RigidPart], part: RigidPart) -> bool:
    """Return whether a part hangs on the base, or on a suspension that slides on the base."""
    carrier = parts[part.parent]
    return part.parent == 0 or (carrier.parent == 0 and carrier.joint is not None and carrier.joint.slides)


def is_steady(placed: PlacedParts, ground: float) -> bool:
    """Return whether what reaches the ground carries the centre of mass: it lies well within their convex hull."""
    points = np.concatenate([points for index in range(len(placed.parts)) for points in placed.points_of(index)])
    carrying = points[points[:, 2] < ground + LEVEL / 2, :2] - placed.centre[:2]
    turn = np.arange(DIRECTIONS) * (math.tau / DIRECTIONS)
    return bool(carrying.size) and bool(
        ((np.stack((np.cos(turn), np.sin(turn)), -1) @ carrying.T).max(1) > STEADY).all()
    )


def is_tyre(placed: PlacedParts, index: int, ground: float) -> bool:
    """Return whether a part turns without end about a horizontal axis and reaches the ground itself."""
    joint = placed.parts[index].joint
    level = abs(placed.axis_of(index)[2]) < 0.1
    return joint is not None and joint.kind == "continuous" and level and placed.lowest_of(index) < ground + LEVEL


def rolls_freely(placed: PlacedParts, index: int, ground: float) -> bool:
    """Return whether a part hangs on a continuous joint and reaches the ground, itself or by what it carries."""
    joint = placed.parts[index].joint
    if joint is None or joint.kind != "continuous" or joint.mimic is not None:
        return False
    carried = {index}
    for other in range(index + 1, len(placed.parts)):
        if placed.parts[other].parent in carried:
            carried.add(other)
    return min(map(placed.lowest_of, carried)) < ground + LEVEL
