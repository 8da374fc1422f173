"""Whether an arm collides: with the body that carries it, with itself, and with objects."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from itertools import combinations
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from rbxcompose.body.model import Body, Geometry
from rbxcompose.geometry import Transform3
from rbxcompose.motion.arm_kinematics import ArmKinematics
from rbxcompose.motion.groups import moved_links
from rbxcompose.motion.scene import PlacedObject

Array = NDArray[np.float64]
LinkPair = tuple[str, str]
"""Two links or objects, in the order of the alphabet."""
Coal = Any  # of an extra, without types

TOUCH = 1e-4
"""[m] by which shapes of the body may be within each other: those of a servo and its bracket touch, and whether faces
that touch collide is decided by rounding."""


class Checker(Protocol):
    """Whether positions of an arm's joints, of shape (n,), collide."""

    def is_free(self, values: Array) -> bool:
        """Return whether nothing collides."""
        ...

    def colliding(self, values: Array) -> list[LinkPair]:
        """Return all pairs that collide."""
        ...


def pair_of(first: str, second: str) -> LinkPair:
    """Return two names as a pair."""
    return (first, second) if first <= second else (second, first)


def told(pairs: Collection[LinkPair], most: int = 3) -> str:
    """Return pairs in words."""
    words = [f"'{first}' and '{second}'" for first, second in list(pairs)[:most]]
    return "; ".join(words) + (f"; and {len(pairs) - most} more pairs" if len(pairs) > most else "")


def adjacent_pairs(body: Body) -> frozenset[LinkPair]:
    """Return the links that a joint connects, also if frames without a shape are fixed between it and the upper one."""
    found = set()
    for joint in body.joints.values():
        link = joint.parent
        while not body.links[link].collisions and link in body.joint_above and not body.joint_above[link].moves:
            link = body.joint_above[link].parent
        found.add(pair_of(link, joint.child))
    return frozenset(found)


class MeshChecker:
    """Examines the collision shapes of the body as they are, by coal and its tree of bounding boxes.

    Pairs that the arm does not move relative to each other, and those in `allowed`, do not count. One thread at a time
    may use it.
    """

    def __init__(
        self,
        model: ArmKinematics,
        meshes: Mapping[str, Path],
        allowed: Collection[LinkPair] = frozenset(),
        objects: Iterable[PlacedObject] = (),
    ) -> None:
        """Build it; `meshes` are the files of meshes by their names in the URDF.

        Raises:
            ModuleNotFoundError: without Pinocchio.
            ValueError: if a mesh cannot be read.
        """
        import pinocchio

        self._pinocchio, self._model = pinocchio, model
        self._geometry: Any = pinocchio.GeometryModel()
        self._owners: list[str] = []
        self._moved = dict(moved_links(model.body, model.group.joints))
        for link in model.body.links.values():
            for shape in link.collisions:
                self._add(link.name, link.name, coal_shape(shape.geometry, meshes), shape.origin)
        touching = set(allowed)
        for one in objects:
            self._moved[one.name] = self._moved[one.link]
            self._add(one.name, one.link, coal_shape(one.shape, {}), one.pose)
            touching |= {pair_of(one.name, link) for link in one.touches}
        self._pair(touching)
        self._data = self._geometry.createData()
        for request in self._data.collisionRequests:
            request.security_margin = -TOUCH
        self._manager = pinocchio.BroadPhaseManager_DynamicAABBTreeCollisionManager(
            model.whole.model, self._geometry, self._data
        )

    def is_free(self, values: Array) -> bool:
        """Return whether nothing collides."""
        whole, find = self._model.whole, self._pinocchio.computeCollisions
        return not find(whole.model, whole.data, self._manager, self._model.q(values), True)

    def colliding(self, values: Array) -> list[LinkPair]:
        """Return all pairs that collide, without the help of the tree."""
        whole = self._model.whole
        self._pinocchio.computeCollisions(
            whole.model, whole.data, self._geometry, self._data, self._model.q(values), False
        )
        found = (
            pair_of(self._owners[pair.first], self._owners[pair.second])
            for pair, result in zip(self._geometry.collisionPairs, self._data.collisionResults, strict=True)
            if result.isCollision()
        )
        return list(dict.fromkeys(found))

    def distance(self, values: Array) -> tuple[float, LinkPair]:
        """Return the least distance [m], and the pair that has it; it takes milliseconds with meshes."""
        whole = self._model.whole
        nearest = self._pinocchio.computeDistances(
            whole.model, whole.data, self._geometry, self._data, self._model.q(values)
        )
        pair = self._geometry.collisionPairs[nearest]
        owners = pair_of(self._owners[pair.first], self._owners[pair.second])
        return float(self._data.distanceResults[nearest].min_distance), owners

    def _add(self, owner: str, link: str, shape: Coal, origin: Transform3) -> None:
        frame = self._model.whole.model.frames[self._model.whole.frames[link]]
        placement = frame.placement * self._pinocchio.XYZQUATToSE3(
            np.array((*origin.translation, *origin.rotation), dtype=float)
        )
        name = f"{owner}_{len(self._owners)}"
        self._owners.append(owner)
        self._geometry.addGeometryObject(
            self._pinocchio.GeometryObject(name, frame.parentJoint, frame.parentFrame, placement, shape)
        )

    def _pair(self, allowed: Collection[LinkPair]) -> None:
        moved = self._moved
        for first, second in combinations(range(len(self._owners)), 2):
            one, other = self._owners[first], self._owners[second]
            if moved[one] != moved[other] and pair_of(one, other) not in allowed:
                self._geometry.addCollisionPair(self._pinocchio.CollisionPair(first, second))


def coal_shape(geometry: Geometry, meshes: Mapping[str, Path]) -> Coal:
    """Return a shape for coal; its axes are those of URDF.

    Raises:
        ValueError: if it is a mesh that cannot be read.
    """
    import coal

    match geometry.kind:
        case "box":
            return coal.Box(*geometry.size)
        case "sphere":
            return coal.Sphere(*geometry.size)
        case "cylinder":
            return coal.Cylinder(*geometry.size)
        case "capsule":
            return coal.Capsule(*geometry.size)
    path, scale = meshes.get(geometry.file), np.array(geometry.size or (1.0, 1.0, 1.0))
    try:
        if path is None:
            raise ValueError("there is no such file")
        return coal.MeshLoader().load(str(path), scale)
    except (ValueError, RuntimeError) as error:
        raise ValueError(f"the mesh '{geometry.file}' cannot be read: {error}") from error
