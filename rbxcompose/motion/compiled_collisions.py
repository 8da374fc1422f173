"""Which shapes may collide, in code that numba compiles: spheres of one shape against another one.

Import it where positions are examined, never earlier: numba takes a second, and the first compilation ten. All answers
err on one side only: shapes that are not called near are farther from each other than they must be, since the spheres
cover them (`sphere_trees`). Frames have the shape (3, 4), a rotation and a translation.

Source of the test of boxes: Gottschalk, Lin, Manocha, OBBTree (1996).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbxcompose.motion.compiled_chain import FIXED, SLIDES, Chain, place_links
from rbxcompose.motion.compiled_frames import apply, multiply, multiply_inverse
from rbxcompose.motion.numba_cache import compiled, inlined

Array = NDArray[np.float64]
Whole = NDArray[np.int64]

TREE, BOX, CYLINDER, HALF_SPACE = 0, 1, 2, 3
"""What a shape is beside its spheres."""
COARSE = 4  # points of a line that are examined first, and up to twice as many
STACK = 2_048  # entries that descents of two trees need at most
LITTLE = 1e-6  # [m], much more than rounding


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
    centres: Array
    """The middle of each sphere in the frame that moves it, of shape (k, 3)."""
    radii: Array
    children: Whole
    firsts: Whole
    """The shape of each of p pairs whose spheres are used."""
    seconds: Whole
    margins: Array
    """How far the shapes of each pair must be from each other [m], of shape (p,)."""
    reaches: Array
    """The distance of the middles of both [m] beyond which they are; inf for half spaces."""
    extents: Array
    """How far shapes are from the frame that moves them [m], for each frame of the chain."""


class Workspace(NamedTuple):
    """Memory for examinations."""

    frames: Array
    middles: Array
    stack: Whole
    due: Array
    near: Whole
    one: Array
    other: Array
    between: Array


def workspace(model: CompiledModel) -> Workspace:
    """Return memory for the examinations of a model."""
    return Workspace(
        np.zeros((len(model.chain.parents), 3, 4)),
        np.zeros((len(model.groups), 3)),
        np.zeros((STACK, 2), dtype=np.int64),
        np.zeros(len(model.firsts)),
        np.zeros(len(model.firsts), dtype=np.int64),
        *(np.zeros((3, 4)) for _ in range(3)),
    )


@inlined
def place(model: CompiledModel, values: Array, work: Workspace) -> None:
    """Compute the frames of links for positions of shape (n,), and the middles of shapes."""
    frames, middles = work.frames, work.middles
    place_links(model.chain, values, frames)
    groups, centres, roots = model.groups, model.centres, model.roots
    for shape in range(len(groups)):
        apply(frames[groups[shape]], centres[roots[shape]], middles[shape])


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
def examine(model: CompiledModel, work: Workspace, now: float, most: int) -> int:
    """Write the pairs that may be nearer than they must be to `work.near`, and return how many; `place` was called.

    It ends with `most` of them. `work.due` has when each pair is to be examined: `now` is by how much anything can have
    moved [m] until here, and what is farther apart than that stays so until then.
    """
    # Arrays are taken out of the model once: to hand on so many of them takes longer than to examine a pair.
    firsts, seconds, reaches, middles = model.firsts, model.seconds, model.reaches, work.middles
    kinds, groups, poses, sizes, margins = model.kinds, model.groups, model.poses, model.sizes, model.margins
    centres, radii, children, roots = model.centres, model.radii, model.children, model.roots
    frames, stack, frame, other_frame, between = work.frames, work.stack, work.one, work.other, work.between
    due, near, count = work.due, work.near, 0
    for index in range(len(firsts)):
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
        kind, margin = kinds[other], margins[index]
        if kind == TREE:
            multiply_inverse(frames[groups[other]], frames[groups[one]], between)
            free = _between_trees(roots[one], roots[other], between, centres, radii, children, margin, stack)
        else:
            multiply(frames[groups[other]], poses[other], other_frame)
            if kind == BOX and kinds[one] == BOX:
                multiply(frames[groups[one]], poses[one], frame)
                multiply_inverse(other_frame, frame, between)
                free = _between_boxes(between, sizes[one], sizes[other], margin + LITTLE)
            else:
                multiply_inverse(other_frame, frames[groups[one]], between)
                free = _from_solid(roots[one], kind, sizes[other], between, centres, radii, children, margin, stack)
        if free > 0.0:
            due[index] = now + free
            continue
        near[count] = index
        count += 1
        if count == most:
            break
    return count


@inlined
def _from_solid(
    root: int,
    kind: int,
    size: Array,
    between: Array,
    centres: Array,
    radii: Array,
    children: Whole,
    margin: float,
    stack: Whole,
) -> float:
    """Return by how much spheres are farther from a solid than they must be [m], at most 0 if they may not be.

    `between` is the frame that moves them in that of the solid.
    """
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
        if free > 0.0:
            least = min(least, free)
            continue
        child = children[node]
        if child < 0:
            return 0.0
        stack[top, 0], stack[top + 1, 0] = child, child + 1
        top += 2
    return least


@inlined
def _between_trees(
    one: int,
    other: int,
    between: Array,
    centres: Array,
    radii: Array,
    children: Whole,
    margin: float,
    stack: Whole,
) -> float:
    """Return the same of the spheres of two shapes; `between` is the frame that moves the first one in the other's."""
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
        if free > 0.0:
            least = min(least, free)
            continue
        left, right = children[first], children[second]
        if left < 0 and right < 0:
            return 0.0
        if right < 0 or (left >= 0 and radii[first] >= radii[second]):
            stack[top, 0], stack[top + 1, 0], stack[top, 1], stack[top + 1, 1] = left, left + 1, second, second
        else:
            stack[top, 0], stack[top + 1, 0], stack[top, 1], stack[top + 1, 1] = first, first, right, right + 1
        top += 2
    return least


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


@compiled
def is_free(model: CompiledModel, values: Array, work: Workspace) -> bool:
    """Return whether no shapes may be too near to each other at positions of shape (n,)."""
    place(model, values, work)
    begin(work)
    return examine(model, work, 0.0, 1) == 0


@inlined
def reaches_of_links(model: CompiledModel, points: Array) -> Array:
    """Return how far what a link moves is from its frame [m] at most, at all of some points, of shape (frames,)."""
    chain, found = model.chain, model.extents.copy()
    for index in range(len(found) - 1, -1, -1):
        parent, place_, most = chain.parents[index], chain.places[index], 0.0
        if parent < 0:
            continue
        if chain.kinds[index] == SLIDES:
            for point in range(len(points)):
                at = chain.multipliers[index] * points[point, chain.joints[index]] + chain.offsets[index]
                most = max(most, abs(at))
        most += found[index] + np.sqrt(place_[0, 3] ** 2 + place_[1, 3] ** 2 + place_[2, 3] ** 2)
        found[parent] = max(found[parent], most)
    return found


@inlined
def begin(work: Workspace) -> None:
    """Let all pairs be due."""
    for pair in range(len(work.due)):
        work.due[pair] = -np.inf


@inlined
def is_any_due(work: Workspace, now: float) -> bool:
    """Return whether a pair is to be examined."""
    least = np.inf
    for pair in range(len(work.due)):
        least = min(least, work.due[pair])
    return not least > now


@inlined
def moved(model: CompiledModel, reaches: Array, first: Array, second: Array) -> float:
    """Return by how much two points of the body can approach each other at most [m] between two positions."""
    chain, total = model.chain, 0.0
    for index in range(len(reaches)):
        if chain.kinds[index] != FIXED:
            joint = chain.joints[index]
            by = abs(chain.multipliers[index] * (second[joint] - first[joint]))
            total += by if chain.kinds[index] == SLIDES else by * reaches[index]
    return total


@compiled
def near_pairs(model: CompiledModel, points: Array, found: Whole, work: Workspace) -> int:
    """Write which pairs may be too near at points of shape (m, n), as rows of (point, pair); return how many.

    It ends when `found`, of shape (k, 2), is full: then the last point that is in it may lack pairs.
    """
    count, now, reaches = 0, 0.0, reaches_of_links(model, points)
    begin(work)
    for index in range(len(points)):
        if index:
            now += moved(model, reaches, points[index - 1], points[index])
        if not is_any_due(work, now):
            continue
        place(model, points[index], work)
        near = examine(model, work, now, len(work.near))
        for one in range(min(near, len(found) - count)):
            found[count, 0], found[count, 1] = index, work.near[one]
            count += 1
        if count == len(found):
            break
    return count


@inlined
def is_line_free(model: CompiledModel, first: Array, second: Array, step: float, work: Workspace) -> int:
    """Return how many points of a straight line were examined, at most `step` [rad or m] apart; below 0 if one is bad.

    The first point itself is not examined. Few points far from each other come first, then all in their order.
    """
    total = 0.0
    for index in range(len(first)):
        total += (second[index] - first[index]) ** 2
    count = max(1, int(np.ceil(np.sqrt(total) / step)))
    point, examined, stride = np.empty(len(first)), 0, 1
    while stride * COARSE <= count:
        stride *= 2
    widest = stride
    while stride > 1:
        at = stride
        while at <= count:
            if stride == widest or at % (2 * stride):
                on_line(first, second, at / count, point)
                examined += 1
                if not is_free(model, point, work):
                    return -examined
            at += stride
        stride //= 4
    ends = np.empty((2, len(first)))
    on_line(first, second, 0.0, ends[0])
    on_line(first, second, 1.0, ends[1])
    by = moved(model, reaches_of_links(model, ends), first, second) / count
    begin(work)
    for at in range(1, count + 1):
        if not is_any_due(work, at * by):
            continue
        on_line(first, second, at / count, point)
        examined += 1
        place(model, point, work)
        if examine(model, work, at * by, 1):
            return -examined
    return examined


@inlined
def on_line(first: Array, second: Array, share: float, found: Array) -> None:
    """Write a point of a straight line."""
    for index in range(len(first)):
        found[index] = first[index] + (second[index] - first[index]) * share
