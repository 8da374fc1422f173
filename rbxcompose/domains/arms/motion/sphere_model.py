"""A body and the things around it as arrays for compiled code: the shapes that coal examines, covered by spheres."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbxcompose.base.geometry import Transform3
from rbxcompose.domains.arms.motion import compiled_collisions, sphere_trees
from rbxcompose.domains.arms.motion.arm_kinematics import ArmKinematics
from rbxcompose.domains.arms.motion.collisions import CheckedPart, MeshChecker
from rbxcompose.domains.arms.motion.groups import Array, leader_of
from rbxcompose.domains.arms.motion.octree_files import read_cells
from rbxcompose.domains.body.model import Geometry

Coal = Any  # of an extra, without types
NONE = sphere_trees.ball_tree(np.inf)  # of a half space, which no spheres cover


class Trees:
    """Spheres of shapes, each fitted once, and forgotten when it is not among those that are asked for."""

    def __init__(self) -> None:
        self._made: dict[Geometry, sphere_trees.SphereTree] = {}

    def of(self, parts: Iterable[CheckedPart]) -> list[sphere_trees.SphereTree]:
        """Return the spheres that cover each of some shapes, in its own frame."""
        before, self._made, found = self._made, {}, []
        for part in parts:
            if (tree := self._made.get(part.geometry)) is None:
                tree = before.get(part.geometry) or _tree(part.geometry, part.coal)
                self._made[part.geometry] = tree
            found.append(tree)
        return found


def compiled_model(checker: MeshChecker, trees: Trees) -> compiled_collisions.CompiledModel:
    """Return what a checker examines, for where the other joints of the body are now; pairs keep their places."""
    parts, kinematics = checker.parts, checker.kinematics
    chain, carriers = _chain(kinematics, {part.link for part in parts})
    owners = np.array([carriers[part.link][0] for part in parts], dtype=np.int64)
    poses = [compiled_collisions.matrix_of(carriers[part.link][1].compose(part.origin)) for part in parts]
    fitted = trees.of(parts)
    starts = np.cumsum([0, *(len(each.radii) for each in fitted)], dtype=np.int64)
    solids = [_solid(part.geometry) for part in parts]
    kinds = np.array([kind for kind, _ in solids], dtype=np.int64)
    centres = [each.centres @ pose[:, :3].T + pose[:, 3] for each, pose in zip(fitted, poses, strict=True)]
    corners = [each.corners @ pose[:, :3].T + pose[:, 3] for each, pose in zip(fitted, poses, strict=True)]
    ends = np.cumsum([len(corner) for corner in corners], dtype=np.int64)
    spans = [each.spans + (end - len(each.corners)) for each, end in zip(fitted, ends, strict=True)]
    extents = np.zeros(len(chain.parents))
    for owner, middles, tree in zip(owners, centres, fitted, strict=True):
        if tree is not NONE:
            extents[owner] = max(extents[owner], float(np.linalg.norm(middles[0]) + tree.radii[0]))
    radii = np.array([each.radii[0] for each in fitted])
    firsts, seconds, margins = _ordered(checker.watched_parts, kinds, radii)
    frames = np.sort(np.stack((owners[firsts], owners[seconds]), axis=1), axis=1)
    couples, coupled = np.unique(frames, axis=0, return_inverse=True)
    return compiled_collisions.CompiledModel(
        chain=chain,
        groups=owners,
        poses=np.array(poses).reshape(-1, 3, 4),
        kinds=kinds,
        sizes=np.array([size for _, size in solids]).reshape(-1, 4),
        roots=starts[:-1],
        spheres=compiled_collisions.Spheres(
            np.concatenate((np.zeros((0, 3)), *centres)),
            np.concatenate((np.zeros(0), *(each.radii for each in fitted))),
            _children(fitted, starts),
            np.concatenate((np.zeros((0, 2), dtype=np.int64), *spans)),
            np.concatenate((np.zeros((0, 3)), *corners)),
        ),
        firsts=firsts,
        seconds=seconds,
        margins=margins,
        reaches=radii[firsts] + radii[seconds] + margins,
        extents=extents,
        couples=couples,
        coupled=coupled.reshape(-1).astype(np.int64),
    )


def _chain(
    kinematics: ArmKinematics, links: Iterable[str]
) -> tuple[compiled_collisions.Chain, Mapping[str, tuple[int, Transform3]]]:
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


def _ordered(
    pairs: Sequence[tuple[int, int, float]], kinds: NDArray[np.int64], radii: Array
) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
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
            cells = np.array(geometry.points).reshape(-1, 3), size[0]
            return sphere_trees.cells_tree(*(read_cells(Path(geometry.file), size[0]) if geometry.file else cells))
    return sphere_trees.kept_mesh_tree(triangles_of(coal))


def triangles_of(mesh: Coal) -> Array:
    """Return the triangles of a mesh as coal has it, of shape (t, 3, 3) [m]."""
    each = map(mesh.tri_indices, range(mesh.num_tris))
    corners = np.array([(item[0], item[1], item[2]) for item in each], dtype=np.int64).reshape(-1, 3)
    return np.asarray(mesh.vertices(), dtype=np.float64)[corners]


def _children(fitted: Sequence[sphere_trees.SphereTree], starts: NDArray[np.int64]) -> NDArray[np.int64]:
    found = [
        np.where(tree.children < 0, -1, tree.children + start) for tree, start in zip(fitted, starts, strict=False)
    ]
    return np.concatenate([np.zeros(0, dtype=np.int64), *found])
