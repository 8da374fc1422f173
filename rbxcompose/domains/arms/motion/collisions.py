"""Whether an arm collides: with the body that carries it, with itself, and with objects; and which links ever do."""

from __future__ import annotations

import atexit
import gc
from collections.abc import Callable, Collection, Generator, Iterable, Mapping
from copy import copy
from importlib import import_module
from itertools import chain, combinations, product
from pathlib import Path
from types import MappingProxyType
from typing import Any, Protocol

from rbxcompose.base.arrays import Array, ArrayLike, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.groups import ArmGroup, ArmJoint, JointSpace, moved_links, solid_link
from rbxcompose.domains.arms.motion.octree_files import cells_in
from rbxcompose.domains.arms.motion.parametrisation import toppra
from rbxcompose.domains.arms.motion.scene import PairDistance, PlacedObject
from rbxcompose.domains.body.description import Description
from rbxcompose.domains.body.link_pairs import CollisionMatrix, LinkPair, PairReason, digest_of, pair_of
from rbxcompose.domains.body.meshes import read_mesh
from rbxcompose.domains.body.model import Body, BodyJoint, Geometry
from rbxcompose.domains.servos.limits import MotionLimits

Coal = Any  # of an extra, without types
STL = ".stl"
"""The ending of meshes that coal reads rightly; those of others may have pieces, whose corners it confuses."""
_READERS = ("trimesh", "collada")


def readers_of(files: Iterable[str]) -> tuple[str, ...]:
    """Return the modules beside coal that read some files of meshes."""
    return () if all(file.lower().endswith(STL) for file in files) else _READERS


class Shapes:
    """Shapes for coal, each made once; `meshes` are the files of meshes by their names."""

    def __init__(self, meshes: Mapping[str, Path]) -> None:
        self._meshes = meshes
        self._made: dict[Geometry, Coal] = {}

    def of(self, geometry: Geometry) -> Coal:
        """Return a shape.

        Raises:
            ModuleNotFoundError: without the extra `arm`.
            ValueError: if it is a mesh that cannot be read.
        """
        if geometry not in self._made:
            self._made[geometry] = coal_shape(geometry, self._meshes)
        return self._made[geometry]

    def keep(self, wanted: Iterable[Geometry]) -> None:
        """Forget all other shapes: those of clouds of points are large, and come again and again."""
        kept = set(wanted)
        self._made = {geometry: made for geometry, made in self._made.items() if geometry in kept}


def coal_shape(geometry: Geometry, meshes: Mapping[str, Path]) -> Coal:
    """Return a shape for coal; a mesh that `meshes` does not name is a file of this name.

    Raises:
        ModuleNotFoundError: without the extra `arm`.
        ValueError: if its file cannot be read.
    """
    import coal

    match geometry.kind:
        case "box":
            return coal.Box(*geometry.size)
        case "sphere":
            return coal.Sphere(*geometry.size)
        case "cylinder":
            return coal.Cylinder(*geometry.size)
        case "cone":
            return coal.Cone(*geometry.size)
        case "capsule":
            return coal.Capsule(*geometry.size)
        case "plane":
            return coal.Halfspace(np.array(geometry.size[:3]), -geometry.size[3])
        case "octree":
            return coal.makeOctree(*cells_in(geometry))
    scale = np.array(geometry.size or (1.0, 1.0, 1.0))
    if geometry.points:
        return _triangles(np.array(geometry.points).reshape(-1, 3) * scale, geometry.triangles)
    return _from_file(meshes.get(geometry.file, Path(geometry.file)), geometry.file, scale)


def _from_file(path: Path, name: str, scale: Array) -> Coal:
    import coal

    if not path.is_file():
        raise ValueError(f"the mesh '{name}' cannot be read: there is no such file")
    if path.suffix.lower() != STL:
        return _of_pieces(path, name, scale)
    try:
        loaded = coal.MeshLoader().load(str(path), scale)
    except (ValueError, RuntimeError) as error:  # its text is about coal's own files
        raise ValueError(f"the mesh '{name}' cannot be read: it is none") from error
    _prove_finite(np.asarray(loaded.vertices()), name)
    loaded.computeLocalAABB()
    return loaded


def _of_pieces(path: Path, name: str, scale: Array) -> Coal:
    for module in _READERS:
        import_module(module)  # a missing one would look like a broken file
    solid = read_mesh(path, name)
    _prove_finite(solid.vertices, name)
    return _triangles(solid.vertices * scale, solid.faces)


def _prove_finite(corners: Array, name: str) -> None:
    if not np.isfinite(corners).all():
        raise ValueError(f"the mesh '{name}' cannot be read: a corner of it is no finite point")


def _triangles(corners: Array, triangles: ArrayLike) -> Coal:
    import coal

    faces = np.asarray(triangles, dtype=np.int64).reshape(-1, 3)
    made = coal.BVHModelOBBRSS()
    made.beginModel(len(faces), len(corners))
    made.addVertices(corners)
    made.addTriangles(faces)
    made.endModel()
    made.computeLocalAABB()
    return made


SAMPLES, SEED = 200, 1


def unavoidable_pairs(samples: Array, colliding: Callable[[Array], Collection[LinkPair]]) -> frozenset[LinkPair]:
    """Return the pairs that collide at all of some positions, of shape (count, n): nobody could avoid that."""
    found: frozenset[LinkPair] | None = None
    for values in samples:
        here = frozenset(colliding(values))
        found = here if found is None else found & here
        if not found:
            break
    return found or frozenset()


TOUCH = 1e-4
"""[m] by which shapes of the body may be within each other: those of a servo and its bracket touch, and whether faces
that touch collide is decided by rounding."""
FLAT = 1e-9  # [m], the thickness of the box around a mesh that is flat
MOST_PAIRS = 5_000  # of shapes, whose distances are listed
_GEOM, _BVH = "OT_GEOM", "OT_BVH"  # coal's kinds of shapes


class Checker(Protocol):
    """Whether positions of an arm's joints, of shape (n,), collide."""

    def is_free(self, values: Array) -> bool:
        """Return whether nothing collides."""

    def colliding(self, values: Array) -> list[LinkPair]:
        """Return all pairs that collide."""

    def without(self, pairs: Collection[LinkPair]) -> Checker:
        """Return a checker that does not watch some pairs."""

    def in_the_way(self, values: Array, shape: Geometry, at: Transform3, ignored: Collection[str]) -> list[str]:
        """Return the links and objects but those `ignored` that a shape, at a pose in the root's frame, is within."""


def pairs_shown(pairs: Collection[LinkPair], most: int = 3) -> str:
    """Return pairs in words."""
    words = [f"'{first}' and '{second}'" for first, second in list(pairs)[:most]]
    return "; ".join(words) + (f"; and {len(pairs) - most} more pairs" if len(pairs) > most else "")


def adjacent_pairs(body: Body) -> frozenset[LinkPair]:
    """Return the links that a joint connects, also if frames without a shape are fixed between it and the upper one."""
    return frozenset(pair_of(solid_link(body, joint.parent), joint.child) for joint in body.joints.values())


@dataclass(frozen=True, slots=True)
class CheckedPart:
    """A shape that is examined: with which link it moves, where it is in the link's frame, and as coal has it."""

    geometry: Geometry
    link: str
    origin: Transform3
    coal: Coal


class MeshChecker:
    """Examines the collision shapes of the body as they are, by coal and its tree of bounding boxes.

    Pairs that the arm does not move relative to each other, and those in `allowed`, do not count. Links keep away from
    objects by the `paddings` [m] of both. One thread at a time may use it.
    """

    def __init__(
        self,
        model: ArmKinematics,
        meshes: Mapping[str, Path],
        allowed: Collection[LinkPair] = frozenset(),
        objects: Iterable[PlacedObject] = (),
        paddings: Mapping[str, float] = MappingProxyType({}),
        shapes: Shapes | None = None,
        *,
        is_rigid: bool = False,
    ) -> None:
        """Build it; `meshes` are the files of meshes by their names in the URDF, `shapes` those that were read before.

        With `is_rigid`, it examines only the pairs that it would else leave out since nothing moves between them.

        Raises:
            ModuleNotFoundError: without Pinocchio.
            ValueError: if a mesh cannot be read.
        """
        import pinocchio

        self._pinocchio, self.kinematics = pinocchio, model
        self._geometry: Any = pinocchio.GeometryModel()
        self._owners: list[str] = []
        self.parts: list[CheckedPart] = []  # all shapes, in the order in which `watched_parts` counts them
        self._kinds: list[str] = []  # coal's kind of each shape
        self._moved = dict(moved_links(model.body, model.group.joints))
        self._paddings = dict(paddings)
        known = shapes if shapes is not None else Shapes(meshes)
        for link in model.body.links.values():
            for shape in link.collisions:
                self._add(link.name, link.name, known, shape.geometry, shape.origin)
        touching, there = set(allowed), tuple(objects)
        self._objects = {object_.name for object_ in there}
        for thing in there:
            self._moved[thing.name], self._paddings[thing.name] = (self._moved[thing.link], thing.padding)
            for piece in thing.all_pieces:
                self._add(thing.name, thing.link, known, piece.shape, piece.pose)
            touching |= {pair_of(thing.name, other) for other in (*thing.touches, *thing.touches_objects)}
        self._pair(touching, is_rigid)
        self._prepare()

    def is_free(self, values: Array) -> bool:
        """Return whether nothing collides."""
        whole, find = self.kinematics.whole, self._pinocchio.computeCollisions
        if find(whole.model, whole.data, self._manager, self.kinematics.q(values), True):
            return False
        check = self._pinocchio.computeCollision
        return not any(check(self._geometry, self._data, index) for index in self._apart)

    def colliding(self, values: Array) -> list[LinkPair]:
        """Return all pairs that collide, without the help of the tree."""
        whole = self.kinematics.whole
        self._pinocchio.computeCollisions(
            whole.model, whole.data, self._geometry, self._data, self.kinematics.q(values), False
        )
        found = (
            pair_of(self._owners[pair.first], self._owners[pair.second])
            for pair, result in zip(self._geometry.collisionPairs, self._data.collisionResults, strict=True)
            if result.isCollision()
        )
        return list(dict.fromkeys(found))

    def in_the_way(self, values: Array, shape: Geometry, at: Transform3, ignored: Collection[str]) -> list[str]:
        """Return the links and objects but those `ignored` that a shape, at a pose in the root's frame, is within."""
        import coal

        whole, placed = self.kinematics.whole, coal_shape(shape, {})
        self._pinocchio.updateGeometryPlacements(
            whole.model, whole.data, self._geometry, self._data, self.kinematics.q(values)
        )
        x, y, z, w = at.rotation
        there = coal.Transform3s(coal.Quaternion(w, x, y, z), np.array(at.translation))
        found = dict[str, None]()
        for index, owner in enumerate(self._owners):
            if owner in ignored or owner in found:
                continue
            own, result = self._data.oMg[index], coal.CollisionResult()
            other = coal.Transform3s(own.rotation, own.translation)
            geometry = self._geometry.geometryObjects[index].geometry
            if coal.collide(geometry, other, placed, there, coal.CollisionRequest(), result):
                found[owner] = None
        return list(found)

    @property
    def watched(self) -> frozenset[str]:
        """Return the links and objects that belong to a pair."""
        return frozenset(name for pair in self.watched_pairs for name in pair)

    def pairs(self, values: Array, between: Collection[str] = ()) -> tuple[PairDistance, ...]:
        """Return the distances of the pairs with all of `between`: what collides first, then the nearest.

        Of very many pairs only those that collide are reported. How deep meshes are within each other is an estimate of
        coal's. One distance is computed at a time, so that other threads run: meshes take milliseconds.
        """
        colliding, found = set(self.colliding(values)), dict[LinkPair, float]()
        wanted = [
            (index, owners)
            for index, pair in enumerate(self._geometry.collisionPairs)
            if set(between) <= set(owners := pair_of(self._owners[pair.first], self._owners[pair.second]))
        ]
        if len(wanted) > MOST_PAIRS:
            wanted = [(index, owners) for index, owners in wanted if owners in colliding]
        for index, owners in wanted:
            result = self._pinocchio.computeDistance(self._geometry, self._data, index)
            distance = float(result.min_distance)
            found[owners] = min(distance, found.get(owners, distance))
        each = (PairDistance(*owners, distance, owners in colliding) for owners, distance in found.items())
        return tuple(sorted(each, key=lambda pair_distance: (not pair_distance.collides, pair_distance.distance)))

    def without(self, pairs: Collection[LinkPair]) -> MeshChecker:
        """Return a checker of the same shapes that does not watch some pairs."""
        made = copy(self)
        made._geometry = self._geometry.copy()
        made._geometry.removeAllCollisionPairs()
        for pair in self._geometry.collisionPairs:
            if pair_of(self._owners[pair.first], self._owners[pair.second]) not in pairs:
                made._geometry.addCollisionPair(self._pinocchio.CollisionPair(pair.first, pair.second))
        made._prepare()
        return made

    @property
    def watched_pairs(self) -> set[LinkPair]:
        """Return the pairs that it examines."""
        pairs = self._geometry.collisionPairs
        return {pair_of(self._owners[pair.first], self._owners[pair.second]) for pair in pairs}

    def collides(self, values: Array, pairs: Iterable[int]) -> bool:
        """Return whether one of some pairs collides, by their places in `watched_parts`."""
        whole, check = self.kinematics.whole, self._pinocchio.computeCollision
        self._pinocchio.updateGeometryPlacements(
            whole.model, whole.data, self._geometry, self._data, self.kinematics.q(values)
        )
        return any(check(self._geometry, self._data, pair) for pair in pairs)

    def _prepare(self) -> None:
        self._data = self._geometry.createData()
        # Pairs with a plane, of which the tree overlooks some that are inclined or keep a distance; and
        # with a flat mesh, since it takes boxes without a thickness for empty.
        self._apart: list[int] = []
        self.watched_parts: list[tuple[int, int, float]] = []  # pairs, and how far they must be from each other [m]
        # Asking coal for each pair takes long.
        overlooked = [self._is_overlooked(one) for one in range(len(self._owners))]
        requests = zip(self._data.collisionRequests, self._geometry.collisionPairs, strict=True)
        for index, (request, pair) in enumerate(requests):
            first, second = pair.first, pair.second
            request.security_margin = margin = self._margin(first, second)
            self.watched_parts.append((first, second, margin))
            if overlooked[first] or overlooked[second]:
                self._apart.append(index)
        self._manager = self._pinocchio.BroadPhaseManager_DynamicAABBTreeCollisionManager(
            self.kinematics.whole.model, self._geometry, self._data
        )

    def _add(self, owner: str, link: str, known: Shapes, geometry: Geometry, origin: Transform3) -> None:
        frame = self.kinematics.whole.model.frames[self.kinematics.whole.frames[link]]
        placement = frame.placement * self._pinocchio.XYZQUATToSE3(
            np.array((*origin.translation, *origin.rotation), dtype=float)
        )
        name = f"{owner}_{len(self._owners)}"
        self._owners.append(owner)
        self.parts.append(CheckedPart(geometry, link, origin, shape := known.of(geometry)))
        self._kinds.append(str(shape.getObjectType()))
        self._geometry.addGeometryObject(
            self._pinocchio.GeometryObject(name, frame.parentJoint, frame.parentFrame, placement, shape)
        )

    def _pair(self, allowed: Collection[LinkPair], is_rigid: bool) -> None:
        """Watch all pairs that the arm moves relative to each other; most of a large scene does not move at all."""
        together: dict[frozenset[str], list[int]] = {}
        for index, owner in enumerate(self._owners):
            together.setdefault(self._moved[owner], []).append(index)
        if is_rigid:
            pairs = chain.from_iterable(combinations(numbers, 2) for numbers in together.values())
        else:
            pairs = chain.from_iterable(product(*groups) for groups in combinations(together.values(), 2))
        for first, second in pairs:
            text, other = self._owners[first], self._owners[second]
            if text != other and pair_of(text, other) not in allowed:
                pair = self._pinocchio.CollisionPair(min(first, second), max(first, second))
                self._geometry.addCollisionPair(pair)

    def _is_overlooked(self, shape: int) -> bool:
        geometry = self._geometry.geometryObjects[shape].geometry
        if self._kinds[shape] != _BVH:
            return str(geometry.getNodeType()) == "GEOM_HALFSPACE"
        return bool(np.min(geometry.aabb_local.max_ - geometry.aabb_local.min_) < FLAT)

    def _margin(self, first: int, second: int) -> float:
        """Return how far two shapes keep from each other [m]; coal lets meshes be within nothing but meshes."""
        name, other, kind = self._owners[first], self._owners[second], self._kinds[first]
        is_of_body = name not in self._objects and other not in self._objects
        margin = -TOUCH + (0.0 if is_of_body else self._paddings.get(name, 0.0) + self._paddings.get(other, 0.0))
        return margin if kind == self._kinds[second] and kind in (_GEOM, _BVH) else max(margin, 0.0)


def load_libraries(*, with_ompl: bool) -> None:
    """Import what planning needs, which takes seconds and should not delay the first goal.

    Where a search of ours comes first, OMPL is for what that does not find in time, and can be imported then.

    Raises:
        ModuleNotFoundError: if the extra `arm` is not installed.
    """
    atexit.unregister(gc.freeze)  # without a last collection at the exit, OMPL prints all that it had
    if with_ompl:
        import_module("ompl.geometric")
    toppra()


def always_colliding(
    kinematics: ArmKinematics, space: JointSpace, meshes: Mapping[str, Path]
) -> tuple[frozenset[LinkPair], frozenset[LinkPair]]:
    """Return the links that a joint connects, and further pairs that collide wherever the arm is.

    Raises:
        ValueError: if a mesh cannot be read.
    """
    adjacent = adjacent_pairs(kinematics.body)
    checker = MeshChecker(kinematics, meshes, adjacent)
    return adjacent, unavoidable_pairs(space.samples(SAMPLES, SEED), checker.colliding)


AT_ONCE = 100  # positions after which it lets others run


def sampled_matrix(description: Description, samples: int, seed: int) -> Generator[int, None, CollisionMatrix]:
    """Return the matrix of a body; yield how many positions were tried.

    Joints have the limits of the URDF, which are the widest; those without limits go half a turn each way. The same
    seed gives the same matrix. What no joint moves is known without trying.

    Raises:
        ModuleNotFoundError: if the extra `arm` is not installed.
        ValueError: if a mesh cannot be read.
    """
    body = description.body
    space = whole_space(body)
    kinematics = ArmKinematics(description, ArmGroup(space.names, body.root, body.root))
    rest = np.array([body.joints[name].rest for name in space.names])
    rigid = MeshChecker(kinematics, description.meshes, is_rigid=True)
    every = MeshChecker(kinematics, description.meshes)
    pairs = every.watched_pairs
    there = rigid.watched_pairs | pairs
    adjacent = adjacent_pairs(body) & there
    touching = frozenset(rigid.colliding(rest))
    at_rest = frozenset(every.colliding(rest)) - adjacent
    always, colliding = set(at_rest), set(at_rest)
    unseen, lasting = every.without(adjacent | colliding), every.without(pairs - always)
    for count, values in enumerate(space.samples(samples, seed), 1):
        if not unseen.is_free(values):
            colliding.update(unseen.colliding(values))
            unseen = every.without(adjacent | colliding)
        if always and len(still := always.intersection(lasting.colliding(values))) < len(always):
            always = still
            lasting = every.without(pairs - always)
        if count % AT_ONCE == 0:
            yield count
    reasons: dict[LinkPair, PairReason] = dict.fromkeys(there - colliding - touching, "never")
    reasons.update(dict.fromkeys(at_rest, "default"))
    reasons.update(dict.fromkeys(always | touching, "always"))
    reasons.update(dict.fromkeys(adjacent, "adjacent"))
    return CollisionMatrix(reasons, samples, seed, digest_of(body, description.meshes))


def whole_space(body: Body) -> JointSpace:
    """Return all joints of a body that have positions of their own, with the limits of the URDF."""
    return JointSpace(tuple(map(_whole_joint, body.moving)))


def _whole_joint(joint: BodyJoint) -> ArmJoint:
    if joint.limits is None or joint.kind == "continuous":
        return ArmJoint(joint.name, MotionLimits(), is_continuous=True, slides=joint.slides)
    return ArmJoint(joint.name, MotionLimits(joint.limits.lower, joint.limits.upper), slides=joint.slides)
