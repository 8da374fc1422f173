"""Which layer each node of a graph is in, so that most edges lead to the right."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

Edge = tuple[str, str]


def to_the_right(order: Sequence[str], edges: Sequence[Edge]) -> dict[Edge, Edge]:
    """Return each edge as it leads to the right, when the nodes stand in this order."""
    position = {key: index for index, key in enumerate(order)}
    return {(one, other): (one, other) if position[one] < position[other] else (other, one) for one, other in edges}


def order_of(keys: Sequence[str], edges: Sequence[Edge]) -> list[str]:
    """Return the nodes so that few edges lead to the left, by the rule of Eades, Lin and Smyth.

    Sources come first and sinks last; else those come first that more leads away from.
    """
    left: list[str] = []
    right: list[str] = []
    rest = dict.fromkeys(keys)
    while rest:
        leaving = dict.fromkeys(rest, 0)
        coming = dict.fromkeys(rest, 0)
        for one, other in edges:
            if one in rest and other in rest and one != other:
                leaving[one] += 1
                coming[other] += 1
        sinks = [key for key in rest if not leaving[key]]
        sources = [key for key in rest if leaving[key] and not coming[key]]
        if sinks or sources:
            right[:0] = sinks
            left += sources
            for key in (*sinks, *sources):
                del rest[key]
        else:
            key = max(rest, key=lambda one: leaving[one] - coming[one])
            left.append(key)
            del rest[key]
    return left + right


def layers_of(keys: Sequence[str], edges: Sequence[Edge]) -> Mapping[str, int]:
    """Return a layer from 0 for each node, right of all that leads to it and near to what it leads to."""
    before: dict[str, list[str]] = {key: [] for key in keys}
    after: dict[str, list[str]] = {key: [] for key in keys}
    for one, other in edges:
        before[other].append(one)
        after[one].append(other)
    order = _topological(keys, before, after)
    layer = dict.fromkeys(keys, 0)
    for key in order:
        layer[key] = max((layer[one] + 1 for one in before[key]), default=0)
    for key in reversed(order):
        if after[key] and len(after[key]) >= len(before[key]):
            layer[key] = max(layer[key], min(layer[one] for one in after[key]) - 1)
    first = min(layer.values(), default=0)
    return {key: number - first for key, number in layer.items()}


def _topological(keys: Sequence[str], before: Mapping[str, list[str]], after: Mapping[str, list[str]]) -> list[str]:
    missing = {key: len(before[key]) for key in keys}
    order = [key for key in keys if not missing[key]]
    for key in order:  # grows as it goes
        for one in after[key]:
            missing[one] -= 1
            if not missing[one]:
                order.append(one)
    return order
