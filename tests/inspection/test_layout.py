"""The layout of graphs: nothing lies on anything else, lines begin and end at what they connect."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.commands import layout as module
from rbxcompose.commands.console import NotDoneError
from rbxcompose.commands.layout import Edge, Layout, LayoutItem, Rect, lay_out

GRAPHS = st.integers(1, 14).flatmap(
    lambda count: st.tuples(
        st.lists(st.sampled_from(["", "world", "robot", 'a "b" <c>']), min_size=count, max_size=count),
        st.lists(st.tuples(st.integers(0, count - 1), st.integers(0, count - 1)), max_size=30),
    )
)
NEAR = 1.5  # [px] Graphviz counts in whole points here and there


def laid_out(groups: list[str], links: list[tuple[int, int]]) -> tuple[Layout, list[Edge]]:
    items = [
        LayoutItem(f"{index}:i", 40.0 + 7 * index, 20.0 + 5 * (index % 4), group) for index, group in enumerate(groups)
    ]
    edges = list(dict.fromkeys((f"{number}:i", f"{other}:i") for number, other in links if number != other))
    return lay_out(items, edges), edges


def is_apart(rect: Rect, other: Rect) -> bool:
    across = rect.x + rect.width <= other.x + NEAR or other.x + other.width <= rect.x + NEAR
    return across or rect.y + rect.height <= other.y + NEAR or other.y + other.height <= rect.y + NEAR


def is_at(x: float, y: float, rect: Rect) -> bool:
    is_across = rect.x - NEAR <= x <= rect.x + rect.width + NEAR
    return is_across and rect.y - NEAR <= y <= rect.y + rect.height + NEAR


@given(GRAPHS)
def test_boxes_and_groups_never_overlap_and_lie_in_the_picture(graph: tuple[list[str], list[tuple[int, int]]]) -> None:
    layout, _ = laid_out(*graph)
    assert len(layout.places) == len(graph[0])
    assert layout.groups.keys() == {group for group in graph[0] if group}
    for rects in (list(layout.places.values()), list(layout.groups.values())):
        for index, rect in enumerate(rects):
            assert all(is_apart(rect, other) for other in rects[index + 1 :])
            assert rect.x >= 0
            assert rect.y >= 0
            assert rect.x + rect.width <= layout.width
            assert rect.y + rect.height <= layout.height


@given(GRAPHS)
def test_a_line_begins_and_ends_at_what_it_connects(graph: tuple[list[str], list[tuple[int, int]]]) -> None:
    layout, edges = laid_out(*graph)
    assert set(layout.paths) == set(edges)
    for (begin, end), path in layout.paths.items():
        numbers = [float(number) for number in re.findall(r"[-0-9.]+", path)]
        assert is_at(numbers[0], numbers[1], layout.places[begin])
        assert is_at(numbers[-2], numbers[-1], layout.places[end])


def test_a_chain_leads_to_the_right() -> None:
    layout, _ = laid_out(["", "", ""], [(0, 1), (1, 2)])
    assert sorted(layout.places, key=lambda key: layout.places[key].x) == ["0:i", "1:i", "2:i"]


def test_a_group_has_room_for_its_name() -> None:
    layout, _ = laid_out(["robot"], [])
    assert layout.places["0:i"].y - layout.groups["robot"].y >= 20


def test_nothing_at_all_has_a_layout() -> None:
    assert lay_out([], []).places == {}


def test_without_graphviz_it_is_told_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "find_spec", lambda name: None)
    with pytest.raises(NotDoneError, match="needs Graphviz") as caught:
        lay_out([], [])
    assert caught.value.finding.help == "install it with: pip install 'rbxcompose[graph]'"
