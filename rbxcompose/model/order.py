"""Start order: what starts after what, and whether that can be satisfied."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from graphlib import CycleError, TopologicalSorter

After = Mapping[str, Sequence[str]]  # name -> the names that start before it


def cycle_of(after: After) -> list[str]:
    """Return names each of which waits for the next, the last for the first; empty if there is no such cycle."""
    try:
        TopologicalSorter(after).prepare()
    except CycleError as error:
        circle: list[str] = error.args[1][:0:-1]  # the sorter lists predecessors first, and repeats the first
        first = circle.index(min(circle))
        return circle[first:] + circle[:first]
    return []


def start_order(after: After) -> list[str]:
    """Return all names so that each comes after those it waits for, otherwise in the given order.

    There must be no cycle.
    """
    ordered: dict[str, None] = {}
    for first in after:
        waiting = [(first, iter(after[first]))]  # no recursion: a chain may be longer than Python's stack
        while waiting:
            name, others = waiting[-1]
            other = next((one for one in others if one in after and one not in ordered), None)
            if other is not None:
                waiting.append((other, iter(after[other])))
            else:
                ordered.setdefault(name)
                waiting.pop()
    return list(ordered)
