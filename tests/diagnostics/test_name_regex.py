"""Promises of regular expressions for names."""

from __future__ import annotations

import pytest

from rbxcompose.domains.diagnostics.settings import fits_regex, trouble_of
from tests.loops import for_all


@pytest.mark.parametrize(
    "text", ["cam.*", "(front|rear)_cam", r"a\(b+\)", "[]+*]{2,3}", ".*cam.*rate.*", "(?:ab)+", "x{a"]
)
def test_an_expression_that_is_quick_on_any_name_is_taken(text: str) -> None:
    assert trouble_of(text) == ""


@for_all(
    "text, why",
    [
        ("cam[", "unterminated character set at position 3"),
        ("(a+)+", "repeats a group that holds a repeat"),
        ("(a|ab)*b", "repeats a group that holds a repeat or a choice"),
        ("((a*)b){2,}", "repeats a group"),
        (".*a.*b.*c.*", "more than 3 repeats"),
        (r"(a)\1", "refers back"),
        ("(?=a)a", "only '(?:...)' is taken"),
        ("(" * 200 + "a" + ")" * 101, "more than 300 characters"),
    ],
)
def test_one_that_is_none_or_that_could_take_long_is_refused_with_the_reason(text: str, why: str) -> None:
    assert why in trouble_of(text)


def test_the_whole_name_counts() -> None:
    assert fits_regex("cam.*", "camera")
    assert not fits_regex("cam.*", "webcam")
