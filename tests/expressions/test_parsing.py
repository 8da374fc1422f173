from __future__ import annotations

import math
from collections.abc import Iterable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base import units
from rbxcompose.base.expressions.parser import LEVELS, LONGEST, STEPS, parse, parse_fill
from rbxcompose.base.expressions.tree import (
    Arithmetic,
    Comparison,
    ExpressionError,
    ExpressionNode,
    FieldAccess,
    Index,
    Junction,
    Membership,
    Minus,
    Not,
    Number,
    Variable,
    Word,
    children,
    walk,
)
from tests.loops import for_all


def shape(node: ExpressionNode) -> str:
    """Write a tree with all its brackets."""
    below = [shape(child) for child in children(node)]
    match node:
        case Number(value=value):
            return f"{value:g}"
        case Variable(name=name):
            return f"${name}"
        case Word(name=name):
            return name
        case Minus():
            return f"(- {below[0]})"
        case Not():
            return f"(not {below[0]})"
        case Arithmetic(operator=operator) | Comparison(operator=operator) | Junction(operator=operator):
            return f"({f' {operator} '.join(below)})"
        case Membership():
            return f"({below[0]} in {below[1]})"
        case FieldAccess(name=name):
            return f"{below[0]}.{name}"
        case Index():
            return f"{below[0]}[{below[1]}]"
    return f"{type(node).__name__}({', '.join(below)})"


@for_all(
    "text, value, dimension",
    [
        ("30 %", 0.3, units.RATIO),
        ("30%", 0.3, units.RATIO),
        ("0.3 m/s", 0.3, units.SPEED),
        ("5s", 5.0, units.TIME),
        ("3 in", 0.0762, units.LENGTH),
        ("180 deg", math.pi, units.ANGLE),
        ("2 m/s^2", 2.0, units.ACCELERATION),
        ("1e3", 1000.0, units.NUMBER),
    ],
)
def test_a_number_takes_the_unit_behind_it(text: str, value: float, dimension: units.Dimension) -> None:
    number = parse(text).tree
    assert isinstance(number, Number)
    assert number.value == pytest.approx(value)
    assert (number.start, number.end, number.dimension) == (0, len(text), dimension)


@for_all(
    "text, expected",
    [
        ("1 + 2 * 3", "(1 + (2 * 3))"),
        ("1 - 2 - 3", "((1 - 2) - 3)"),
        ("(1 + 2) * 3", "((1 + 2) * 3)"),
        ("-$a * 2", "((- $a) * 2)"),
        ("1 - -2", "(1 - (- 2))"),
        ("not $a and $b or $c", "(((not $a) and $b) or $c)"),
        ("$a or $b and $c or $d", "($a or ($b and $c) or $d)"),
        ("not $a < 3", "(not ($a < 3))"),
        ("$a == not $b", "($a == (not $b))"),
        ("30 % < $x", "(0.3 < $x)"),
        ("6 m/$t", "(6 / $t)"),
        ("6 m/step", "(6 / step)"),
        ("6 m / 2 s", "(6 / 2)"),
        ("6 m/s/2", "(6 / 2)"),
        ("$x in [a, b]", "($x in Items(a, b))"),
        ("$x not in $list", "(not ($x in $list))"),
        ("3 in $list", "(3 in $list)"),
        ("3 in [1, 2]", "(3 in Items(1, 2))"),
        ("0 in in $list", "(0 in $list)"),
        ("$d < 0 in and $ok", "(($d < 0) and $ok)"),
        ("$data.field[0].other", "$data.field[0].other"),
        ("$chores[$room][1]", "$chores[$room][1]"),
        ("$a.b.c", "$a.b.c"),
        ("$result.in", "$result.in"),
        ("args.speed * 2", "(args.speed * 2)"),
        ("min(1, $a, 2)", "FunctionCall(1, $a, 2)"),
        ("count($a) == 0", "(FunctionCall($a) == 0)"),
        ("true == (false)", "(Flag() == Flag())"),
        ("'a b' + \"it's\"", "(Text() + Text())"),
        ("android or inner", "(android or inner)"),
    ],
)
def test_operators_bind_as_at_school(text: str, expected: str) -> None:
    assert shape(parse(text).tree) == expected


def test_the_inch_keeps_its_length() -> None:
    comparison = parse("$d < 12 in and $ok").tree
    number = next(node for node, _ in walk(comparison) if isinstance(node, Number))
    assert number.value == pytest.approx(0.3048)
    assert number.dimension == units.LENGTH


def test_an_expression_tells_its_names_words_and_calls_with_places() -> None:
    text = "age($scan) < 1 s and $data.field[$i] == red"
    read = parse(text)
    assert [(found.name, text[found.start : found.end]) for found in read.names] == [
        ("scan", "$scan"),
        ("data", "$data"),
        ("i", "$i"),
    ]
    assert [(found.name, text[found.start : found.end]) for found in read.words] == [("red", "red")]
    assert [(found.name, text[found.start : found.end]) for found in read.calls] == [("age", "age")]


@for_all(
    "text, place, part_of_message_or_help",
    [
        ("", "", "a value is missing at the end"),
        ("$a <", "", "a value is missing at the end"),
        ("$a + * 2", "*", "a value is missing before '*'"),
        ("()", ")", "a value is missing before ')'"),
        ("($a", "(", "'(' is not closed"),
        ("$a)", ")", "does not belong here"),
        ("$a $b", "$b", "an operator is missing"),
        ("1 < $a < 3", "<", "write 'a < b and b < c'"),
        ("5 parsecs", "parsecs", "unknown unit"),
        ("5 hz", "hz", "did you mean 'Hz'?"),
        ("1_000", "_000", "unknown unit"),
        ("$a % 2", "%", "there is no remainder"),
        ("$a ** 2", "**", "there is no power"),
        ("$a ^ 2", "^", "there is no power"),
        ("$a // 2", "//", "round"),
        ("$a = 2", "=", "write '=='"),
        ("$a => 2", "=>", "write '>='"),
        ("$a =< 2", "=<", "write '<='"),
        ("$a && $b", "&&", "write 'and'"),
        ("!$a", "!", "write 'not'"),
        ("$a is red", "is", "write '=='"),
        ("$a == True", "True", "write 'true'"),
        ("'abc", "'", "not closed"),
        ("$", "$", "a name follows"),
        ("$ a", "$", "a name follows"),
        ("${args.low}", "${", "write '$name'"),
        ("$a < ${args.low}", "${", "write '$name'"),
        ("floor($a)", "floor", "unknown function"),
        ("cuont($a)", "cuont", "did you mean 'count'?"),
        ("$a.", ".", "a field's name is missing"),
        ("$a[1", "[", "'[' is not closed"),
        ("'a'.upper", ".", "does not belong here"),
        ("__class__", "_", "names start with a letter"),
        ("__import__('os')", "_", "names start with a letter"),
        ("$a.__class__", "_", "names start with a letter"),
        ("args.__class__", "_", "names start with a letter"),
        ("().__class__", ")", "a value is missing"),
        ("lambda x: x", "lambda", "the functions are"),
        ("[x for x in $y]", "for", "an operator is missing"),
        ("{1: 2}", "{", "a map cannot be written here"),
        ("1e308 * 10", "1e308", "below 1e15"),
        ("9" * 41, "9" * 41, "40 characters"),
    ],
)
def test_a_mistake_has_a_place_and_a_fix(text: str, place: str, part_of_message_or_help: str) -> None:
    with pytest.raises(ExpressionError) as caught:
        parse(text)
    error = caught.value
    assert text[error.start : error.end].strip() == place
    assert part_of_message_or_help in f"{error.message} {error.help}"


def test_a_dollar_has_no_place_in_what_is_filled_in_before() -> None:
    with pytest.raises(ExpressionError, match="known only while the robot runs") as caught:
        parse_fill("args.speed * $battery")
    assert "without '$'" in caught.value.help
    assert shape(parse_fill("args.speed * 2").tree) == "(args.speed * 2)"


@for_all(
    "text",
    [
        "x" * (LONGEST + 1),
        " " * 2000,
        "(" * 51 + "1" + ")" * 51,
        "(" * 500,
        "[" * 500,
        "-" * 500 + "1",
        "not " * 200 + "true",
        "+".join(["1"] * 60),
        "$a" + "[0]" * 60,
        "$a" + ".b" * 60,
        "abs(" * 60 + "1" + ")" * 60,
        "1 or 1 and 1<1+1*(" * 50,
        "[" + ",".join(["1"] * (STEPS - 1)) + ",1]",
    ],
)
def test_what_exceeds_a_limit_is_refused(text: str) -> None:
    with pytest.raises(ExpressionError):
        parse(text)


def test_what_stays_within_the_limits_is_read() -> None:
    parse("(" * (LEVELS - 1) + "1" + ")" * (LEVELS - 1))
    parse(" or ".join(["$a"] * 150))
    parse("x" * LONGEST)


def refused_or_read(text: str) -> Iterable[tuple[int, int]]:
    """Return the places of the mistake or of all nodes."""
    try:
        tree = parse(text).tree
    except ExpressionError as error:
        return [(error.start, error.end)]
    return [(node.start, node.end) for node, _ in walk(tree)]


@given(st.text(max_size=60))
def test_any_text_is_read_or_refused_with_a_place(text: str) -> None:
    assert all(0 <= start <= end <= len(text) for start, end in refused_or_read(text))


PIECES = ["$a", "b", "1", "30 %", "3 in", "in", "not", "and", "or", "(", ")", "[", "]", ",", ".", "-", "+", "*", "/"]
PIECES += ["<", "==", "'x'", "min", "age", "true", "$", "_", "{", "5 s", "m/s"]


@given(st.lists(st.sampled_from(PIECES), max_size=40), st.sampled_from(["", " "]))
def test_any_heap_of_tokens_is_read_or_refused_with_a_place(pieces: list[str], glue: str) -> None:
    text = glue.join(pieces)
    assert all(0 <= start <= end <= len(text) for start, end in refused_or_read(text))
