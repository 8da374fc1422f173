"""The fast search for a path: compiled, on spheres. What it finds has to be examined on the shapes themselves."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np

from rbxcompose.domains.arms.motion import compiled_search
from rbxcompose.domains.arms.motion.compiled_collisions import CompiledModel, Workspace, near_pairs
from rbxcompose.domains.arms.motion.groups import Array, JointSpace
from rbxcompose.domains.arms.motion.search import MARGIN, sample_range

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
    while (
        ended := compiled_search.grow(model, trees, low, high, RANGE, resolution, SLICE, work)
    ) != compiled_search.FOUND:
        if ended == compiled_search.FULL:
            if trees.nodes.shape[1] >= MOST_NODES:
                return f"there was no path among {MOST_NODES:,} positions"
            trees = _larger(trees)
        yield int(trees.about[compiled_search.EXAMINED])
    path = _path(trees)
    if simplify:
        room = np.concatenate((path, np.empty((SHORTCUTS, path.shape[1]))))
        count = compiled_search.shorten(model, room, len(path), SHORTCUTS, resolution, trees.seed, trees.about, work)
        path = room[:count]
    yield int(trees.about[compiled_search.EXAMINED])
    return path


def compile_search(model: CompiledModel, work: Workspace, size: int) -> None:
    """Compile what is not in the caches, for an arm of so many joints."""
    here = np.zeros(size)
    trees = _trees((here, here), 0)
    ranges = np.stack((here, here))
    compiled_search.grow(model, trees, ranges, ranges, RANGE, RANGE, 0, work)
    compiled_search.shorten(model, trees.nodes[0].copy(), 2, 0, RANGE, trees.seed, trees.about, work)


def _trees(ends: tuple[Array, Array], seed: int) -> compiled_search.SearchTrees:
    nodes = np.empty((2, NODES, len(ends[0])))
    nodes[:, 0] = ends
    return compiled_search.SearchTrees(
        nodes,
        np.full((2, NODES), -1, dtype=np.int64),
        np.ones(2, dtype=np.int64),
        np.full((2, NODES), np.inf),
        np.zeros(3, dtype=np.int64),
        np.array([seed], dtype=np.uint64),
    )


def _larger(trees: compiled_search.SearchTrees) -> compiled_search.SearchTrees:
    """Return the same trees with room for twice as many nodes."""
    nodes = np.concatenate((trees.nodes, np.empty_like(trees.nodes)), axis=1)
    parents = np.concatenate((trees.parents, np.full_like(trees.parents, -1)), axis=1)
    domains = np.concatenate((trees.domains, np.full_like(trees.domains, np.inf)), axis=1)
    return trees._replace(nodes=nodes, parents=parents, domains=domains)


def _path(trees: compiled_search.SearchTrees) -> Array:
    """Return the points from the start over where both trees meet to the goal."""
    sides: list[list[Array]] = []
    for own, at in ((0, compiled_search.LEFT), (1, compiled_search.RIGHT)):
        node, found = int(trees.about[at]), []
        while node >= 0:
            found.append(trees.nodes[own, node])
            node = int(trees.parents[own, node])
        sides.append(found)
    return np.array([*reversed(sides[0]), *sides[1][1:]])
