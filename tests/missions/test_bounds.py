"""What is known of a condition before it is asked agrees with what it is when it is asked."""

from __future__ import annotations

from dataclasses import dataclass

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.expressions.evaluate import holds
from rbxcompose.base.expressions.parser import parse
from rbxcompose.missions.analysis.facts import Bounds, truth
from tests.loops import for_all

KNOWN = {"a": Bounds(0.0, 1.0), "b": Bounds(-3.0, 3.0)}
TERMS = st.sampled_from(
    ["$a", "$b", "-2", "0", "0.5", "1", "4", "-$b", "$a + $b", "$a - 1", "$b * 2", "$a / 4", "abs($b)"]
)
COMPARED = st.builds("{} {} {}".format, TERMS, st.sampled_from(["<", "<=", ">", ">=", "==", "!="]), TERMS)
CONDITIONS = st.recursive(
    COMPARED,
    lambda inner: st.one_of(
        st.builds("({}) and ({})".format, inner, inner),
        st.builds("({}) or ({})".format, inner, inner),
        st.builds("not ({})".format, inner),
    ),
    max_leaves=4,
)


@dataclass(frozen=True, slots=True)
class Fixed:
    """A scope of two numbers."""

    a: float
    b: float

    def variable(self, name: str) -> float:
        return {"a": self.a, "b": self.b}[name]

    def word(self, name: str) -> object:
        raise KeyError(name)

    def age(self, name: str) -> float:
        raise KeyError(name)

    def is_new(self, name: str) -> bool:
        raise KeyError(name)


@given(CONDITIONS, st.floats(0, 1), st.floats(-3, 3))
def test_what_is_decided_beforehand_is_so_for_all_values(text: str, a: float, b: float) -> None:
    condition = parse(text)
    decided = truth(condition.tree, KNOWN)
    assert decided is None or decided is holds(condition, Fixed(a, b))


@for_all(
    "text, decided",
    [
        ("$a < 0", False),
        ("$a <= 0", None),
        ("$a >= 0", True),
        ("$a < 0.2 and $a > 0.8", False),
        ("$a < 0.8 or $a > 0.2", True),
        ("$a > 0.2 and $a < 0.8", None),
        ("not $a > 1", True),
        ("$b == 4", False),
        ("$b != 4", True),
        ("$unknown < 1", None),
        ("distance($x, $y) < 0", False),
        ("$b / $a < 4", None),
        ("true", True),
    ],
)
def test_it_is_decided_where_bounds_decide_it(text: str, decided: bool | None) -> None:
    assert truth(parse(text).tree, KNOWN) is decided
