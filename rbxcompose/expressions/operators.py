"""The operators of the expression language, from the weakest to the strongest binding."""

from __future__ import annotations

from collections.abc import Sequence

from rbxcompose.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Operator:
    """Operators that bind equally; with `is_prefix`, they come before their only operand."""

    symbols: tuple[str, ...]
    about: str
    example: str
    is_prefix: bool = False


OPERATORS: Sequence[Operator] = (
    Operator(("or",), "One of two conditions; the second is evaluated only if the first does not hold.", "$a or $b"),
    Operator(("and",), "Both conditions; the second is evaluated only if the first holds.", "$a and $b"),
    Operator(("not",), "The opposite of a condition.", "not $is_open", is_prefix=True),
    Operator(
        ("<", "<=", ">", ">=", "==", "!=", "in", "not in"),
        "Comparisons of values of one dimension; no chains. `in` looks for an item of a list or a key of a map.",
        "$battery < 30 %",
    ),
    Operator(
        ("+", "-"), "Sum and difference of values of one dimension; `+` also joins texts and lists.", "$timeout + 5 s"
    ),
    Operator(("*", "/"), "Product and quotient; the dimensions are computed too.", "2 * 0.3 m/s"),
    Operator(("-",), "The negative of a number or quantity.", "-$offset", is_prefix=True),
)
