"""Fixes change what they name and nothing else."""

from __future__ import annotations

import difflib

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.findings import Edit, Finding, Fix, Span, apply_fixes, exact_fix, replacement, safe_fixes

TEXTS = st.text(st.sampled_from("ab:漢é \n"), max_size=60)


def span(line: int, column: int, length: int, file: str = "f") -> Span:
    return Span(file, line, column, line, column + length)


def fixed(text: str, *fixes: Fix) -> str:
    return apply_fixes(fixes, {"f": text}).texts["f"]


def span_at(text: str, start: int, end: int) -> Span:
    lines = text[:start].split("\n"), text[:end].split("\n")
    (line, column), (end_line, end_column) = [(len(one), len(one[-1]) + 1) for one in lines]
    return Span("f", line, column, end_line, end_column)


@st.composite
def edited(draw: st.DrawFn) -> tuple[str, int, int, str]:
    text = draw(TEXTS)
    start = draw(st.integers(0, len(text)))
    return text, start, draw(st.integers(start, len(text))), draw(TEXTS)


@given(edited(), st.booleans(), st.booleans())
def test_everything_outside_of_an_edit_stays_byte_for_byte(
    case: tuple[str, int, int, str], has_mark: bool, is_windows: bool
) -> None:
    text, start, end, new = case
    ends, mark = ("\r\n" if is_windows else "\n"), ("\ufeff" if has_mark else "")
    raw, before, after = (mark + text).replace("\n", ends), mark + text[:start], text[end:]
    fix = Fix((Edit(span_at(text, start, end), text[start:end], new),), True, "t")
    assert fixed(raw, fix) == (
        raw if new == text[start:end] else before.replace("\n", ends) + new + after.replace("\n", ends)
    )


@given(TEXTS, st.lists(st.tuples(st.integers(0, 60), st.integers(0, 5)), max_size=8))
def test_edits_of_one_run_never_meet(text: str, places: list[tuple[int, int]]) -> None:
    ranges = [(min(start, len(text)), min(start + length, len(text))) for start, length in places]
    fixes = [
        Fix((Edit(span_at(text, start, end), text[start:end], f"<{number}>"),), True, str(number))
        for number, (start, end) in enumerate(ranges)
    ]
    out = apply_fixes(fixes, {"f": text})
    assert len(out.done) + len(out.postponed) == len(fixes)
    kept = out.texts["f"]
    for fix in out.done:
        assert kept.count(fix.edits[0].text) == 1
    removed = sum(len(fix.edits[0].old) for fix in out.done)
    assert len(kept) == len(text) - removed + sum(len(fix.edits[0].text) for fix in out.done)


@given(TEXTS, st.integers(-2, 9), st.integers(-2, 9), st.integers(-2, 9), st.integers(-2, 9))
def test_a_place_outside_of_the_text_is_left_alone(text: str, line: int, column: int, end_line: int, end: int) -> None:
    fix = Fix((Edit(Span("f", line, column, end_line, end), "nothing like it", "x"),), True, "t")
    assert fixed(text, fix) == text


def test_a_fix_whose_text_is_not_there_changes_nothing() -> None:
    assert fixed("a: new", replacement(span(1, 4, 3), "old", "new")) == "a: new"


def test_a_value_in_quotes_is_changed_within_them() -> None:
    assert fixed("a: \"dok\" # 'dok'", replacement(span(1, 4, 5), "dok", "dock")) == "a: \"dock\" # 'dok'"
    assert fixed("a: 'dok'", replacement(span(1, 4, 5), "dok", "it's")) == "a: 'dok'"


def test_of_two_fixes_that_meet_the_first_is_applied_and_the_other_told() -> None:
    first, second = replacement(span(1, 1, 2), "ab", "x"), replacement(span(1, 2, 2), "bc", "y")
    out = apply_fixes([first, second, first], {"f": "abc"})
    assert (out.texts, out.done, out.postponed) == ({"f": "xc"}, [first], [second])


def test_a_fix_is_applied_whole_or_not_at_all() -> None:
    half = Fix((Edit(span(1, 1, 1), "a", "x"), Edit(span(2, 1, 1), "?", "y")), True, "t")
    other = Fix((Edit(span(1, 1, 1), "a", "x"), Edit(span(1, 1, 1, "elsewhere"), "a", "y")), True, "t")
    assert fixed("a\nb\n", half, other) == "a\nb\n"


def test_a_guard_changes_nothing_and_holds_the_rest_back() -> None:
    def dash(line: int) -> Fix:
        return Fix((Edit(span(1, 1, 2), "- ", "- "), Edit(span(line, 1, 2), "  ", "- ")), True, "t")

    assert fixed("- a\n  b\n  c\n", dash(2), dash(3)) == "- a\n- b\n- c\n"
    assert fixed("+ a\n  b\n", dash(2)) == "+ a\n  b\n"


def test_only_safe_fixes_that_fit_and_lie_in_files_count() -> None:
    good, risky = replacement(span(1, 1, 1), "a", "b"), replacement(span(1, 1, 1), "a", "c", is_safe=False)
    stale, virtual = replacement(span(1, 1, 1), "z", "b"), replacement(span(1, 1, 1, "--set"), "a", "b")
    found = [Finding("RBX0001", "x", fix=fix) for fix in (good, good, risky, stale, virtual, None)]
    assert safe_fixes(found, {"f": "a", "--set": "a"}) == [good]


def test_an_exact_fix_says_where_it_lands() -> None:
    moved = exact_fix(replacement(span(1, 4, 5), "dok", "dock"), {"f": "a: 'dok'"})
    assert moved
    assert moved.edits[0].span == span(1, 5, 3)
    assert exact_fix(replacement(span(1, 4, 5), "dok", "dock"), {"f": "a: other"}) is None
    assert exact_fix(None, {}) is None


def test_the_difference_is_the_line_that_was_wrong() -> None:
    text = "\ufeffa:  1   # one\r\nrestrat:   x\r\n\r\nb: 'ü'\r\n"
    new = fixed(text, replacement(span(2, 1, 7), "restrat", "restart"))
    lines = difflib.ndiff(text.splitlines(keepends=True), new.splitlines(keepends=True))
    assert [line for line in lines if line[0] in "+-"] == ["- restrat:   x\r\n", "+ restart:   x\r\n"]
