"""The parts of a body that do not move against themselves, each with its mass."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from pathlib import Path

from rbxcompose.base.arrays import Array, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.body.model import FLOATING, Body, BodyJoint, BodyLink
from rbxcompose.domains.worlds.physics.solids import (
    BodyRepair,
    BodyRepairs,
    PhysicalShape,
    apply,
    box_inertia,
    rotation_matrix,
    shapes_of,
)

GRAVITY = 9.81  # [m/s^2]
DENSITY = 300.0  # of what has no mass: robots are mostly hollow [kg/m^3]
LEAST_MASS = 1e-3  # of what moves [kg]
ROUNDING = 1e-6  # relative error of moments that are written with few digits


@dataclass(slots=True, eq=False)
class RigidPart:
    """Links that are fixed to each other; its frame is that of the first one."""

    parent: int
    """The index of the part that carries it, -1 for the first."""
    joint: BodyJoint | None
    """What moves it; None for the first."""
    origin: Transform3
    """Where the joint is in the part that carries it, at position 0."""
    links: dict[str, Transform3] = field(default_factory=dict)
    """The frame of each of its links."""
    shapes: list[tuple[str, PhysicalShape, Transform3]] = field(default_factory=list)
    """Each collision shape with its link, and its frame in that of this part."""
    mass: float = 0.0
    """In kg."""
    centre: Array = field(default_factory=lambda: np.zeros(3))
    """Of mass (3,) [m]."""
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))
    """About the centre, along the axes of the frame (3, 3) [kg m^2]."""

    def add_mass(self, mass: float, centre: Array, inertia: Array) -> None:
        """Add a mass with its centre and its inertia about it, both in this frame (parallel axis theorem)."""
        if (whole := self.mass + mass) <= 0.0:
            return
        apart = centre - self.centre
        steiner = (self.mass * mass / whole) * (apart @ apart * np.eye(3) - np.outer(apart, apart))
        self.centre = self.centre + apart * (mass / whole)
        self.inertia = self.inertia + inertia + steiner
        self.mass = whole


def rigid_parts(body: Body, meshes: Mapping[str, Path], repairs: BodyRepairs) -> list[RigidPart]:
    """Return the parts of a body, each after the one that carries it, with masses that a physics engine accepts.

    The first one may have none: if it moves, call `ensure_mass` for it.
    """
    parts = [RigidPart(-1, None, Transform3(), {body.own_root: Transform3()})]
    places = {body.own_root: 0}
    for joint in body.joints_downwards:
        if joint.parent not in places:  # the frame above a virtual joint
            continue
        carrier = places[joint.parent]
        origin = parts[carrier].links[joint.parent].compose(joint.origin)
        if joint.moves:
            places[joint.child] = len(parts)
            parts.append(RigidPart(carrier, joint, origin, {joint.child: Transform3()}))
            continue
        if joint.kind in FLOATING:
            repairs.append(BodyRepair(joint.child, f"its joint '{joint.name}' is {joint.kind}: it is fixed"))
        places[joint.child] = carrier
        parts[carrier].links[joint.child] = origin
    for index, part in enumerate(parts):
        for name, pose in part.links.items():
            link = body.links[name]
            shapes = link.collisions
            if not shapes and link.visuals and part.parent == 0 and part.joint and part.joint.kind == "continuous":
                shapes = link.visuals
                repairs.append(BodyRepair(name, "it turns without end, as wheels do: it collides as it looks"))
            solids = shapes_of(link, shapes, meshes, repairs)
            part.shapes += [(name, solid, pose.compose(solid.origin)) for solid in solids]
            _add_inertial(part, link, pose, solids, meshes, repairs)
        if index:
            ensure_mass(part, body, meshes, repairs)
    return parts


def _add_inertial(
    part: RigidPart,
    link: BodyLink,
    pose: Transform3,
    solids: list[PhysicalShape],
    meshes: Mapping[str, Path],
    repairs: BodyRepairs,
) -> None:
    """Add the mass of a link, and its inertia if a solid can have it."""
    if link.inertial is None or link.inertial.mass <= 0.0:
        return
    at = pose.compose(link.inertial.origin)
    xx, xy, xz, yy, yz, zz = link.inertial.inertia
    inertia = np.array(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))
    moments = np.linalg.eigvalsh(inertia)
    mass, turn = link.inertial.mass, rotation_matrix(at.rotation)
    if moments[0] > 0.0 and moments[:2].sum() >= moments[2] * (1 - ROUNDING):
        part.add_mass(mass, np.array(at.translation), turn @ inertia @ turn.T)
        return
    solids = solids or shapes_of(link, link.visuals, meshes, [])
    points = np.concatenate([solid.placed for solid in solids]) if solids else np.zeros((1, 3))
    _, boxed = box_inertia(mass, points.min(0), points.max(0))
    what = "the box around its shapes" if solids else "a cube of 1 mm"
    repairs.append(BodyRepair(link.name, f"its inertia is none of a solid: that of {what} counts"))
    turn = rotation_matrix(pose.rotation)
    part.add_mass(mass, np.array(at.translation), turn @ boxed @ turn.T)


def ensure_mass(part: RigidPart, body: Body, meshes: Mapping[str, Path], repairs: BodyRepairs) -> None:
    """Give a part without mass that of its shapes, and one that is a point some inertia."""
    name = next(iter(part.links))
    if part.mass >= LEAST_MASS:
        if np.linalg.eigvalsh(part.inertia)[0] <= 0.0:
            repairs.append(BodyRepair(name, "it has no inertia: that of a cube of 1 cm is added"))
            part.inertia = part.inertia + np.eye(3) * (part.mass * 1e-4 / 6)
        return
    points = [apply(pose, solid.points) for _, solid, pose in part.shapes]
    for link, pose in part.links.items() if not points else ():
        points += [
            apply(pose, solid.placed) for solid in shapes_of(body.links[link], body.links[link].visuals, meshes, [])
        ]
    whole = np.concatenate(points) if points else np.array(((-0.005,) * 3, (0.005,) * 3))
    low, high = whole.min(0), whole.max(0)
    mass = max(LEAST_MASS, DENSITY * float(np.maximum(high - low, 1e-3).prod()))
    centre, inertia = box_inertia(mass, low, high)
    part.mass, part.centre, part.inertia = mass, np.array(centre), inertia
    what = "the box around its shapes" if points else "a cube of 1 cm"
    repairs.append(BodyRepair(name, f"it has no mass: it is as heavy as {what} with {DENSITY:g} kg/m^3, {mass:.3g} kg"))
