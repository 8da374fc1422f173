from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.expressions.text import fill, parse_template
from rbxcompose.base.expressions.tree import ExpressionError
from rbxcompose.base.expressions.values import NOT_ARRIVED, EvaluationError, NotArrived, NotArrivedError, Value
from rbxcompose.missions.engine.world import show
from tests.loops import for_all


class Place:
    """The living room of the tests."""

    name, x, y, heading = "living_room", 3.0, 4.0, 0.0


class Pose:
    """A pose without a name."""

    x, y = 1.25, -0.5


class Scope:
    """The scope of the tests."""

    known: dict[str, Value] = {
        "room": Place(),
        "pose": Pose(),
        "level": 1 / 3,
        "round": 2.0,
        "ok": True,
        "names": ["a", "b"],
        "result": {"count": 3.0, "in": "deep"},
        "missing": NOT_ARRIVED,
        "key": "count",
        "at": 1.0,
        "long": "x" * 3000,
    }

    def variable(self, name: str) -> Value | NotArrived:
        return self.known[name]

    def word(self, name: str) -> Value:
        return name

    def age(self, name: str) -> float | NotArrived:
        return 0.0

    def is_new(self, name: str) -> bool:
        return False


def written(name: str, value: Value) -> str:
    """As missions write what has no type."""
    return show(None, value)


@for_all(
    "text, filled",
    [
        ("I am at $room now", "I am at living room now"),
        ("I am at $room.", "I am at living room."),
        ("$round of $result.count.", "2 of 3."),
        ("$level", "0.333333"),
        ("at $pose", "at (1.25 m, -0.5 m)"),
        ("$names are $ok", "a, b are true"),
        ("$result", "count: 3, in: deep"),
        ("$result.in the end", "deep the end"),
        ("$names[1], $names[0]!", "b, a!"),
        ("$result[count] of $result['count'] of $result[$key]$names[$at]", "3 of 3 of 3b"),
        (
            "$names [1] $names[ 1] $names[-1] $names[1 $names[] $names[1.5]",
            "a, b [1] a, b[ 1] a, b[-1] a, b[1 a, b[] a, b[1.5]",
        ),
        ("it costs $5 or 5 $", "it costs $5 or 5 $"),
        ("$$room is $room", "$room is living room"),
        ("$$$room", "$living room"),
        ("a < b, '$round\" ${x} {y}", "a < b, '2\" ${x} {y}"),
        ("", ""),
    ],
)
def test_names_are_filled_in_and_the_rest_is_text(text: str, filled: str) -> None:
    assert fill(parse_template(text), Scope(), written) == filled


def test_a_template_tells_its_names_with_places() -> None:
    text = "$round of $result.count, $$no"
    names = parse_template(text).names
    assert [(found.name, text[found.start : found.end]) for found in names] == [
        ("round", "$round"),
        ("result", "$result"),
    ]


def test_the_caller_says_how_values_are_written() -> None:
    def show(name: str, value: Value) -> str:
        return f"<{name}={value}>"

    assert fill(parse_template("$result.count and $ok"), Scope(), show) == "<result.count=3.0> and <ok=True>"


def test_a_text_with_a_value_that_has_not_arrived_fails() -> None:
    with pytest.raises(NotArrivedError):
        fill(parse_template("now $missing"), Scope(), written)


@pytest.mark.parametrize("text", ["hello $nobody", "hello $round.name", "hello $room.name"])
def test_a_text_that_cannot_be_filled_says_where(text: str) -> None:
    with pytest.raises(EvaluationError) as caught:
        fill(parse_template(text), Scope(), written)
    assert text[caught.value.start : caught.value.end] == text.removeprefix("hello ")


def test_a_text_stays_within_its_limit() -> None:
    with pytest.raises(EvaluationError, match="4,096"):
        fill(parse_template("$long $long"), Scope(), written)


def test_a_path_of_too_many_fields_is_refused_at_its_place() -> None:
    with pytest.raises(ExpressionError) as caught:
        parse_template("hello $a" + ".b" * 60)
    assert caught.value.start == 6


@given(st.text(alphabet=st.sampled_from("$ab.{} 1_"), max_size=40))
def test_doubling_every_dollar_keeps_a_text_as_it_is(text: str) -> None:
    assert fill(parse_template(text.replace("$", "$$")), Scope(), written) == text


@given(st.text())
def test_any_text_is_a_template(text: str) -> None:
    parse_template(text)


def test_a_text_with_many_long_values_is_given_up_at_once() -> None:
    shown: list[str] = []

    def show(name: str, value: Value) -> str:
        shown.append(name)
        return "x" * 3000

    with pytest.raises(EvaluationError, match="4,096 characters"):
        fill(parse_template("$long " * 10_000), Scope(), show)
    assert len(shown) == 2
