"""What a scalar stands for: the core types of YAML 1.2."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.findings import Span
from rbxcompose.manifest.tree import ScalarNode, plain_value
from tests.loops import for_all

HERE = Span("f", 1, 1, 1, 2)
CORE = [
    ("", None),
    ("~", None),
    ("null", None),
    ("true", True),
    ("False", False),
    ("12", 12),
    ("-7", -7),
    ("010", 10),
    ("0o10", 8),
    ("0x1f", 31),
    ("1.5", 1.5),
    (".5", 0.5),
    ("1e3", 1000.0),
    ("on", "on"),
    ("yes", "yes"),
    ("no", "no"),
    ("12:30", "12:30"),
    ("1_000", "1_000"),
    ("2026-11-21", "2026-11-21"),
    ("0.3 m/s", "0.3 m/s"),
    (".inf", ".inf"),
    ("1e999", "1e999"),
    ("9" * 41, "9" * 41),
    ("-", "-"),
]


@for_all("text, value", CORE)
def test_a_plain_scalar_has_its_core_type(text: str, value: object) -> None:
    read = plain_value(ScalarNode(text, HERE))
    assert (read, type(read)) == (value, type(value))


@given(st.text(max_size=60))
def test_a_quoted_scalar_is_text(text: str) -> None:
    assert plain_value(ScalarNode(text, HERE, plain=False)) == text


@given(st.integers() | st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_is_read_as_it_is_written(number: float) -> None:
    assert len(repr(number)) > 40 or plain_value(ScalarNode(repr(number), HERE)) == number


@given(st.text(alphabet="0123456789+-.eExXoOabcdefinINF_: ", max_size=60))
def test_whatever_looks_like_a_number_is_read_without_a_failure(text: str) -> None:
    plain_value(ScalarNode(text, HERE))
