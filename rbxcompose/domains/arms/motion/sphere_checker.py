"""Examines positions in compiled code first, and by coal the pairs of shapes whose spheres are near to each other.

**Why that is as safe as coal alone.** Coal examines every pair of shapes whose boxes along the axes overlap, and leaves
out the others, since a shape is within its box. Here spheres, and hulls in them, take the place of boxes: a shape is
within these by arithmetic (`sphere_trees`), so shapes whose spheres are apart, or whose hulls have a plane between them
(`compiled_convex`), are apart. All positions are examined, on all pairs; every pair that is called near is judged by
coal, on the shapes themselves. Tests compare both on many positions.
What spheres alone say decides only where the fast search goes: the last examination never relies on it.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Generator, Iterable, Mapping, Sequence
from typing import Any

from rbxcompose.base.arrays import Array, Ints, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion import compiled_collisions, sphere_trees
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.collisions import CheckedPart, MeshChecker
from rbxcompose.domains.arms.motion.compiled_collisions import CompiledModel, near_pairs, workspace
from rbxcompose.domains.arms.motion.fast_search import compile_search, fast_path
from rbxcompose.domains.arms.motion.groups import JointSpace, leader_of
from rbxcompose.domains.arms.motion.octree_files import cells_in
from rbxcompose.domains.body.link_pairs import LinkPair
from rbxcompose.domains.body.model import Geometry

Coal = Any  # of an extra, without types
Carriers = Mapping[str, tuple[int, Transform3]]
"""The frame of the chain that moves each link, and where the link is in it."""
NONE = sphere_trees.ball_tree(np.inf)  # of a half space, which no spheres cover


@dataclass(frozen=True, slots=True)
class PlacedTree:
    """A shape with its spheres, where they are in the frame of the chain that moves it."""

    tree: sphere_trees.SphereTree
    owner: int
    """The frame."""
    pose: Array
    """That of the shape, of shape (3, 4)."""
    centres: Array
    corners: Array
    extent: float
    """How far the shape is from the frame [m]; 0 for a half space, which has no end."""
    kind: int
    sizes: tuple[float, float, float, float]


class Trees:
    """Spheres of shapes, each fitted and placed once, and forgotten when it is not among those that are asked for."""

    def __init__(self) -> None:
        self._made: dict[Geometry, sphere_trees.SphereTree] = {}
        self._chain: tuple[compiled_collisions.Chain, Carriers] | None = None
        self._chain_of: tuple[ArmKinematics, Mapping[str, float], frozenset[str]] | None = None
        self._placed: dict[tuple[str, Transform3, int], PlacedTree] = {}

    def placed(
        self, kinematics: ArmKinematics, parts: Sequence[CheckedPart]
    ) -> tuple[compiled_collisions.Chain, list[PlacedTree]]:
        """Return the chain of what moves, where the other joints are now, and the spheres of each part on it."""
        wanted = kinematics, kinematics.positions, frozenset(part.link for part in parts)
        if self._chain is None or wanted != self._chain_of:
            self._chain, self._chain_of, self._placed = _chain(kinematics, wanted[2]), wanted, {}
        chain, carriers = self._chain
        before, self._placed, found = self._placed, {}, []
        for part, tree in zip(parts, self._fitted(parts), strict=True):
            key = part.link, part.origin, id(tree)  # which is not that of another one, while the value has the tree
            self._placed[key] = placed = before.get(key) or _placed(tree, part, *carriers[part.link])
            found.append(placed)
        return chain, found

    def _fitted(self, parts: Iterable[CheckedPart]) -> list[sphere_trees.SphereTree]:
        """Return the spheres that cover each of some shapes, in its own frame."""
        before, self._made, found = self._made, {}, []
        for part in parts:
            if (tree := self._made.get(part.geometry)) is None:
                tree = before.get(part.geometry) or _tree(part.geometry, part.coal)
                self._made[part.geometry] = tree
            found.append(tree)
        return found


def _placed(tree: sphere_trees.SphereTree, part: CheckedPart, owner: int, carried: Transform3) -> PlacedTree:
    pose = compiled_collisions.matrix_of(carried.compose(part.origin))
    turned, moved = pose[:, :3].T, pose[:, 3]
    centres, corners = tree.centres @ turned + moved, tree.corners @ turned + moved
    extent = math.hypot(*centres[0]) + float(tree.radii[0]) if tree is not NONE else 0.0
    return PlacedTree(tree, owner, pose, centres, corners, extent, *_solid(part.geometry))


def compiled_model(checker: MeshChecker, trees: Trees) -> compiled_collisions.CompiledModel:
    """Return what a checker examines, for where the other joints of the body are now; pairs keep their places."""
    chain, parts = trees.placed(checker.kinematics, checker.parts)
    owners = np.array([part.owner for part in parts], dtype=np.int64)
    kinds = np.array([part.kind for part in parts], dtype=np.int64)
    counts = np.array([len(part.tree.radii) for part in parts], dtype=np.int64)
    corners = np.array([len(part.corners) for part in parts], dtype=np.int64)
    starts, first_corners = np.cumsum(counts) - counts, np.repeat(np.cumsum(corners) - corners, counts)
    children = np.concatenate((np.zeros(0, dtype=np.int64), *(part.tree.children for part in parts)))
    spans = np.concatenate((np.zeros((0, 2), dtype=np.int64), *(part.tree.spans for part in parts)))
    extents = np.zeros(len(chain.parents))
    np.maximum.at(extents, owners, np.array([part.extent for part in parts]))
    radii = np.array([part.tree.radii[0] for part in parts])
    firsts, seconds, margins = _ordered(checker.watched_parts, kinds, radii)
    low, high = np.minimum(owners[firsts], owners[seconds]), np.maximum(owners[firsts], owners[seconds])
    codes, coupled = np.unique(low * len(extents) + high, return_inverse=True)
    return compiled_collisions.CompiledModel(
        chain=chain,
        groups=owners,
        poses=np.array([part.pose for part in parts]).reshape(-1, 3, 4),
        kinds=kinds,
        sizes=np.array([part.sizes for part in parts]).reshape(-1, 4),
        roots=starts,
        spheres=compiled_collisions.Spheres(
            np.concatenate((np.zeros((0, 3)), *(part.centres for part in parts))),
            np.concatenate((np.zeros(0), *(part.tree.radii for part in parts))),
            np.where(children < 0, -1, children + np.repeat(starts, counts)),
            spans + first_corners[:, None],
            np.concatenate((np.zeros((0, 3)), *(part.corners for part in parts))),
        ),
        firsts=firsts,
        seconds=seconds,
        margins=margins,
        reaches=radii[firsts] + radii[seconds] + margins,
        extents=extents,
        couples=np.stack(np.divmod(codes, len(extents)), axis=1),
        coupled=coupled.astype(np.int64),
    )


def _chain(kinematics: ArmKinematics, links: Iterable[str]) -> tuple[compiled_collisions.Chain, Carriers]:
    """Return the chain of what moves, and for each link its frame in the chain and where it is in that."""
    body, group, positions = kinematics.body, kinematics.group, kinematics.positions

    def carrier(link: str) -> str:
        """Return the link that moves as this one does, and that a joint of the arm moves."""
        above = (joint for joint in body.joints_above(link) if joint.moves)
        return next((joint.child for joint in above if leader_of(joint, body.joints)[0] in group.joints), body.root)

    carriers = {link: carrier(link) for link in links}
    chain, index = compiled_collisions.chain_of(body, group, positions, {body.root, *carriers.values()})
    poses = body.poses(positions)
    return chain, {name: (index[by], poses[by].inverse().compose(poses[name])) for name, by in carriers.items()}


def _ordered(pairs: Sequence[tuple[int, int, float]], kinds: Ints, radii: Array) -> tuple[Ints, Ints, Array]:
    """Return pairs so that the spheres of their first shapes are tested: the smaller solids, which they fit better.

    What may be a little within each other is called near as soon as it touches, if it is no box: how deep unions of
    spheres are within each other says nothing about what they cover.
    """
    shapes = np.array([(number, other) for number, other, _ in pairs], dtype=np.int64).reshape(-1, 2)
    margins = np.array([margin for _, _, margin in pairs], dtype=np.float64)
    (kind, other_kind), (radius, other_radius) = kinds[shapes].T, radii[shapes].T
    is_other = (kind > other_kind) | ((kind == other_kind) & (radius > other_radius))
    is_exact = (kind == compiled_collisions.BOX) & (other_kind == compiled_collisions.BOX)
    firsts, seconds = np.where(is_other[:, None], shapes[:, ::-1], shapes).T
    return firsts.copy(), seconds.copy(), np.where(is_exact, margins, np.maximum(margins, 0.0))


def _solid(geometry: Geometry) -> tuple[int, tuple[float, float, float, float]]:
    """Return what a shape is beside its spheres, and its sizes; a cone and a capsule are within a cylinder."""
    size = geometry.size
    match geometry.kind:
        case "box":
            return compiled_collisions.BOX, (size[0] / 2, size[1] / 2, size[2] / 2, 0.0)
        case "cylinder" | "cone":
            return compiled_collisions.CYLINDER, (size[0], size[1] / 2, 0.0, 0.0)
        case "capsule":
            return compiled_collisions.CYLINDER, (size[0], size[1] / 2 + size[0], 0.0, 0.0)
        case "plane":
            return compiled_collisions.HALF_SPACE, (size[0], size[1], size[2], size[3])
    return compiled_collisions.TREE, (0.0, 0.0, 0.0, 0.0)


def _tree(geometry: Geometry, coal: Coal) -> sphere_trees.SphereTree:
    size = geometry.size
    match geometry.kind:
        case "box":
            return sphere_trees.box_tree(size)
        case "sphere":
            return sphere_trees.ball_tree(size[0])
        case "cylinder" | "cone":
            return sphere_trees.cylinder_tree(size[0], size[1])
        case "capsule":
            return sphere_trees.cylinder_tree(size[0], size[1] + 2 * size[0])
        case "plane":
            return NONE
        case "octree":
            return sphere_trees.cells_tree(*cells_in(geometry))
    return sphere_trees.kept_mesh_tree(triangles_of(coal))


def triangles_of(mesh: Coal) -> Array:
    """Return the triangles of a mesh as coal has it, of shape (t, 3, 3) [m]."""
    each = map(mesh.tri_indices, range(mesh.num_tris))
    corners = np.array([(item[0], item[1], item[2]) for item in each], dtype=np.int64).reshape(-1, 3)
    return np.asarray(mesh.vertices(), dtype=np.float64)[corners]


ROOM = 4_096  # near pairs of one call, at least
SAMPLES, SEED = 64, 1
"""Positions at which it is seen how well spheres distinguish pairs."""
BLURRED = 0.1
"""A pair whose spheres are near in a greater share of positions, most of them free, is left out of the fast search."""


class SphereChecker:
    """Gives the same answers as a `MeshChecker`, faster, and searches ways. One thread at a time may use it."""

    def __init__(self, mesh: MeshChecker, trees: Trees) -> None:
        """Build it; `trees` are spheres of shapes that were fitted before, and get those of new ones."""
        self.mesh, self._trees = mesh, trees
        self._clear: CompiledModel | None = None
        self._positions: Mapping[str, float] | None = None  # nothing is made before it is used: scenes change often

    def is_free(self, values: Array) -> bool:
        """Return whether nothing collides at positions of shape (n,)."""
        return self.mesh.is_free(values)  # which is as fast for a single one

    def colliding(self, values: Array) -> list[LinkPair]:
        """Return all pairs that collide."""
        return self.mesh.colliding(values)

    def without(self, pairs: Collection[LinkPair]) -> MeshChecker:
        """Return a checker of the same shapes that does not watch some pairs."""
        return self.mesh.without(pairs)

    def in_the_way(self, values: Array, shape: Geometry, at: Transform3, ignored: Collection[str]) -> list[str]:
        """Return the links and objects but those `ignored` that a shape is within."""
        return self.mesh.in_the_way(values, shape, at, ignored)

    def first_bad(self, points: Array) -> int | None:
        """Return the first of some positions, of shape (m, n), where something collides; None if there is none."""
        self._refresh()
        points, begin = np.ascontiguousarray(points), 0  # another layout would be compiled anew
        while begin < len(points):
            if not (count := near_pairs(self._model, points[begin:], self._found, self._work)):
                return None
            near = self._found[:count]
            whole = len(points) - begin if count < len(self._found) else int(near[-1, 0])
            indices, starts = np.unique(near[:, 0], return_index=True)
            for index, some in zip(indices.tolist(), np.split(near[:, 1], starts[1:]), strict=True):
                if index < whole and self.mesh.collides(points[begin + index], some.tolist()):
                    return int(begin + index)
            begin += whole
        return None

    def prepare(self, space: JointSpace) -> None:
        """Compile what is not in the caches, and look at what the body has without objects."""
        self.first_bad(np.clip(0.0, space.lower, space.upper)[None])
        compile_search(self._model, self._work, len(space.joints))

    def ways(
        self, space: JointSpace, start: Array, goal: Array, *, seed: int, resolution: float, simplify: bool
    ) -> Generator[int, None, Array | str]:
        """Search a way as `fast_path` does."""
        self._refresh()
        if self._clear is None:
            self._clear = self._without_blurred(space)
        return fast_path(
            self._clear,
            workspace(self._clear),
            space,
            (start, goal),
            seed=seed,
            resolution=resolution,
            simplify=simplify,
        )

    def _refresh(self) -> None:
        """Take over where the other joints of the body are."""
        positions = self.mesh.kinematics.positions
        if positions is not self._positions and positions != self._positions:
            self._clear, self._model = None, compiled_model(self.mesh, self._trees)
            self._work = workspace(self._model)
            self._found = np.empty((max(ROOM, len(self._model.firsts) + 1), 2), dtype=np.int64)  # those of a point fit
        self._positions = positions

    def _without_blurred(self, space: JointSpace) -> CompiledModel:
        points, model = space.samples(SAMPLES, SEED), self._model
        near = np.empty((SAMPLES * max(1, len(model.firsts)), 2), dtype=np.int64)
        near = near[: near_pairs(model, points, near, self._work)]
        pairs, counts = np.unique(near[:, 1], return_counts=True)
        blurred = [
            pair
            for pair in pairs[counts > BLURRED * SAMPLES].tolist()
            if np.mean([self.mesh.collides(points[at], [pair]) for at in near[near[:, 1] == pair, 0]]) < 0.5
        ]
        kept = np.setdiff1d(np.arange(len(model.firsts)), blurred)
        columns = ("firsts", "seconds", "margins", "reaches", "coupled")
        return model._replace(**{name: getattr(model, name)[kept] for name in columns})
