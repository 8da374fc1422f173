"""A second opinion on a motion: Pinocchio's own reading of the URDF and its own geometry, every pair tried by itself.

It shares the shapes of objects, the meshes that are not STL, since it would misread them, and the pairs that may touch
with the examination of a plan, and nothing else: neither its broad phase nor its samples. So what benchmarks call free
does not rest on what the planner believes.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from itertools import combinations
from typing import Any

import numpy as np

from rbxcompose.domains.arms.motion.collisions import STL, TOUCH, coal_shape
from rbxcompose.domains.arms.motion.groups import Array, leader_of
from rbxcompose.domains.arms.motion.parametrisation import Trajectory
from rbxcompose.domains.arms.motion.scene import PlacedObject
from rbxcompose.domains.body.description import Description
from rbxcompose.domains.body.link_pairs import LinkPair, pair_of
from rbxcompose.domains.body.model import Geometry
from rbxcompose.domains.body.pinocchio_model import PinocchioModel

GRID = 20  # instants for each point of a trajectory, at which its greatest speed is looked for


class SecondChecker:
    """The body among objects; pairs in `allowed` do not count, nor those that the arm does not move to each other."""

    def __init__(
        self,
        description: Description,
        joints: tuple[str, ...],
        allowed: Collection[LinkPair],
        objects: Iterable[PlacedObject] = (),
        positions: Mapping[str, float] | None = None,
    ) -> None:
        """Build it; `joints` are those of the arm, `positions` where all others are [rad or m], or they are at rest."""
        import pinocchio

        self._pinocchio, self._joints, self._positions = pinocchio, joints, dict(positions or {})
        self._whole = PinocchioModel(description)
        model, text = self._whole.model, description.text
        for name, path in description.meshes.items():
            text = text.replace(f'"{name}"', f'"{path.absolute()}"')
        self._geometry: Any = pinocchio.buildGeomFromUrdfString(model, text, pinocchio.COLLISION)
        for geometry_object in self._geometry.geometryObjects:
            is_mesh = str(geometry_object.geometry.getObjectType()) == "OT_BVH"
            if is_mesh and not geometry_object.meshPath.lower().endswith(STL):
                geometry_object.geometry = coal_shape(
                    Geometry("mesh", tuple(geometry_object.meshScale), geometry_object.meshPath), {}
                )
        owners = [model.frames[object_.parentFrame].name for object_ in self._geometry.geometryObjects]
        touching, there = set(allowed), tuple(objects)
        for thing in there:
            owners += [thing.name] * self._add(thing)
            touching |= {pair_of(thing.name, other) for other in (*thing.touches, *thing.touches_objects)}
        every = description.body.joints
        arm = {model.getJointId(name) for name, joint in every.items() if leader_of(joint, every)[0] in joints}
        moved = [arm & set(model.supports[object_.parentJoint]) for object_ in self._geometry.geometryObjects]
        for first, second in combinations(range(len(owners)), 2):
            if moved[first] != moved[second] and pair_of(owners[first], owners[second]) not in touching:
                self._geometry.addCollisionPair(pinocchio.CollisionPair(first, second))
        self._data = self._geometry.createData()
        for request, pair in zip(self._data.collisionRequests, self._geometry.collisionPairs, strict=True):
            shapes = (self._geometry.geometryObjects[one].geometry for one in (pair.first, pair.second))
            is_alike = len({str(shape.getObjectType()) for shape in shapes}) == 1
            request.security_margin = -TOUCH if is_alike else 0.0  # coal has none between a mesh and another shape

    def is_free(self, values: Array) -> bool:
        """Return whether nothing collides at positions of the arm's joints, of shape (n,)."""
        whole, at = self._whole, dict(zip(self._joints, values.tolist(), strict=True))
        q = whole.q({**self._positions, **at})
        return not self._pinocchio.computeCollisions(whole.model, whole.data, self._geometry, self._data, q, True)

    def is_free_along(self, trajectory: Trajectory, step: float) -> bool:
        """Return whether nothing collides on the curves of a motion, every `step` [rad or m]."""
        return all(map(self.is_free, sampled(trajectory, step)))

    def _add(self, thing: PlacedObject) -> int:
        """Add an object; return how many shapes it has."""
        pinocchio, pieces = self._pinocchio, tuple(thing.all_pieces)
        frame = self._whole.model.frames[self._whole.frames[thing.link]]
        for number, piece in enumerate(pieces):
            pose = np.array((*piece.pose.translation, *piece.pose.rotation), dtype=float)
            placement, shape = frame.placement * pinocchio.XYZQUATToSE3(pose), coal_shape(piece.shape, {})
            name = f"{thing.name}/{number}"
            self._geometry.addGeometryObject(pinocchio.GeometryObject(name, frame.parentJoint, placement, shape))
        return len(pieces)


def sampled(trajectory: Trajectory, step: float) -> Array:
    """Return positions on the curves of a motion, of shape (m, n), at equal times, at most `step` [rad or m] apart."""
    grid = _at(trajectory, GRID * len(trajectory.times))
    farthest = float(np.abs(np.diff(grid, axis=0)).max()) * (len(grid) - 1)  # if it always went as fast as it does once
    return _at(trajectory, math.ceil(1.1 * farthest / step) + 2)


def _at(trajectory: Trajectory, count: int) -> Array:
    """Return positions at equal times, of shape (count, n), by Hermite's cubic base functions."""
    knots, times = trajectory.times, np.linspace(0.0, trajectory.duration, count)
    index = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, len(knots) - 2)
    length = np.diff(knots)[index]
    s = ((times - knots[index]) / length)[:, None]
    rest, h = 1.0 - s, length[:, None]
    places = (1.0 + 2.0 * s) * rest**2 * trajectory.positions[index] + s**2 * (3.0 - 2.0 * s) * trajectory.positions[
        index + 1
    ]
    return np.asarray(
        places + h * s * rest * (rest * trajectory.velocities[index] - s * trajectory.velocities[index + 1])
    )
