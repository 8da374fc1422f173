"""Which shapes may collide, in code that numba compiles: spheres, and hulls in them, of one shape against another one.

Import it where positions are examined, never earlier: numba takes a second, and the first compilation ten. All answers
err on one side only: shapes that are not called near are farther from each other than they must be, since the spheres
cover them (`sphere_trees`). Frames have the shape (3, 4), a rotation and a translation.

Source of the test of boxes: Gottschalk, Lin, Manocha, OBBTree (1996).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbxcompose.motion.borrowed_arrays import borrowed
from rbxcompose.motion.compiled_chain import FIXED, SLIDES, Chain, place_links
from rbxcompose.motion.compiled_convex import BOX, LITTLE, TREE, HullWork, away, hull_gap, hull_work
from rbxcompose.motion.compiled_frames import apply, multiply, multiply_inverse
from rbxcompose.motion.numba_cache import compiled, inlined

Array = NDArray[np.float64]
Whole = NDArray[np.int64]

LAST, EXAMINED = 0, 1
"""What stands in `Workspace.about`."""
COARSE = 4  # points of a line that are examined first, and up to twice as many
STACK = 2_048  # entries that descents of two trees need at most


class Spheres(NamedTuple):
    """The trees of all shapes (`SphereTree`), in the frames that move them."""

    centres: Array
    """The middle of each sphere, of shape (k, 3)."""
    radii: Array
    children: Whole
    spans: Whole
    corners: Array


class CompiledModel(NamedTuple):
    """A body and what is around it as arrays: shapes, and which pairs of them must not be near."""

    chain: Chain
    """The links that the arm moves; what is fixed to one of them is in its frame."""
    groups: Whole
    """Which frame of the chain moves each of s shapes."""
    poses: Array
    """The frame of each shape in the one that moves it, of shape (s, 3, 4)."""
    kinds: Whole
    sizes: Array
    """Half lengths of boxes, radius and half length of cylinders, normal and offset of half spaces, of shape (s, 4)."""
    roots: Whole
    """The first sphere of each shape."""
    spheres: Spheres
    firsts: Whole
    """The shape of each of p pairs whose spheres are used."""
    seconds: Whole
    margins: Array
    """How far the shapes of each pair must be from each other [m], of shape (p,)."""
    reaches: Array
    """The distance of the middles of both [m] beyond which they are; inf for half spaces."""
    extents: Array
    """How far shapes are from the frame that moves them [m], for each frame of the chain."""
    couples: Whole
    """The frames of the chain that move the shapes of some pair, of shape (c, 2)."""
    coupled: Whole
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
    about: Whole
    """The pair that was near last, which is examined first, and how many points were examined."""
    first: Whole
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
def near_pairs(model: CompiledModel, points: Array, found: Whole, work: Workspace) -> int:
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
    one: int, other: int, between: Array, spheres: Spheres, margin: float, axis: Array, hulls: HullWork
) -> float:
    """Return the same of two shapes; `between` is the frame that moves the first one in the other's."""
    centres, radii, children, stack = spheres.centres, spheres.radii, spheres.children, hulls.stack
    stack[0, 0], stack[0, 1] = one, other
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
def _is_any_due(due: Array, now: Array, coupled: Whole) -> bool:
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
