"""Trees of spheres that cover shapes, for tests of collisions; kept in the user's folder of caches."""

from __future__ import annotations

import heapq
import io
import math
import os
import stat
from collections.abc import Sequence
from contextlib import suppress
from itertools import product
from pathlib import Path

from xxhash import xxh3_128_hexdigest

from rbxcompose.base.arrays import Array, Ints, Words, np
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.files import open_regular, replace_file

Ball = tuple[Array, float]

SLACK = 1e-6  # [m]
LEAVES = 96  # spheres at the finest level of one shape, at most
FINEST = 0.004  # [m], a sphere that is smaller is not divided
AT_EDGE = 0.01  # of a cell from its edge, within which rounding decides in which cell a point is
SEGMENTS = 12  # sides of triangles that are longer than this part of the whole are halved first
MOST_SIDES = 4_000_000  # triangles by corners of a mesh of which it is tested whether it is convex
MOST_TRIANGLES = 60_000  # of a mesh whose long triangles are halved
SIDES = 16  # of the prism about a cylinder, which is 2 % thicker
STEPS = 12  # towards the middle of the smallest ball


@dataclass(frozen=True, slots=True)
class SphereTree:
    """Spheres: `centres` [m] of shape (k, 3), `radii` [m] of shape (k,); the first one covers all.

    `children` of shape (k,) is the first of two spheres that together cover what a sphere is for; -1 if there are none.
    """

    centres: Array
    radii: Array
    children: Ints
    spans: Ints
    """The first corner of each sphere, and the one after its last, of shape (k, 2); not all spheres have any."""
    corners: Array
    """All that a sphere is for is in their hull, too, of shape (c, 3) [m]."""

    @property
    def leaves(self) -> tuple[Array, Array]:
        """Return the centres and radii of the finest level."""
        there = (self.children < 0) & (self.radii >= 0.0)
        return self.centres[there], self.radii[there]


def ball_tree(radius: float) -> SphereTree:
    """Return a sphere about the origin as a tree."""
    return _one(np.zeros(3), radius, np.zeros((0, 3)))


def box_tree(size: Sequence[float]) -> SphereTree:
    """Return the tree of a solid box about the origin, of three lengths [m]: the sphere about its corners."""
    corners = np.array(list(product((-0.5, 0.5), repeat=3))) * np.array(size[:3])
    return _one(np.zeros(3), math.hypot(*size[:3]) / 2, corners)


def cylinder_tree(radius: float, length: float) -> SphereTree:
    """Return the tree of a solid cylinder about the origin along z [m]: its sphere, with the corners of a prism."""
    angles = np.arange(SIDES) * (math.tau / SIDES)
    around = np.stack((np.cos(angles), np.sin(angles)), axis=1) * (radius / math.cos(math.pi / SIDES))
    corners = [np.column_stack((around, np.full(SIDES, end * length / 2))) for end in (-1.0, 1.0)]
    return _one(np.zeros(3), math.hypot(radius, length / 2), np.concatenate(corners))


def mesh_tree(triangles: Array) -> SphereTree:
    """Return the tree of the surface of a mesh, whose triangles have the shape (t, 3, 3) [m]."""
    if not len(triangles):
        return _one(np.zeros(3), -math.inf, np.zeros((0, 3)))
    if _is_convex(triangles):
        corners = _corners(triangles)
        return _one(*_ball(corners), corners)
    extent = float(np.max(np.ptp(triangles.reshape(-1, 3), axis=0)))
    return _divided(_halved_sides(triangles, extent / SEGMENTS))


def cells_tree(points: Array, side: float) -> SphereTree:
    """Return the tree of the cells of a grid about the origin that points are in, of shape (n, 3) [m]; a leaf for each.

    Cells are those of OctoMap, from 0 to `side` and so on. It rounds points, so that one at the edge of a cell may be
    in the next one: its leaf covers both. They are put in the order of a curve that keeps near ones together, and
    joined two by two.
    """
    steps = points / side
    is_clear = np.all(np.abs(steps - np.round(steps)) > AT_EDGE, axis=1)
    middles = np.where(is_clear[:, None], (np.floor(steps) + 0.5) * side, points)
    order = np.argsort(_interleaved(np.floor(steps - steps.min(axis=0)).astype(np.uint64)))
    size = 1 << max(0, (len(middles) - 1).bit_length())
    centres, radii = np.zeros((size, 3)), np.full(size, -math.inf)  # what is beyond the cells is nothing
    centres[: len(order)] = middles[order]
    radii[: len(order)] = np.where(is_clear, 0.5, 1.0)[order] * (side * math.sqrt(3.0)) + SLACK
    levels, children = [(centres, radii)], [np.full(size, -1)]
    while len(levels[0][1]) > 1:
        levels.insert(0, _joined(*levels[0]))
        children.insert(0, 2 * np.arange(len(levels[0][1])))
    starts = np.cumsum([0, *(len(one) for _, one in levels)])
    found = [child if child[0] < 0 else child + start for child, start in zip(children, starts[1:], strict=True)]
    return _without_corners(
        np.concatenate([array for array, _ in levels]),
        np.concatenate([one for _, one in levels]),
        np.concatenate(found),
    )


def _one(centre: Array, radius: float, corners: Array) -> SphereTree:
    """Return one sphere as a tree."""
    return SphereTree(centre[None], np.array([radius + SLACK]), np.array([-1]), np.array([[0, len(corners)]]), corners)


def _corners(triangles: Array) -> Array:
    """Return the corners of the hull of triangles; all of theirs if they are too flat to have one."""
    from scipy.spatial import ConvexHull, QhullError

    points = np.unique(triangles.reshape(-1, 3), axis=0)
    try:
        found: Array = points[ConvexHull(points).vertices]
    except QhullError:
        return points
    return found


def _is_convex(triangles: Array) -> bool:
    """Return whether the hull of a mesh is little more than what its triangles enclose."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(normals, axis=1)
    normals = normals[length > 0.0] / length[length > 0.0, None]
    starts, points = triangles[length > 0.0, 0], np.unique(triangles.reshape(-1, 3), axis=0)
    if len(normals) * len(points) > MOST_SIDES:
        return False
    heights = normals @ points.T - np.einsum("ij,ij->i", normals, starts)[:, None]
    return bool(np.all(np.minimum(heights.max(axis=1), -heights.min(axis=1)) <= FINEST))


def _without_corners(centres: Array, radii: Array, children: Ints) -> SphereTree:
    return SphereTree(centres, radii, children, np.zeros((len(radii), 2), dtype=np.int64), np.zeros((0, 3)))


def _divided(triangles: Array) -> SphereTree:
    """Divide the triangles of the largest ball again and again."""
    cells, balls, children = [triangles], [_ball(triangles.reshape(-1, 3))], [-1]
    waiting = [(-balls[0][1], 0)]
    leaves = 1
    while waiting and leaves < LEAVES:
        radius, index = heapq.heappop(waiting)
        if -radius <= FINEST or len(both := _parted(cells[index])) < 2:
            continue
        children[index] = len(balls)
        for array in both:
            found = _ball(array.reshape(-1, 3))
            heapq.heappush(waiting, (-found[1], len(balls)))
            cells.append(array)
            balls.append(found)
            children.append(-1)
        leaves += 1
    corners = [_corners(cell) for cell in cells]
    ends = np.cumsum([len(corner) for corner in corners])
    return SphereTree(
        np.array([one for one, _ in balls]),
        np.array([value for _, value in balls]) + SLACK,
        np.array(children),
        np.stack((ends - [len(corner) for corner in corners], ends), axis=1),
        np.concatenate(corners),
    )


def _ball(points: Array) -> Ball:
    """Return a ball about points that is little larger than the smallest one."""
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    best, least = centre, math.inf
    for step in range(1, STEPS + 1):
        away = np.linalg.norm(points - centre, axis=1)
        farthest = int(np.argmax(away))
        if away[farthest] < least:
            best, least = centre, float(away[farthest])
        centre = centre + (points[farthest] - centre) / (step + 1)
    return best, least


def _parted(triangles: Array) -> list[Array]:
    """Return both halves of triangles, across the direction in which they reach farthest."""
    if len(triangles) < 2:
        return []
    middles = triangles.mean(axis=1)
    _, axes = np.linalg.eigh(np.cov(middles.T))
    along = middles @ axes[:, -1]
    order = np.argsort(along, kind="stable")
    half = len(order) // 2
    return [triangles[order[:half]], triangles[order[half:]]]


def _halved_sides(triangles: Array, longest: float) -> Array:
    """Return the same surface; triangles with a side that is too long are halved across it."""
    done: list[Array] = []
    rest = triangles
    while len(rest) and sum(len(array) for array in done) + len(rest) < MOST_TRIANGLES:
        sides = np.linalg.norm(rest - np.roll(rest, -1, axis=1), axis=2)
        is_long = sides.max(axis=1) > longest
        done.append(rest[~is_long])
        rest, which = rest[is_long], sides[is_long].argmax(axis=1)
        each = np.arange(len(rest))
        first, second, third = (rest[each, (which + turn) % 3] for turn in range(3))
        middle = (first + second) / 2
        rest = np.concatenate((np.stack((first, middle, third), axis=1), np.stack((middle, second, third), axis=1)))
    return np.concatenate((*done, rest))


def _interleaved(cells: Words) -> Words:
    """Return the bits of three numbers of at most 21 bits, in turn (Morton's code)."""
    found = np.zeros(len(cells), dtype=np.uint64)
    for bit in range(21):
        for axis in range(3):
            found |= (cells[:, axis] >> np.uint64(bit) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return found


def _joined(centres: Array, radii: Array) -> tuple[Array, Array]:
    """Return balls about each two balls; a radius of -inf is nothing."""
    (array, other), (small, large) = (centres[::2], centres[1::2]), (radii[::2], radii[1::2])
    apart = np.linalg.norm(other - array, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        radius = (apart + small + large) / 2
        share = np.where(apart > 0.0, (radius - small) / apart, 0.0)
    holds, held = (small >= apart + large) | ~np.isfinite(large), large >= apart + small
    middle = array + (other - array) * np.clip(np.nan_to_num(share), 0.0, 1.0)[:, None]
    centre = np.where(holds[:, None], array, np.where(held[:, None], other, middle))
    return centre, np.where(holds, small, np.where(held, large, radius)) + SLACK


FORM = f"4 {LEAVES} {FINEST} {SEGMENTS} {SLACK}"
"""What the spheres depend on beside the mesh; its first number changes with how they are fitted."""
MOST_FILES = 256
LARGEST = 64_000_000  # [bytes], as many as a mesh may have


def kept_mesh_tree(triangles: Array) -> SphereTree:
    """Return the tree of the surface of a mesh, whose triangles have the shape (t, 3, 3) [m]; keep it for later."""
    digest = xxh3_128_hexdigest(FORM.encode() + np.ascontiguousarray(triangles).tobytes())
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    path = home / "rbxcompose/spheres" / f"{digest}.npy"
    if (kept := _read(path)) is not None:
        return kept
    made = mesh_tree(triangles)
    file = io.BytesIO()
    for array in (np.column_stack((made.centres, made.radii, made.children, made.spans)), made.corners):
        np.save(file, array, allow_pickle=False)
    with suppress(OSError):  # without a folder that can be written, there is none to keep it in
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        replace_file(path, file.getvalue(), mode=0o600)
        files = sorted(path.parent.iterdir(), key=lambda one: one.stat().st_mtime_ns)
        for old in files[:-MOST_FILES]:
            old.unlink()
    return made


def _read(path: Path) -> SphereTree | None:
    """Return what was kept; None if that is nothing, no tree, or not written by this user alone."""
    try:
        with open_regular(path, follow=False) as file:
            about = os.fstat(file.fileno())
            if about.st_uid != os.getuid() or about.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
                return None
            content = io.BytesIO(file.read(LARGEST))
            rows, corners = (np.load(content, allow_pickle=False) for _ in range(2))
    except (OSError, ValueError, EOFError):
        return None
    if rows.ndim != 2 or rows.shape[1] != 7 or not len(rows) or corners.ndim != 2 or corners.shape[1] != 3:
        return None
    if not all(one.dtype == np.float64 and np.all(np.isfinite(one)) for one in (rows, corners)):
        return None
    (children, begins, ends), own = rows[:, 4:].T.astype(np.int64), np.arange(len(rows))
    if np.any((children >= 0) & ((children <= own) | (children + 1 >= len(rows)))):
        return None  # it would lead in circles, or out of the tree
    if np.any((begins < 0) | (ends < begins) | (ends > len(corners))):
        return None
    spheres = (np.ascontiguousarray(rows[:, :3]), np.ascontiguousarray(rows[:, 3]), children)
    return SphereTree(*spheres, np.stack((begins, ends), axis=1), corners)
