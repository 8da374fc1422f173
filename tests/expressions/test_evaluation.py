from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base.expressions.evaluate import evaluate, holds
from rbxcompose.base.expressions.parser import parse
from rbxcompose.base.expressions.tree import ExpressionError
from rbxcompose.base.expressions.values import NOT_ARRIVED, EvaluationError, NotArrived, NotArrivedError, Value
from tests.loops import for_all


@dataclass(frozen=True)
class Spot:
    """A place of the tests."""

    name: str
    x: float
    y: float
    heading: float = 0.0


@dataclass(frozen=True)
class Point:
    """A position without a name."""

    x: float
    y: float


PLACES = {place.name: place for place in (Spot("dock", 0.0, 0.0), Spot("living_room", 3.0, 4.0))}


@dataclass
class Known:
    """A scope that is a map; every name in `words` or of a place, else the word itself."""

    variables: Mapping[str, Value] = field(default_factory=dict)
    ages: Mapping[str, float] = field(default_factory=dict)
    asked: list[str] = field(default_factory=list)

    def variable(self, name: str) -> Value | NotArrived:
        self.asked.append(name)
        return self.variables[name]

    def word(self, name: str) -> Value:
        if name == "nowhere":
            raise KeyError(name)
        return PLACES.get(name, name)

    def age(self, name: str) -> float | NotArrived:
        return self.ages.get(name, NOT_ARRIVED)

    def is_new(self, name: str) -> bool:
        return name in self.ages


DATA: dict[str, Value] = {
    "battery": 0.25,
    "low": 0.3,
    "round": 2,
    "ok": True,
    "pose": Point(0.0, 1.0),
    "here": PLACES["dock"],
    "room": "living_room",
    "colour": "red",
    "rooms": ["dock", "living_room"],
    "chores": {"living_room": ["vacuum", "mop"], "dock": []},
    "result": {"done": [1.0, 2.0], "in": 1.0},
    "nan": math.nan,
    "inf": math.inf,
    "huge": 10**400,
    "long": list(range(1001)),
    "text": "x" * 4096,
    "missing": NOT_ARRIVED,
}
SCOPE = Known(DATA, {"battery": 0.5})


@for_all(
    "text, value",
    [
        ("1 + 2 * 3", 7.0),
        ("10 % * 5", 0.5),
        ("2 m / 4 s", 0.5),
        ("$round + 1", 3.0),
        ("-$battery", -0.25),
        ("$battery < $low", True),
        ("$battery >= 30 %", False),
        ("not $ok or 1 < 2", True),
        ("$room == living_room", True),
        ("living_room == $room", True),
        ("$here == dock", True),
        ("$here != 'dock'", False),
        ("$colour == red", True),
        ("$colour in [red, green]", True),
        ("$colour not in ['blue']", True),
        ("$room in $chores", True),
        ("$here in $chores", True),
        ("dock in $rooms", True),
        ("true == 1", False),
        ("$chores[$room][1]", "mop"),
        ("$chores[living_room][0]", "vacuum"),
        ("$result.done[$round - 1]", 2.0),
        ("$result.in", 1.0),
        ("count($chores)", 2.0),
        ("count($chores[dock])", 0.0),
        ("age($battery)", 0.5),
        ("new($battery) and not new($low)", True),
        ("distance($pose, dock)", 1.0),
        ("distance($room, $here)", 5.0),
        ("min(3, $round, 5)", 2.0),
        ("max($result.done)", 2.0),
        ("abs(-3 s)", 3.0),
        ("round(2.5)", 3.0),
        ("round(-2.5)", -3.0),
        ("round(0.49999999999999994)", 0.0),
        ("$inf > 1", True),
        ("'a' + 'b'", "ab"),
        ("count($rooms + [dock])", 3.0),
    ],
)
def test_an_expression_has_the_value_that_it_reads_as(text: str, value: Value) -> None:
    found = evaluate(parse(text), SCOPE)
    assert found == value
    assert type(found) is type(value)


def test_a_word_and_a_variable_give_the_thing_itself() -> None:
    assert evaluate(parse("dock"), SCOPE) is PLACES["dock"]
    assert evaluate(parse("$chores"), SCOPE) is DATA["chores"]


@for_all(
    "text, place",
    [
        ("1 / ($round - 2)", "$round - 2"),
        ("$result.undone", "$result.undone"),
        ("$result.done[2]", "2"),
        ("$result.done[-1]", "-1"),
        ("$result.done[0.5]", "0.5"),
        ("$battery.level", "$battery"),
        ("$here.name", "$here"),
        ("$room.upper", "$room"),
        ("$rooms.append", "$rooms"),
        ("$unknown", "$unknown"),
        ("nowhere", "nowhere"),
        ("$ok + 1", "$ok"),
        ("'a' + 1", "'a'"),
        ("'a' * 100", "'a'"),
        ("$rooms * 100", "$rooms"),
        ("1 < 'a'", "'a'"),
        ("1 and true", "1"),
        ("not 1", "1"),
        ("1 in 5", "5"),
        ("$nan < 1", "$nan"),
        ("not $nan == 1", "$nan"),
        ("$huge + 1", "$huge"),
        ("$inf", "$inf"),
        ("1e14 * 1e14", "1e14 * 1e14"),
        ("$inf - $inf", "$inf - $inf"),
        ("$text + 'x'", "$text + 'x'"),
        ("$long", "$long"),
        ("$long + $long", "$long + $long"),
        ("max($long)", "max($long)"),
        ("min($chores[dock])", "min($chores[dock])"),
        ("round(5, -10)", "round(5, -10)"),
        ("round(5, -1e9)", "round(5, -1e9)"),
        ("min()", "min()"),
        ("distance(dock, 5)", "distance(dock, 5)"),
        ("distance('nowhere', dock)", "'nowhere'"),
        ("age(5)", "5"),
        ("age($unknown.field)", "$unknown.field"),
        ("count(5)", "count(5)"),
        ("abs('a')", "abs('a')"),
        ("round($huge)", "round($huge)"),
        ("max($nan, 1)", "max($nan, 1)"),
    ],
)
def test_an_expression_without_a_value_says_where(text: str, place: str) -> None:
    with pytest.raises(EvaluationError) as caught:
        evaluate(parse(text), SCOPE)
    assert text[caught.value.start : caught.value.end] == place
    assert caught.value.message


def test_a_condition_is_true_or_false() -> None:
    assert holds(parse("$battery < $low"), SCOPE)
    with pytest.raises(EvaluationError, match="neither true nor false"):
        holds(parse("$battery"), SCOPE)


@pytest.mark.parametrize("text", ["$missing", "$missing + 1", "$ok and $missing == 1", "age($missing) < 1 s"])
def test_whatever_needs_a_value_that_has_not_arrived_fails(text: str) -> None:
    with pytest.raises(NotArrivedError) as caught:
        evaluate(parse(text), SCOPE)
    assert caught.value.name == "missing"


@for_all(
    "text, expected",
    [
        ("$missing < 1", False),
        ("not $missing < 1", False),
        ("not (not $missing < 1)", False),
        ("$missing < 1 or true", False),
        ("true or $missing < 1", True),
        ("not (false and $missing < 1)", True),
        ("not (true and $missing < 1)", False),
        ("age($missing) > 1 s", False),
        ("not age($missing) < 1 s", False),
        ("$missing in [1, 2]", False),
        ("$missing not in [1, 2]", False),
    ],
)
def test_a_condition_is_read_until_decided_and_does_not_hold_on_what_has_not_arrived(text: str, expected: bool) -> None:
    assert holds(parse(text), SCOPE) is expected


def test_nothing_is_read_behind_the_point_of_decision() -> None:
    scope = Known({"a": False, "b": True})
    assert not holds(parse("$a and $b"), scope)
    assert scope.asked == ["a"]


conditions = st.recursive(
    st.sampled_from(["true", "false", "$yes", "$no", "$missing"]),
    lambda inner: st.one_of(
        inner.map(lambda a: f"(not {a})"),
        st.tuples(inner, st.sampled_from(["and", "or"]), inner).map(lambda parts: f"({' '.join(parts)})"),
    ),
    max_leaves=12,
)
FLAGS: dict[str, Value] = {"yes": True, "no": False, "missing": NOT_ARRIVED}


@given(conditions)
def test_a_condition_and_its_denial_never_both_hold(text: str) -> None:
    scope = Known(FLAGS)
    both = [holds(parse(text), scope), holds(parse(f"not {text}"), scope)]
    assert both != [True, True]
    try:
        evaluate(parse(text), scope)
    except NotArrivedError:
        assert both == [False, False]
    else:
        assert sorted(both) == [False, True]


@given(conditions)
def test_a_condition_that_holds_still_holds_when_the_rest_arrives(text: str) -> None:
    if holds(parse(text), Known(FLAGS)):
        assert holds(parse(text), Known({**FLAGS, "missing": True}))
        assert holds(parse(text), Known({**FLAGS, "missing": False}))


@given(conditions)
def test_without_missing_values_a_condition_means_what_it_means_in_logic(text: str) -> None:
    python = text.replace("$yes", "True").replace("$no", "False").replace("true", "True").replace("false", "False")
    for arrived in (True, False):
        meant = eval(python.replace("$missing", str(arrived)))
        assert holds(parse(text), Known({**FLAGS, "missing": arrived})) is meant


atoms = st.sampled_from([f"${name}" for name in DATA] + ["1", "0", "30 %", "5 s", "dock", "red", "'a'", "true", "[]"])
operators = ["+", "-", "*", "/", "<", "<=", "==", "!=", "in", "not in", "and", "or"]
calls = st.sampled_from(["count", "age", "new", "distance", "min", "max", "abs", "round"])
expressions = st.recursive(
    atoms,
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from(operators), inner).map(lambda parts: f"({' '.join(parts)})"),
        st.tuples(st.sampled_from(["-", "not "]), inner).map(lambda parts: f"({''.join(parts)})"),
        st.tuples(calls, st.lists(inner, max_size=3)).map(lambda parts: f"{parts[0]}({', '.join(parts[1])})"),
        st.lists(inner, max_size=3).map(lambda parts: f"[{', '.join(parts)}]"),
        st.tuples(st.sampled_from(["$result", "$chores", "$rooms"]), inner).map(
            lambda parts: f"{parts[0]}[{parts[1]}]"
        ),
    ),
    max_leaves=15,
)


@given(expressions)
def test_any_expression_has_a_moderate_value_or_a_declared_error(text: str) -> None:
    try:
        value = evaluate(parse(text), SCOPE)
    except (ExpressionError, EvaluationError, NotArrivedError):
        return
    assert not isinstance(value, float) or abs(value) < 1e15
    assert not isinstance(value, str) or len(value) <= 4096
    assert not isinstance(value, list) or len(value) <= 1000


def grown(text: str, rounds: int) -> Value:
    value: Value = []
    for _ in range(rounds):
        value = evaluate(parse(text), Known({"x": value}))
    return value


@pytest.mark.parametrize(("text", "most"), [("[$x, $x]", 12), ("[$x]", 49)])
def test_a_list_that_grows_inwards_comes_to_an_end(text: str, most: int) -> None:
    assert grown(text, most)
    with pytest.raises(EvaluationError, match="more than"):
        grown(text, most + 1)
