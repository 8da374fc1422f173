"""Removing items from data."""

from __future__ import annotations

import pytest

from rbxcompose.base.expressions.values import Value
from rbxcompose.missions.engine.instant_actions import _removed
from rbxcompose.missions.program.outcomes import NodeFailed

LISTS: Value = [["a", "b"], ["c"]]


def test_the_first_equal_item_goes_and_the_rest_stays() -> None:
    assert _removed([["a", "b", "a"], ["a"]], [0], "a") == [["b", "a"], ["a"]]
    assert _removed(LISTS, [1.0], "c") == [["a", "b"], []]
    assert LISTS == [["a", "b"], ["c"]]


@pytest.mark.parametrize("index", [-1, 2, 0.5, "a", float("nan")])
def test_an_index_that_names_no_item_is_a_failure(index: Value) -> None:
    with pytest.raises(NodeFailed, match="nothing to remove from"):
        _removed(LISTS, [index], "c")
