"""The layout of graphs: nothing lies on anything else, lines begin and end at what they connect."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.seeing.layering import layers_of, order_of, to_the_right
from rbxcompose.seeing.layout import Item, Layout, Rect, lay_out

GRAPHS = st.integers(1, 14).flatmap(
    lambda count: st.tuples(
        st.lists(st.integers(0, 3), min_size=count, max_size=count),
        st.lists(st.tuples(st.integers(0, count - 1), st.integers(0, count - 1)), max_size=30),
    )
)


def laid_out(bands: list[int], links: list[tuple[int, int]]) -> tuple[Layout, list[tuple[str, str]]]:
    items = [Item(str(index), 40.0 + 7 * index, 20.0 + 5 * (index % 4), band) for index, band in enumerate(bands)]
    edges = list(dict.fromkeys((str(one), str(other)) for one, other in links if one != other))
    return lay_out(items, edges), edges


def is_apart(one: Rect, other: Rect) -> bool:
    across = one.x + one.width <= other.x + 0.01 or other.x + other.width <= one.x + 0.01
    return across or one.y + one.height <= other.y + 0.01 or other.y + other.height <= one.y + 0.01


@settings(max_examples=150, deadline=None)
@given(GRAPHS)
def test_boxes_and_bands_never_overlap_and_lie_in_the_picture(graph: tuple[list[int], list[tuple[int, int]]]) -> None:
    layout, _ = laid_out(*graph)
    for rects in (list(layout.places.values()), list(layout.bands.values())):
        for index, one in enumerate(rects):
            assert all(is_apart(one, other) for other in rects[index + 1 :])
            assert one.x >= 0
            assert one.y >= 0
            assert one.x + one.width <= layout.width
            assert one.y + one.height <= layout.height


@settings(max_examples=150, deadline=None)
@given(GRAPHS)
def test_a_line_begins_and_ends_at_the_side_of_what_it_connects(graph: tuple[list[int], list[tuple[int, int]]]) -> None:
    layout, edges = laid_out(*graph)
    assert set(layout.paths) == set(edges)
    for (begin, end), path in layout.paths.items():
        for key, (x, y) in ((begin, path[0]), (end, path[-1])):
            rect = layout.places[key]
            assert x in (pytest.approx(rect.x), pytest.approx(rect.x + rect.width))
            assert rect.y < y < rect.y + rect.height


@given(GRAPHS)
def test_after_turning_some_edges_round_each_leads_to_a_later_layer(
    graph: tuple[list[int], list[tuple[int, int]]],
) -> None:
    bands, links = graph
    keys = [str(index) for index in range(len(bands))]
    edges = [(str(one), str(other)) for one, other in links if one != other]
    order = order_of(keys, edges)
    assert sorted(order) == sorted(keys)
    turned = list(to_the_right(order, edges).values())
    layers = layers_of(keys, turned)
    assert all(layers[one] < layers[other] for one, other in turned)
    assert min(layers.values()) == 0


def test_a_chain_is_not_turned_round() -> None:
    edges = [("a", "b"), ("b", "c"), ("c", "d")]
    assert to_the_right(order_of(["d", "c", "b", "a"], edges), edges) == {edge: edge for edge in edges}


def test_nothing_at_all_has_a_layout() -> None:
    assert lay_out([], []).places == {}
