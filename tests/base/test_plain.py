"""Foreign text cannot move the cursor, hide, or reorder what stands beside it."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.printable import FORBIDDEN, columns, escaped, fitted, plain


def test_control_characters_are_spelt_out() -> None:
    assert plain("a\x1b[31mb\r\n\tc\x7f\x85\u202e\ufeff") == r"a\x1b[31mb\r\n\tc\x7f\x85\u202e\ufeff"


def test_what_can_be_seen_stays() -> None:
    assert plain("größe 漢字 [link=x] \\") == "größe 漢字 [link=x] \\"


def test_long_text_is_cut_with_a_count() -> None:
    assert plain("x" * 1250) == "x" * 200 + "... (1,050 more characters)"


@given(st.text())
def test_nothing_invisible_is_left_and_it_is_one_line(text: str) -> None:
    shown = plain(text)
    assert not FORBIDDEN.search(shown)
    assert "\n" not in shown
    assert "\t" not in shown


@given(st.text(), st.integers(3, 40))
def test_what_is_fitted_fits_and_is_the_text_or_how_it_begins(text: str, width: int) -> None:
    shown = fitted(text, width)
    assert columns(shown) <= width
    assert shown == text or (shown.endswith("...") and text.startswith(shown[:-3]))


def test_wide_characters_take_two_columns_and_combining_ones_none() -> None:
    assert [columns(text) for text in ("robot", "\u673a", "e\u0301", "\u200b")] == [5, 2, 1, 0]


@pytest.mark.parametrize("hidden", ["\u200b", "\u200d", "\u200e", "\u2060", "\xad", "\u061c"])
def test_what_nobody_can_see_is_spelt_out(hidden: str) -> None:
    code = ascii(hidden)[1:-1]
    assert plain(f"go{hidden}_to") == f"go{code}_to"
    assert json.loads(escaped(json.dumps(f"go{hidden}_to", ensure_ascii=False))) == f"go{hidden}_to"
    assert hidden not in escaped(f'"go{hidden}_to"')
