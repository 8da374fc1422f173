"""The fast search for a path, and its shortening, in compiled code: RRT-Connect on the spheres of `CompiledModel`.

What it finds has to be examined on the shapes themselves. The same arguments give the same path, on any machine with
the same arithmetic: random numbers are our own. Source of the search: Kuffner and LaValle, RRT-Connect (2000); of
samples that are left out: Yershova, Jaillet, Simeon, LaValle, Dynamic-Domain RRTs (2005); of random numbers: Steele,
Lea, Flood, Fast splittable pseudorandom number generators (2014); of shortcuts: Geraerts and Overmars, Creating
high-quality paths for motion planning (2007).
"""

from __future__ import annotations

from collections.abc import Generator
from typing import NamedTuple

import numpy as np

from rbxcompose.base.arrays import Array, Ints, Words
from rbxcompose.domains.arms.motion.compiled_collisions import CompiledModel, Workspace, is_line_free, near_pairs
from rbxcompose.domains.arms.motion.groups import JointSpace
from rbxcompose.domains.arms.motion.numba_cache import borrowed, compiled, inlined
from rbxcompose.domains.arms.motion.search import MARGIN, sample_range

GAIN = 0.02  # of a piece of a path: a shortcut that saves less is not examined
WIDE = 10_000  # examined positions, after which samples are from all of their ranges
DOMAIN = 3.0  # longest branches: a sample farther away is no use to a node next to what collides
PAUSED, FOUND, FULL = 0, 1, 2
"""How a slice of a search ends."""
EXAMINED, LEFT, RIGHT = 0, 1, 2
"""What stands in `SearchTrees.about`: examined positions, and where both trees meet."""


class SearchTrees(NamedTuple):
    """Two trees of positions, from the start and from the goal."""

    nodes: Array
    """Of shape (2, k, n)."""
    parents: Ints
    """The node before each one, of shape (2, k)."""
    counts: Ints
    """How many nodes each tree has."""
    domains: Array
    """How far a sample may be from each node to be worth a branch, of shape (2, k); inf until one was not free."""
    about: Ints
    seed: Words
    """The state of the random numbers, of shape (1,)."""


@inlined
def random(seed: Words) -> float:
    """Return a random number from 0 to 1."""
    seed[0] += np.uint64(0x9E3779B97F4A7C15)
    mixed = seed[0]
    mixed = (mixed ^ (mixed >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    mixed = mixed ^ (mixed >> np.uint64(31))
    return np.float64(mixed >> np.uint64(11)) / 9007199254740992.0


@compiled
def grow(
    model: CompiledModel,
    trees: SearchTrees,
    low: Array,
    high: Array,
    reach: float,
    step: float,
    budget: int,
    work: Workspace,
) -> int:
    """Search until both trees meet, a tree is full, or `budget` more positions are examined; return which.

    Samples are between `low` and `high`, of shape (2, n): in the first range to begin with, in the second one after
    `WIDE` positions. A branch is at most `reach` long, and examined every `step`.
    """
    model, trees, work = borrowed(model), borrowed(trees), borrowed(work)
    about, wanted = trees.about, np.empty(low.shape[1])
    until = about[EXAMINED] + budget
    while about[EXAMINED] < until:
        if max(trees.counts[0], trees.counts[1]) + 1 >= trees.nodes.shape[1]:
            return FULL
        own = 0 if trees.counts[0] <= trees.counts[1] else 1  # the smaller tree
        wide = min(1.0, about[EXAMINED] / WIDE)
        for index in range(len(wanted)):
            least = low[0, index] + wide * (low[1, index] - low[0, index])
            most = high[0, index] + wide * (high[1, index] - high[0, index])
            wanted[index] = least + (most - least) * random(trees.seed)
        if not extend(model, trees, own, wanted, reach, step, work):
            continue
        new = trees.counts[own] - 1
        for index in range(len(wanted)):
            wanted[index] = trees.nodes[own, new, index]
        while trees.counts[1 - own] < trees.nodes.shape[1] and extend(model, trees, 1 - own, wanted, reach, step, work):
            last, is_same = trees.counts[1 - own] - 1, True
            for index in range(len(wanted)):
                is_same = is_same and trees.nodes[1 - own, last, index] == wanted[index]
            if is_same:
                about[LEFT + own], about[LEFT + 1 - own] = new, last
                return FOUND
    return PAUSED


@inlined
def extend(
    model: CompiledModel, trees: SearchTrees, own: int, wanted: Array, reach: float, step: float, work: Workspace
) -> bool:
    """Grow one tree towards a position by one branch; return whether that was free."""
    nodes, count = trees.nodes[own], trees.counts[own]
    nearest, least = 0, np.inf
    for node in range(count):
        total = 0.0
        for index in range(len(wanted)):
            total += (nodes[node, index] - wanted[index]) ** 2
        if total < least:
            nearest, least = node, total
    length = np.sqrt(least)
    if length > trees.domains[own, nearest]:
        trees.about[EXAMINED] += 1  # so that a slice ends
        return False
    share = 1.0 if length <= reach else reach / length
    for index in range(len(wanted)):
        begin = nodes[nearest, index]
        nodes[count, index] = wanted[index] if share == 1.0 else begin + (wanted[index] - begin) * share
    examined = is_line_free(model, nodes[nearest], nodes[count], step, work)
    trees.about[EXAMINED] += abs(examined)
    if examined < 0:
        trees.domains[own, nearest] = DOMAIN * reach
        return False
    trees.parents[own, count] = nearest
    trees.domains[own, count] = np.inf
    trees.counts[own] = count + 1
    return True


@compiled
def shorten(
    model: CompiledModel, path: Array, count: int, tries: int, step: float, seed: Words, about: Ints, work: Workspace
) -> int:
    """Shorten a path of `count` points in place; return how many there are then. It has room for `tries` more."""
    model, path, about, work = borrowed(model), borrowed(path), borrowed(about), borrowed(work)
    count = reduce(model, path, count, step, about, work)
    size = path.shape[1]
    one, other = np.empty(size), np.empty(size)
    for _ in range(tries):
        if count < 3:
            break
        first, second = random(seed) * (count - 1), random(seed) * (count - 1)
        if first > second:
            first, second = second, first
        begin, end = int(first), int(second)
        if begin == end:
            continue
        for index in range(size):
            one[index] = path[begin, index] + (path[begin + 1, index] - path[begin, index]) * (first - begin)
            other[index] = path[end, index] + (path[end + 1, index] - path[end, index]) * (second - end)
        around = distance(one, path[begin + 1]) + distance(path[end], other)
        for place in range(begin + 1, end):
            around += distance(path[place], path[place + 1])
        if around - distance(one, other) < GAIN * around:
            continue
        examined = is_line_free(model, one, other, step, work)
        about[EXAMINED] += abs(examined)
        if examined < 0:
            continue
        rest = count - end - 1  # points after the shortcut
        to = begin + 3
        for place in range(rest):  # backwards where points move up, so that none is lost
            point = rest - 1 - place if to > end + 1 else place
            copy(path[end + 1 + point], path[to + point])
        copy(one, path[begin + 1])
        copy(other, path[begin + 2])
        count = to + rest
    return reduce(model, path, count, step, about, work)


@inlined
def reduce(model: CompiledModel, path: Array, count: int, step: float, about: Ints, work: Workspace) -> int:
    """Leave out points of a path in place where the straight line past them is free; return how many are left."""
    kept, here = 1, 0
    while here < count - 1:
        there = count - 1
        while there > here + 1:
            examined = is_line_free(model, path[here], path[there], step, work)
            about[EXAMINED] += abs(examined)
            if examined > 0:
                break
            there -= 1
        copy(path[there], path[kept])
        kept += 1
        here = there
    return kept


@inlined
def distance(array: Array, other: Array) -> float:
    """Return how far two positions are from each other."""
    total = 0.0
    for index in range(len(array)):
        total += (array[index] - other[index]) ** 2
    return float(np.sqrt(total))


@inlined
def copy(array: Array, other: Array) -> None:
    """Write an array over another one."""
    for index in range(len(array)):
        other[index] = array[index]


SLICE = 5_000  # examined positions, after which a search lets others run
NODES, MOST_NODES = 1_024, 16_384  # of a tree at the beginning, and at most
RANGE = 1.5  # [rad], the longest branch of a tree
SHORTCUTS = 60  # attempts to shorten a path


def fast_path(
    model: CompiledModel,
    work: Workspace,
    space: JointSpace,
    ends: tuple[Array, Array],
    *,
    seed: int,
    resolution: float,
    simplify: bool,
) -> Generator[int, None, Array | str]:
    """Search a path between two positions; return its points, of shape (m, n), or why there is none.

    It yields how many positions were examined, and goes on until it is closed. The same arguments give the same path.
    """
    for word, values in zip(("start", "goal"), ends, strict=True):
        if near_pairs(model, values[None], work.first, work):
            return f"spheres collide at the {word}"
    near, whole = sample_range(space, *ends, MARGIN), sample_range(space, *ends)
    low, high = np.stack((near[0], whole[0])), np.stack((near[1], whole[1]))
    trees = _trees(ends, seed)
    while (ended := grow(model, trees, low, high, RANGE, resolution, SLICE, work)) != FOUND:
        if ended == FULL:
            if trees.nodes.shape[1] >= MOST_NODES:
                return f"there was no path among {MOST_NODES:,} positions"
            trees = _larger(trees)
        yield int(trees.about[EXAMINED])
    path = _path(trees)
    if simplify:
        room = np.concatenate((path, np.empty((SHORTCUTS, path.shape[1]))))
        count = shorten(model, room, len(path), SHORTCUTS, resolution, trees.seed, trees.about, work)
        path = room[:count]
    yield int(trees.about[EXAMINED])
    return path


def compile_search(model: CompiledModel, work: Workspace, size: int) -> None:
    """Compile what is not in the caches, for an arm of so many joints."""
    here = np.zeros(size)
    trees = _trees((here, here), 0)
    ranges = np.stack((here, here))
    grow(model, trees, ranges, ranges, RANGE, RANGE, 0, work)
    shorten(model, trees.nodes[0].copy(), 2, 0, RANGE, trees.seed, trees.about, work)


def _trees(ends: tuple[Array, Array], seed: int) -> SearchTrees:
    nodes = np.empty((2, NODES, len(ends[0])))
    nodes[:, 0] = ends
    return SearchTrees(
        nodes,
        np.full((2, NODES), -1, dtype=np.int64),
        np.ones(2, dtype=np.int64),
        np.full((2, NODES), np.inf),
        np.zeros(3, dtype=np.int64),
        np.array([seed], dtype=np.uint64),
    )


def _larger(trees: SearchTrees) -> SearchTrees:
    """Return the same trees with room for twice as many nodes."""
    nodes = np.concatenate((trees.nodes, np.empty_like(trees.nodes)), axis=1)
    parents = np.concatenate((trees.parents, np.full_like(trees.parents, -1)), axis=1)
    domains = np.concatenate((trees.domains, np.full_like(trees.domains, np.inf)), axis=1)
    return trees._replace(nodes=nodes, parents=parents, domains=domains)


def _path(trees: SearchTrees) -> Array:
    """Return the points from the start over where both trees meet to the goal."""
    sides: list[list[Array]] = []
    for own, at in ((0, LEFT), (1, RIGHT)):
        node, found = int(trees.about[at]), []
        while node >= 0:
            found.append(trees.nodes[own, node])
            node = int(trees.parents[own, node])
        sides.append(found)
    return np.array([*reversed(sides[0]), *sides[1][1:]])
