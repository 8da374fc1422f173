"""Answers stay below their limit, whatever is in them, and say what they lack."""

from __future__ import annotations

import json
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.tools.mcp.server import CUT, MOST_ITEMS, MOST_TEXT, limited

LEAST = 200  # characters, with which it can still be said that nothing fits
DATA: st.SearchStrategy[Any] = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(max_size=300),
    lambda inner: st.lists(inner, max_size=30) | st.dictionaries(st.text(max_size=20), inner, max_size=10),
    max_leaves=30,
)


@given(st.dictionaries(st.text(max_size=20), DATA, max_size=10), st.integers(LEAST, 2000))
def test_an_answer_is_whole_or_says_what_is_left_out(data: dict[str, Any], most: int) -> None:
    shown = limited(data, most)
    assert len(json.dumps(shown, ensure_ascii=False)) <= most
    assert shown == data or shown[CUT]


def test_long_lists_and_texts_lose_their_ends() -> None:
    shown = limited({"list": list(range(MOST_ITEMS + 3)), "text": "x" * (MOST_TEXT + 5)})
    assert (len(shown["list"]), len(shown["text"])) == (MOST_ITEMS, MOST_TEXT)
    assert shown[CUT] == [f"list: 3 of {MOST_ITEMS + 3} items", f"text: 5 of {MOST_TEXT + 5:,} characters"]


def test_what_is_nested_too_deeply_is_left_out() -> None:
    deep: Any = "end"
    for _ in range(1000):
        deep = [deep]
    assert limited({"deep": deep})[CUT] == ["deep" + ".0" * 19 + ": what is nested deeper"]
