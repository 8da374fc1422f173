"""Where a position is, also in text that is no YAML yet."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbxcompose.tools.lsp.completion import complete
from rbxcompose.tools.lsp.document import MARK, Cursor, Document, locate
from tests.loops import for_all
from tests.lsp.places import PATROL, ROBOT

TEXTS = {path: path.read_text(encoding="utf-8") for path in (ROBOT, PATROL)}


def at(text: str) -> Cursor | None:
    """Return what is at the bar in a text."""
    before, _, after = text.partition("|")
    return locate(before + after, before.count("\n"), len(before.rpartition("\n")[2]))


@for_all(
    "text, path, before, after, is_key",
    [
        ("a:\n  b: c|d\n", ("a", "b"), "c", "d", False),
        ("a:\n  b|c: d\n", ("a",), "b", "c", True),
        ("a:\n  b: |\n", ("a", "b"), "", "", False),
        ("a:\n  b: c\n  |\n", ("a",), "", "", True),
        ("a:\n  b: c\n  d|\nx: y\n", ("a",), "d", "", True),
        ("a:\n  b: c\n|", (), "", "", True),
        ("a:\n  |", ("a",), "", "", True),
        ("a: {b: c, d|}\n", ("a",), "d", "", True),
        ("a: {b: c, |\nx: y\n", ("a",), "", "", True),
        ("a: [b, c|]\n", ("a", 1), "c", "", False),
        ("a: [b, |\nx: y\n", ("a", 1), "", "", False),
        ("a:\n  - b: c\n    |\n", ("a", 0), "", "", True),
        ("a:\n  - b\n  - |\n", ("a", 1), "", "", True),
        ('a: "b $c|"\n', ("a",), "b $c", "", False),
        ('a: "b # c|"\n', ("a",), "b # c", "", False),
        ("a: 'b # c|'\n", ("a",), "b # c", "", False),
        ("a: {b: 'it''s # c|'}\n", ("a", "b"), "it's # c", "", False),
        ("a: |-\n  # b\n  # c|\nb: d\n".replace("|-", ">-", 1), ("a",), "# b # c", "", False),
        ("a: $b < 5| and $c\n", ("a",), "$b < 5", " and $c", False),
        ("a:\n  b: |\nx: [unclosed\n", ("a", "b"), "", "", False),  # what follows is wrong
        ("|", (), "", "", True),
    ],
)
def test_a_position_is_found_in_finished_and_in_unfinished_text(
    text: str, path: tuple[str | int, ...], before: str, after: str, is_key: bool
) -> None:
    found = at(text)
    assert found is not None
    assert (found.path, found.before, found.after, found.is_key) == (path, before, after, is_key)
    assert MARK not in str(found.root)


@pytest.mark.parametrize(
    "text", ["a: b  # c|\n", "a: it's  # c|\n", "a: 'b'  # c 'd|\n", "# |\na: b\n", "a: [\n  }\nb: |\n", "x\ny: |"]
)
def test_in_comments_and_behind_what_cannot_be_read_there_is_nothing(text: str) -> None:
    assert at(text) is None


def test_a_first_key_of_an_item_may_become_a_word() -> None:
    item, key = at("a:\n  - b|\n"), at("a:\n  - b:\n    c|\n")
    assert item is not None
    assert key is not None
    assert item.begins_item
    assert not key.begins_item


@settings(max_examples=max(3, settings().max_examples // 2))
@given(st.sampled_from(list(TEXTS)), st.data())
def test_no_position_in_no_beginning_of_a_text_makes_trouble(path: object, data: st.DataObject) -> None:
    text = TEXTS[path]  # type: ignore[index]
    cut = data.draw(st.integers(0, len(text)))
    typed = data.draw(st.text("ab:-{}[]\"'$ \n#|>&*!?%@", max_size=3))
    place = text[:cut] + typed
    line, column = place.count("\n"), len(place.rpartition("\n")[2])
    for whole in (place, place + text[cut:]):
        complete(Document(ROBOT, whole), line, column)


def test_aliases_neither_repeat_the_work_nor_go_round_in_circles() -> None:
    layers = "".join(f"l{n}: &l{n} [{', '.join([f'*l{n - 1}'] * 9)}]\n" for n in range(1, 12))
    found = at(f"l0: &l0 [x]\n{layers}a: b|\n")
    assert found is not None
    assert found.path == ("a",)
    circle = at("a: &a\n  b: *a\n  c: |\n")
    assert circle is not None
    assert circle.path == ("a", "c")


def test_what_is_merged_counts_as_written() -> None:
    found = at("a: &a {type: x}\nb:\n  <<: *a\n  |\n")
    assert found is not None
    assert found.siblings == {"type"}


def test_of_a_large_manifest_only_what_is_near_is_read_with_the_same_answer() -> None:
    text = TEXTS[ROBOT]
    many = "".join(f"  p{number}: {{x: 1 m, y: 1 m}}\n" for number in range(400))
    large = text.replace("values:\n", f"{many}values:\n", 1)
    for number, written in enumerate(text.split("\n")):
        shift = 0 if number < text[: text.index("values:\n")].count("\n") else 400
        small_one, large_one = locate(text, number, len(written)), locate(large, number + shift, len(written))
        assert (small_one is None) == (large_one is None)
        if small_one is not None and large_one is not None:
            assert (small_one.path, small_one.text) == (large_one.path, large_one.text)
