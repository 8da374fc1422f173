"""Which shapes may collide, in code that numba compiles: frames, chains, spheres and hulls."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import NamedTuple

import numpy as np

from rbxcompose.base.arrays import Array, Ints
from rbxcompose.base.geometry import Transform3, Vector3, rotate
from rbxcompose.domains.arms.motion.groups import ArmGroup, leader_of
from rbxcompose.domains.arms.motion.numba_cache import borrowed, compiled, inlined
from rbxcompose.domains.body.model import Body


@inlined
def multiply(array: Array, other: Array, found: Array) -> None:
    """Write the product of two frames."""
    for row in range(3):
        for column in range(4):
            found[row, column] = (
                array[row, 0] * other[0, column] + array[row, 1] * other[1, column] + array[row, 2] * other[2, column]
            )
        found[row, 3] += array[row, 3]


@inlined
def multiply_inverse(array: Array, other: Array, found: Array) -> None:
    """Write the product of the inverse of a frame and another one."""
    for row in range(3):
        for column in range(4):
            total = 0.0
            for inner in range(3):
                away = other[inner, column] - (array[inner, 3] if column == 3 else 0.0)
                total += array[inner, row] * away
            found[row, column] = total


@inlined
def apply(frame: Array, point: Array, found: Array) -> None:
    """Write where a point of a frame is."""
    for row in range(3):
        found[row] = frame[row, 0] * point[0] + frame[row, 1] * point[1] + frame[row, 2] * point[2] + frame[row, 3]


ChainRow = tuple[int, int, Transform3, Vector3, int, float, float]  # of a `Chain`

FIXED, TURNS, SLIDES = 0, 1, 2
UPWARDS: Vector3 = (0.0, 0.0, 1.0)


class Chain(NamedTuple):
    """Frames of links, each after the one that carries it; arrays have an entry for each of them.

    A joint is at `multipliers * q[joints] + offsets` [rad or m]; `q` are positions of the arm's joints, of shape (n,).
    """

    parents: Ints
    """The frame that carries it, -1 for the root."""
    kinds: Ints
    """FIXED, TURNS or SLIDES."""
    places: Array
    """Its frame in that of its parent at position 0, of shape (m, 3, 4): the rotation, then the translation [m]."""
    axes: Array
    """Unit vectors in its own frame, of shape (m, 3)."""
    joints: Ints
    multipliers: Array
    offsets: Array


def chain_of(
    body: Body, group: ArmGroup, positions: Mapping[str, float], links: Collection[str]
) -> tuple[Chain, Mapping[str, int]]:
    """Return the frames of some links, with those that the arm moves on the way to them, and the index of each.

    Joints that the arm does not move are where `positions` [rad or m] put them, or at rest. Frames that nothing moves
    relative to their parents are left out, if they are not in `links`.
    """
    wanted, needed = set(links), set[str]()
    for link in links:
        while link not in needed and (above := body.joint_above.get(link)) is not None:
            needed.add(link)
            link = above.parent
    rows: list[ChainRow] = []
    known, carried = {}, {body.root: (-1, Transform3())}  # the frame that carries a link, and where the link is in it
    if body.root in wanted:
        known[body.root] = 0
        rows.append((-1, FIXED, Transform3(), UPWARDS, 0, 0.0, 0.0))
        carried[body.root] = (0, Transform3())
    for joint in body.joints_downwards:
        if joint.child not in needed:
            continue
        parent, place = carried[joint.parent]
        leader, multiplier, offset = leader_of(joint, body.joints)
        if joint.moves and leader in group.joints:
            kind, place = SLIDES if joint.slides else TURNS, place.compose(joint.origin)
            row = (parent, kind, place, joint.axis, group.joints.index(leader), multiplier, offset)
        else:
            at = joint.at(body.position(joint, positions)) if joint.moves else joint.origin
            row = (parent, FIXED, place.compose(at), UPWARDS, 0, 0.0, 0.0)
            if joint.child not in wanted:
                carried[joint.child] = (parent, row[2])
                continue
        known[joint.child] = len(rows)
        carried[joint.child] = (len(rows), Transform3())
        rows.append(row)
    return _arrays(rows), known


def matrix_of(pose: Transform3) -> Array:
    """Return a pose as its rotation and translation [m] beside each other, of shape (3, 4)."""
    axes = [rotate(pose.rotation, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    return np.array(list(zip(*axes, pose.translation, strict=True)))


def _arrays(rows: list[ChainRow]) -> Chain:
    parents, kinds, places, axes, joints, multipliers, offsets = zip(*rows, strict=True) if rows else ((),) * 7
    return Chain(
        np.array(parents, dtype=np.int64),
        np.array(kinds, dtype=np.int64),
        np.array([matrix_of(place) for place in places]).reshape(-1, 3, 4),
        np.array(axes, dtype=float).reshape(-1, 3),
        np.array(joints, dtype=np.int64),
        np.array(multipliers, dtype=float),
        np.array(offsets, dtype=float),
    )


@compiled
def link_frames(chain: Chain, q: Array) -> Array:
    """Return the frames of a chain in that of the root, of shape (m, 3, 4), at positions of shape (n,)."""
    frames = np.empty((len(chain.parents), 3, 4))
    place_links(chain, q, frames)
    return frames


@inlined
def place_links(chain: Chain, q: Array, frames: Array) -> None:
    """Write the frames of a chain in that of the root, at positions of shape (n,), into an array of shape (m, 3, 4)."""
    own = np.empty((3, 4))  # in the frame of the parent
    for index in range(len(chain.parents)):
        place, kind = chain.places[index], chain.kinds[index]
        x, y, z = chain.axes[index, 0], chain.axes[index, 1], chain.axes[index, 2]
        at = chain.multipliers[index] * q[chain.joints[index]] + chain.offsets[index] if kind != FIXED else 0.0
        if kind == TURNS:
            _turn(place, x, y, z, at, own)
        else:
            _copy(place, own)
            if kind == SLIDES:
                for row in range(3):
                    own[row, 3] += at * (place[row, 0] * x + place[row, 1] * y + place[row, 2] * z)
        parent = chain.parents[index]
        if parent < 0:
            _copy(own, frames[index])
        else:
            _compose(frames[parent], own, frames[index])


@inlined
def _turn(place: Array, x: float, y: float, z: float, angle: float, out: Array) -> None:
    """Write a frame that is turned about one of its axes: Rodrigues' formula."""
    cos, sin = math.cos(angle), math.sin(angle)
    rest = 1.0 - cos
    for row in range(3):
        a, b, c = place[row, 0], place[row, 1], place[row, 2]
        out[row, 0] = a * (cos + rest * x * x) + b * (rest * x * y + sin * z) + c * (rest * x * z - sin * y)
        out[row, 1] = a * (rest * x * y - sin * z) + b * (cos + rest * y * y) + c * (rest * y * z + sin * x)
        out[row, 2] = a * (rest * x * z + sin * y) + b * (rest * y * z - sin * x) + c * (cos + rest * z * z)
        out[row, 3] = place[row, 3]


@inlined
def _copy(frame: Array, out: Array) -> None:
    for row in range(3):
        for column in range(4):
            out[row, column] = frame[row, column]


@inlined
def _compose(first: Array, second: Array, out: Array) -> None:
    for row in range(3):
        a, b, c = first[row, 0], first[row, 1], first[row, 2]
        for column in range(4):
            out[row, column] = a * second[0, column] + b * second[1, column] + c * second[2, column]
        out[row, 3] += first[row, 3]


TREE, BOX, CYLINDER, HALF_SPACE = 0, 1, 2, 3
"""What a shape is beside its spheres."""
LITTLE = 1e-6  # [m], much more than rounding
MOST_PLANES = 24  # planes that are tried
GOOD = 0.7  # of the distance: a plane that shows so much of it is good enough
SAME, FLAT = 1e-9, 1e-12  # a plane is no better than another one; a simplex is as flat as rounding


class HullWork(NamedTuple):
    """Memory for tests."""

    simplex: Array
    """Differences of points of both, of shape (4, 3)."""
    nearest: Array
    turned: Array
    gram: Array
    stack: Ints
    """Nodes of two trees that are still to be regarded, of shape (k, 2)."""


def hull_work(most: int) -> HullWork:
    """Return memory for tests, and for descents of trees with at most so many nodes waiting."""
    stack = np.zeros((most, 2), dtype=np.int64)
    return HullWork(np.zeros((4, 3)), np.zeros(3), np.zeros(3), np.zeros((3, 4)), stack)


@inlined
def away(kind: int, size: Array, x: float, y: float, z: float) -> float:
    """Return how far a point in the frame of a solid is from it [m]; below 0 within it."""
    if kind == HALF_SPACE:
        return float(size[0] * x + size[1] * y + size[2] * z + size[3])
    if kind == BOX:
        a, b, c = abs(x) - size[0], abs(y) - size[1], abs(z) - size[2]
    else:
        a, b, c = np.sqrt(x * x + y * y) - size[0], -np.inf, abs(z) - size[1]
    deepest = max(a, b, c)
    if deepest <= 0.0:
        return float(deepest)
    a, b, c = max(a, 0.0), max(b, 0.0), max(c, 0.0)
    return float(np.sqrt(a * a + b * b + c * c))


@inlined
def hull_gap(
    points: Array, between: Array, kind: int, size: Array, others: Array, least: float, axis: Array, work: HullWork
) -> float:
    """Return by how much the hull of points is farther than `least` [m] from a shape; at most 0 if no plane shows that.

    `between` is the frame of the points in that of the shape: a solid of a kind and a size, or the hull of `others`.
    `axis`, of shape (4,), is the plane that is tried first, and gets the one that was found: its normal in the frame of
    the points, of any length, and the distance that it showed. The normal in `work.nearest` is tried second.
    """
    if kind == HALF_SPACE:
        return _above(points, between, size) - least
    simplex, v, used = work.simplex, work.nearest, 0
    x, y, z = v[0], v[1], v[2]
    v[0], v[1], v[2] = axis[0], axis[1], axis[2]
    for turn in range(MOST_PLANES):
        _support(points, between, kind, size, others, v, work.turned, simplex[used])
        square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
        length, along = np.sqrt(square), _dot(simplex[used], v)
        if along > (least + LITTLE) * length and along >= GOOD * (axis[3] * length if turn < 2 else square):
            axis[0], axis[1], axis[2], axis[3] = v[0] / length, v[1] / length, v[2] / length, along / length
            return float(along / length - least)
        if turn > 1 and (length <= least + LITTLE or square - along <= SAME * square):
            break  # it is nearer than that, or no plane is better than this one
        if turn == 0:
            v[0], v[1], v[2] = x, y, z
        elif turn == 1:
            v[0], v[1], v[2] = simplex[0, 0], simplex[0, 1], simplex[0, 2]
            used = 1
        else:
            used = _reduced(simplex, used + 1, v, work.gram)
        if used == 0 and turn > 1:
            break  # they meet
    return 0.0


@inlined
def _above(points: Array, between: Array, size: Array) -> float:
    """Return how far the lowest point is above a half space [m]."""
    x, y, z = size[0], size[1], size[2]
    a = x * between[0, 0] + y * between[1, 0] + z * between[2, 0]
    b = x * between[0, 1] + y * between[1, 1] + z * between[2, 1]
    c = x * between[0, 2] + y * between[1, 2] + z * between[2, 2]
    lowest = np.inf
    for index in range(len(points)):
        lowest = min(lowest, a * points[index, 0] + b * points[index, 1] + c * points[index, 2])
    return float(lowest + x * between[0, 3] + y * between[1, 3] + z * between[2, 3] + size[3])


@inlined
def _dot(array: Array, other: Array) -> float:
    return float(array[0] * other[0] + array[1] * other[1] + array[2] * other[2])


@inlined
def _support(
    points: Array, between: Array, kind: int, size: Array, others: Array, v: Array, turned: Array, found: Array
) -> None:
    """Write the difference of two points of both shapes that is least along a direction, in the frame of the points."""
    lowest, at = np.inf, 0
    a, b, c = v[0], v[1], v[2]
    for index in range(len(points)):
        along = points[index, 0] * a + points[index, 1] * b + points[index, 2] * c
        if along < lowest:
            lowest, at = along, index
    for row in range(3):
        turned[row] = between[row, 0] * a + between[row, 1] * b + between[row, 2] * c
    x, y, z = turned[0], turned[1], turned[2]
    if kind == TREE:
        highest, best = -np.inf, 0
        for index in range(len(others)):
            along = others[index, 0] * x + others[index, 1] * y + others[index, 2] * z
            if along > highest:
                highest, best = along, index
        a, b, c = others[best, 0], others[best, 1], others[best, 2]
    elif kind == BOX:
        a = size[0] if x >= 0.0 else -size[0]
        b = size[1] if y >= 0.0 else -size[1]
        c = size[2] if z >= 0.0 else -size[2]
    else:
        across = np.sqrt(x * x + y * y)
        share = size[0] / across if across > 0.0 else 0.0
        a, b, c = x * share, y * share, size[1] if z >= 0.0 else -size[1]
    a, b, c = a - between[0, 3], b - between[1, 3], c - between[2, 3]
    for axis in range(3):
        there = between[0, axis] * a + between[1, axis] * b + between[2, axis] * c
        found[axis] = points[at, axis] - there


@inlined
def _reduced(simplex: Array, count: int, v: Array, gram: Array) -> int:
    """Write the point of a simplex nearest to the origin to `v`, and keep those corners that it lies between.

    Return how many these are; 0 if the origin is within the simplex. The last corner is among them: it is the new one.
    """
    last, most = simplex[count - 1], count - 1
    for one in range(most):
        for other in range(one, most):
            total = 0.0
            for axis in range(3):
                total += (simplex[one, axis] - last[axis]) * (simplex[other, axis] - last[axis])
            gram[one, other] = gram[other, one] = total
        gram[one, 3] = -(_dot(simplex[one], last) - _dot(last, last))
    best, kept = np.inf, 0
    a = b = 0.0
    for mask in range(1 << most):
        first, second, size = 0, 0, 0
        for index in range(most):
            if mask >> index & 1:
                first, second, size = second, index, size + 1
        if size == 3:
            if _is_within(gram):
                return 0
            continue
        t = u = 0.0
        if size == 1:
            if gram[second, second] <= 0.0:
                continue
            u = gram[second, 3] / gram[second, second]
        elif size == 2:
            det = gram[first, first] * gram[second, second] - gram[first, second] ** 2
            if det <= FLAT * gram[first, first] * gram[second, second]:
                continue
            t = (gram[first, 3] * gram[second, second] - gram[second, 3] * gram[first, second]) / det
            u = (gram[second, 3] * gram[first, first] - gram[first, 3] * gram[first, second]) / det
        if t < 0.0 or u < 0.0 or t + u > 1.0:
            continue
        square = 0.0
        for axis in range(3):
            at = last[axis] + t * (simplex[first, axis] - last[axis]) + u * (simplex[second, axis] - last[axis])
            square += at * at
        if square < best:
            best, kept, a, b = square, mask, t, u
    return _keep(simplex, count, kept, a, b, v)


@inlined
def _keep(simplex: Array, count: int, mask: int, t: float, u: float, v: Array) -> int:
    """Write the point `t` and `u` of the way from the last corner to others; move corners of the mask to the front."""
    most, kept = count - 1, 0
    for index in range(most):
        if mask >> index & 1:
            for axis in range(3):
                simplex[kept, axis] = simplex[index, axis]
            kept += 1
    for axis in range(3):
        simplex[kept, axis] = at = simplex[most, axis]
        v[axis] = at
        if kept == 2:
            v[axis] += t * (simplex[0, axis] - at) + u * (simplex[1, axis] - at)
        elif kept == 1:
            v[axis] += u * (simplex[0, axis] - at)
    return kept + 1


@inlined
def _is_within(gram: Array) -> bool:
    """Return whether the origin is within a simplex of four corners."""
    a, b, c, d, e, f = gram[0, 0], gram[0, 1], gram[0, 2], gram[1, 1], gram[1, 2], gram[2, 2]
    p, q, r = gram[0, 3], gram[1, 3], gram[2, 3]
    det = a * (d * f - e * e) - b * (b * f - e * c) + c * (b * e - d * c)
    if det <= FLAT * a * d * f:
        return False
    t = (p * (d * f - e * e) - b * (q * f - e * r) + c * (q * e - d * r)) / det
    u = (a * (q * f - e * r) - p * (b * f - e * c) + c * (b * r - q * c)) / det
    w = (a * (d * r - q * e) - b * (b * r - q * c) + p * (b * e - d * c)) / det
    return bool(t >= 0.0 and u >= 0.0 and w >= 0.0 and t + u + w <= 1.0)


LAST, EXAMINED = 0, 1
"""What stands in `Workspace.about`."""
COARSE = 4  # points of a line that are examined first, and up to twice as many
STACK = 2_048  # entries that descents of two trees need at most


class Spheres(NamedTuple):
    """The trees of all shapes (`SphereTree`), in the frames that move them."""

    centres: Array
    """The middle of each sphere, of shape (k, 3)."""
    radii: Array
    children: Ints
    spans: Ints
    corners: Array


class CompiledModel(NamedTuple):
    """A body and what is around it as arrays: shapes, and which pairs of them must not be near."""

    chain: Chain
    """The links that the arm moves; what is fixed to one of them is in its frame."""
    groups: Ints
    """Which frame of the chain moves each of s shapes."""
    poses: Array
    """The frame of each shape in the one that moves it, of shape (s, 3, 4)."""
    kinds: Ints
    sizes: Array
    """Half lengths of boxes, radius and half length of cylinders, normal and offset of half spaces, of shape (s, 4)."""
    roots: Ints
    """The first sphere of each shape."""
    spheres: Spheres
    firsts: Ints
    """The shape of each of p pairs whose spheres are used."""
    seconds: Ints
    margins: Array
    """How far the shapes of each pair must be from each other [m], of shape (p,)."""
    reaches: Array
    """The distance of the middles of both [m] beyond which they are; inf for half spaces."""
    extents: Array
    """How far shapes are from the frame that moves them [m], for each frame of the chain."""
    couples: Ints
    """The frames of the chain that move the shapes of some pair, of shape (c, 2)."""
    coupled: Ints
    """Which of these move the shapes of each pair, of shape (p,)."""


class Workspace(NamedTuple):
    """Memory for examinations."""

    frames: Array
    middles: Array
    """Of the shapes, of shape (s, 3); those that never move stay what they are."""
    solids: Array
    """The frames of the shapes that have one, of shape (s, 3, 4)."""
    due: Array
    """By how much [m] the frames of each pair may have moved to each other when it is to be examined."""
    now: Array
    """By how much each couple of frames can have moved, of shape (c,)."""
    about: Ints
    """The pair that was near last, which is examined first, and how many points were examined."""
    first: Ints
    """Of shape (1, 2): one near pair of one point."""
    between: Array
    axes: Array
    """The plane that was last between the shapes of each pair, as `hull_gap` wants it."""
    hulls: HullWork


def workspace(model: CompiledModel) -> Workspace:
    """Return memory for the examinations of a model."""
    frames = model.chain.places[model.groups]
    solids, centres = frames.copy(), model.spheres.centres[model.roots]
    solids[:, :, :3] = frames[:, :, :3] @ model.poses[:, :, :3]
    solids[:, :, 3] += np.einsum("sij,sj->si", frames[:, :, :3], model.poses[:, :, 3])
    return Workspace(
        np.zeros((len(model.chain.parents), 3, 4)),
        np.einsum("sij,sj->si", frames[:, :, :3], centres) + frames[:, :, 3],
        solids,
        np.zeros(len(model.firsts)),
        np.zeros(len(model.couples)),
        np.zeros(2, dtype=np.int64),
        np.zeros((1, 2), dtype=np.int64),
        np.zeros((3, 4)),
        np.tile((1.0, 0.0, 0.0, 0.0), (len(model.firsts), 1)),
        hull_work(STACK),
    )


@compiled
def near_pairs(model: CompiledModel, points: Array, found: Ints, work: Workspace) -> int:
    """Write which pairs may be too near at points of shape (m, n), as rows of (point, pair); return how many.

    It ends when `found`, of shape (k, 2), is full: then the last point that is in it may lack pairs. What is farther
    apart at one point than its frames move to each other is not examined until they can have done so.
    """
    model, work, points, found = borrowed(model), borrowed(work), borrowed(points), borrowed(found)
    firsts, seconds, reaches, middles, roots = model.firsts, model.seconds, model.reaches, work.middles, model.roots
    kinds, groups, sizes, margins = model.kinds, model.groups, model.sizes, model.margins
    frames, solids, between, spheres = work.frames, work.solids, work.between, model.spheres
    due, all_now, coupled, hulls, count = work.due, work.now, model.coupled, work.hulls, 0
    arms, pairs, last = np.empty((0, 0)), len(model.firsts), work.about[LAST]
    due[:] = -np.inf
    all_now[:] = 0.0
    for at in range(len(points)):
        work.about[EXAMINED] = at + 1
        if at:
            arms = levers(model, points) if at == 1 else arms  # many searches end at the first point, and need none
            _move(arms, points[at - 1], points[at], all_now)
            if not _is_any_due(due, all_now, coupled):
                continue
        _place(model, points[at], work)
        for step in range(pairs):
            index = last + step if last + step < pairs else last + step - pairs
            now = all_now[coupled[index]]
            if due[index] > now:
                continue
            one, other = firsts[index], seconds[index]
            x = middles[one, 0] - middles[other, 0]
            y = middles[one, 1] - middles[other, 1]
            z = middles[one, 2] - middles[other, 2]
            square = x * x + y * y + z * z
            if square > reaches[index] * reaches[index]:
                due[index] = now + np.sqrt(square) - reaches[index]
                continue
            kind, margin, axis = kinds[other], margins[index], work.axes[index]
            if kind == TREE:
                multiply_inverse(frames[groups[other]], frames[groups[one]], between)
                free = _between_trees(roots[one], roots[other], between, spheres, margin, axis, hulls)
            elif kind == BOX and kinds[one] == BOX:
                multiply_inverse(solids[other], solids[one], between)
                free = _between_boxes(between, sizes[one], sizes[other], margin + LITTLE)
            else:
                x, y, z = _seen_from(solids[other], middles[one])
                free = away(kind, sizes[other], x, y, z) - spheres.radii[roots[one]] - margin
                if free <= 0.0:
                    multiply_inverse(solids[other], frames[groups[one]], between)
                    free = _from_solid(roots[one], kind, sizes[other], between, spheres, margin, axis, hulls)
            if free > 0.0:
                due[index] = now + free
                continue
            found[count, 0], found[count, 1] = at, index
            count, work.about[LAST] = count + 1, index
            if count == len(found):
                return count
    return count


@inlined
def _place(model: CompiledModel, values: Array, work: Workspace) -> None:
    """Write where all shapes that move are at positions of shape (n,)."""
    chain, groups, kinds, frames, middles = model.chain, model.groups, model.kinds, work.frames, work.middles
    centres, roots, poses, solids = model.spheres.centres, model.roots, model.poses, work.solids
    place_links(chain, values, frames)
    for shape in range(len(groups)):
        group = groups[shape]
        if chain.kinds[group] != FIXED or chain.parents[group] >= 0:
            apply(frames[group], centres[roots[shape]], middles[shape])
            if kinds[shape] != TREE:
                multiply(frames[group], poses[shape], solids[shape])


@inlined
def _seen_from(frame: Array, point: Array) -> tuple[float, float, float]:
    """Return where a point is in a frame."""
    x, y, z = point[0] - frame[0, 3], point[1] - frame[1, 3], point[2] - frame[2, 3]
    return (
        frame[0, 0] * x + frame[1, 0] * y + frame[2, 0] * z,
        frame[0, 1] * x + frame[1, 1] * y + frame[2, 1] * z,
        frame[0, 2] * x + frame[1, 2] * y + frame[2, 2] * z,
    )


@inlined
def _from_solid(
    root: int, kind: int, size: Array, between: Array, spheres: Spheres, margin: float, axis: Array, hulls: HullWork
) -> float:
    """Return by how much spheres, or hulls in them, are farther from a solid than they must be [m]; else at most 0.

    `between` is the frame that moves them in that of the solid.
    """
    centres, radii, children, stack = spheres.centres, spheres.radii, spheres.children, hulls.stack
    spans, corners, nearest = spheres.spans, spheres.corners, hulls.nearest
    stack[0, 0] = root
    top, least = 1, np.inf
    while top:
        top -= 1
        node = stack[top, 0]
        a, b, c = centres[node, 0], centres[node, 1], centres[node, 2]
        x = between[0, 0] * a + between[0, 1] * b + between[0, 2] * c + between[0, 3]
        y = between[1, 0] * a + between[1, 1] * b + between[1, 2] * c + between[1, 3]
        z = between[2, 0] * a + between[2, 1] * b + between[2, 2] * c + between[2, 3]
        free = away(kind, size, x, y, z) - radii[node] - margin
        if free <= 0.0:
            child, first, end = children[node], spans[node, 0], spans[node, 1]
            if first < end:
                if kind == BOX:
                    x -= max(-size[0], min(size[0], x))
                    y -= max(-size[1], min(size[1], y))
                    z -= max(-size[2], min(size[2], z))
                for row in range(3):
                    nearest[row] = between[0, row] * x + between[1, row] * y + between[2, row] * z
                free = hull_gap(corners[first:end], between, kind, size, corners, margin, axis, hulls)
            if free <= 0.0 and child >= 0:
                stack[top, 0], stack[top + 1, 0] = child, child + 1
                top += 2
                free = np.inf  # that of its children counts
        if free <= 0.0:
            return 0.0
        least = min(least, free)
    return least


@inlined
def _between_trees(
    number: int, other: int, between: Array, spheres: Spheres, margin: float, axis: Array, hulls: HullWork
) -> float:
    """Return the same of two shapes; `between` is the frame that moves the first one in the other's."""
    centres, radii, children, stack = spheres.centres, spheres.radii, spheres.children, hulls.stack
    stack[0, 0], stack[0, 1] = number, other
    top, least = 1, np.inf
    while top:
        top -= 1
        first, second = stack[top, 0], stack[top, 1]
        a, b, c = centres[first, 0], centres[first, 1], centres[first, 2]
        x = between[0, 0] * a + between[0, 1] * b + between[0, 2] * c + between[0, 3] - centres[second, 0]
        y = between[1, 0] * a + between[1, 1] * b + between[1, 2] * c + between[1, 3] - centres[second, 1]
        z = between[2, 0] * a + between[2, 1] * b + between[2, 2] * c + between[2, 3] - centres[second, 2]
        free = np.sqrt(x * x + y * y + z * z) - radii[first] - radii[second] - margin
        if free <= 0.0:
            left, right = children[first], children[second]
            free = _between_hulls(first, second, between, spheres, margin, axis, hulls)
            if free <= 0.0 and (left >= 0 or right >= 0):
                if right < 0 or (left >= 0 and radii[first] >= radii[second]):
                    stack[top, 0], stack[top + 1, 0], stack[top, 1], stack[top + 1, 1] = left, left + 1, second, second
                else:
                    stack[top, 0], stack[top + 1, 0], stack[top, 1], stack[top + 1, 1] = first, first, right, right + 1
                top += 2
                free = np.inf
        if free <= 0.0:
            return 0.0
        least = min(least, free)
    return least


@inlined
def _between_hulls(
    first: int, second: int, between: Array, spheres: Spheres, margin: float, axis: Array, hulls: HullWork
) -> float:
    """Return the same of the hulls in two spheres, or of a sphere and a hull."""
    centres, radii, spans, corners = spheres.centres, spheres.radii, spheres.spans, spheres.corners
    begin, end, from_, to = spans[first, 0], spans[first, 1], spans[second, 0], spans[second, 1]
    points, others, apart = corners[begin:end], corners[from_:to], margin
    if begin == end and from_ == to:
        return 0.0
    if begin == end:
        points, apart = centres[first : first + 1], margin + radii[first]
    if from_ == to:
        others, apart = centres[second : second + 1], margin + radii[second]
    x, y, z = centres[second, 0] - between[0, 3], centres[second, 1] - between[1, 3], centres[second, 2] - between[2, 3]
    for row in range(3):
        there = between[0, row] * x + between[1, row] * y + between[2, row] * z
        hulls.nearest[row] = centres[first, row] - there
    return hull_gap(points, between, TREE, centres[0], others, apart, axis, hulls)


@inlined
def _between_boxes(between: Array, a: Array, b: Array, least: float) -> float:
    """Return the same of two boxes, of half lengths `a` and `b`: how far a plane can be moved between them, if one can.

    `between` is the frame of the first one in that of the other. It is along a face of one or an edge of each.
    """
    for row in range(3):
        reach = b[row] + least
        for column in range(3):
            reach += abs(between[row, column]) * a[column]
        if abs(between[row, 3]) > reach:
            return float(abs(between[row, 3]) - reach)
    for column in range(3):
        reach, along = a[column] + least, 0.0
        for row in range(3):
            reach += abs(between[row, column]) * b[row]
            along += between[row, column] * between[row, 3]
        if abs(along) > reach:
            return float(abs(along) - reach)
    for row in range(3):
        up, down = (row + 1) % 3, (row + 2) % 3
        for column in range(3):
            left, right = (column + 1) % 3, (column + 2) % 3
            length = np.sqrt(max(0.0, 1.0 - between[row, column] ** 2))  # of the product of both edges
            if length < 1e-3:
                continue
            reach = b[up] * abs(between[down, column]) + b[down] * abs(between[up, column])
            reach += a[left] * abs(between[row, right]) + a[right] * abs(between[row, left])
            along = between[down, 3] * between[up, column] - between[up, 3] * between[down, column]
            free = (abs(along) - reach) / length - least
            if free > 0.0:
                return float(free)
    return 0.0


@inlined
def levers(model: CompiledModel, points: Array) -> Array:
    """Return by how much two points of a couple of frames can approach each other [m] while a joint moves by 1.

    They are of shape (c, n), for joints in SI, at all of some points, of shape (m, n).
    """
    chain, couples = model.chain, model.couples
    found = np.zeros((len(couples), points.shape[1]))
    for couple in range(len(couples)):
        for side in range(2):
            frame, other, reach = couples[couple, side], couples[couple, 1 - side], 0.0
            reach = model.extents[frame]
            while frame >= 0:
                above = other
                while above > frame:  # a frame is after its parents
                    above = chain.parents[above]
                if above == frame:
                    break  # it carries both
                joint, place_ = chain.joints[frame], chain.places[frame]
                if chain.kinds[frame] == SLIDES:
                    found[couple, joint] += abs(chain.multipliers[frame])
                    most = 0.0
                    for point in range(len(points)):
                        most = max(most, abs(chain.multipliers[frame] * points[point, joint] + chain.offsets[frame]))
                    reach += most
                elif chain.kinds[frame] != FIXED:
                    found[couple, joint] += abs(chain.multipliers[frame]) * reach
                reach += np.sqrt(place_[0, 3] ** 2 + place_[1, 3] ** 2 + place_[2, 3] ** 2)
                frame = chain.parents[frame]
    return found


@inlined
def _is_any_due(due: Array, now: Array, coupled: Ints) -> bool:
    """Return whether a pair is to be examined."""
    for pair in range(len(due)):  # noqa: SIM110  (numba has no generators here)
        if not due[pair] > now[coupled[pair]]:
            return True
    return False


@inlined
def _move(arms: Array, first: Array, second: Array, now: Array) -> None:
    """Let all couples of frames have moved from a position to another one; `arms` are their `levers`."""
    for couple in range(len(now)):
        for joint in range(len(first)):
            now[couple] += abs(second[joint] - first[joint]) * arms[couple, joint]


@inlined
def is_line_free(model: CompiledModel, first: Array, second: Array, step: float, work: Workspace) -> int:
    """Return how many points of a straight line were examined, at most `step` [rad or m] apart; below 0 if one is bad.

    The first point itself is not examined. Few points far from each other come first, then all in their order.
    """
    total = 0.0
    for index in range(len(first)):
        total += (second[index] - first[index]) ** 2
    count, stride, examined = max(1, int(np.ceil(np.sqrt(total) / step))), 1, 0
    while stride * COARSE <= count:
        stride *= 2
    points = np.empty((count, len(first)))
    while stride > 0:
        some = count // stride
        for at in range(some):
            share = (at + 1) * stride / count
            for index in range(len(first)):
                points[at, index] = first[index] + (second[index] - first[index]) * share
        is_bad = near_pairs(model, points[:some], work.first, work) > 0
        examined += work.about[EXAMINED]
        if is_bad:
            return -int(examined)
        stride = 1 if stride > 1 else 0
    return int(examined)
