from __future__ import annotations

from collections.abc import Iterable

from hypothesis import given
from hypothesis import strategies as st

from rbxcompose.base import units
from rbxcompose.base.expressions.check import ExpressionProblem, check, check_condition, check_value
from rbxcompose.base.expressions.parser import parse
from rbxcompose.base.expressions.tree import ExpressionError
from rbxcompose.base.expressions.types import (
    COUNT,
    FLAG,
    PLACE,
    POSE,
    TEXT,
    TYPES,
    UNKNOWN,
    Type,
    accepts,
    choice_of,
    common,
    list_of,
    list_with,
    map_of,
    map_with,
    quantity_of,
)
from tests.loops import for_all

RATIO, TIME, SPEED, NUMBER = (
    quantity_of(dimension) for dimension in (units.RATIO, units.TIME, units.SPEED, units.NUMBER)
)
LENGTH, ANGLE = quantity_of(units.LENGTH), quantity_of(units.ANGLE)


class Names:
    """The scope of the tests."""

    known = {
        "battery": RATIO,
        "low": RATIO,
        "wait": TIME,
        "speed": SPEED,
        "turn": ANGLE,
        "scan": LENGTH,
        "n": NUMBER,
        "round": COUNT,
        "ok": FLAG,
        "name": TEXT,
        "pose": POSE,
        "here": PLACE,
        "work": choice_of("success", "failure"),
        "colour": choice_of("red", "green"),
        "rooms": list_of(PLACE),
        "times": list_of(TIME),
        "chores": map_of(list_of(TEXT)),
        "mixed": list_with([LENGTH, TIME]),
        "stop": map_with({"to": TEXT, "stay": TIME}),
        "stops": list_with([map_with({"to": TEXT, "stay": TIME}), map_with({"to": TEXT, "far": LENGTH})]),
        "anything": UNKNOWN,
    }
    named = {"dock": PLACE, "kitchen": PLACE, "args.speed": SPEED}

    def variable(self, name: str) -> Type | None:
        return self.known.get(name)

    def word(self, name: str) -> Type | None:
        return self.named.get(name)

    def variables(self) -> Iterable[str]:
        return self.known

    def words(self) -> Iterable[str]:
        return self.named


def problems(text: str) -> list[ExpressionProblem]:
    return check(parse(text), Names())[1]


@for_all(
    "text, expected",
    [
        ("$battery", RATIO),
        ("2", COUNT),
        ("2.5", NUMBER),
        ("$round + 1", COUNT),
        ("$round * 2.5", NUMBER),
        ("$battery * 2", RATIO),
        ("2 * $battery", RATIO),
        ("$speed * $wait", LENGTH),
        ("$scan / $wait", SPEED),
        ("$scan + 5", LENGTH),
        ("-$scan", LENGTH),
        ("abs($turn - 90 deg)", ANGLE),
        ("age($scan)", TIME),
        ("new($scan)", FLAG),
        ("distance($pose, dock)", LENGTH),
        ("distance($pose, $name)", LENGTH),
        ("count($rooms)", COUNT),
        ("round($battery / 1 %)", COUNT),
        ("min($times)", TIME),
        ("min($wait, 5 s, 3)", TIME),
        ("args.speed", SPEED),
        ("dock", PLACE),
        ("$rooms[0]", PLACE),
        ("$chores[$here]", list_of(TEXT)),
        ("$chores[dock][$round - 1]", TEXT),
        ("$chores.dock", list_of(TEXT)),
        ("$anything.field[2] + 1", UNKNOWN),
        ("'a' + $name", TEXT),
        ("$rooms + [dock]", list_of(PLACE)),
        ("[]", list_of(UNKNOWN)),
        ("$mixed[1]", TIME),
        ("$mixed[$round]", common([LENGTH, TIME])),
        ("$stop.stay", TIME),
        ("$stop[dock]", UNKNOWN),  # it may get entries
        ("$stop[$name]", common([TEXT, TIME])),
        ("$stops[$round].to", TEXT),
        ("$stops[$round].far", LENGTH),
        ("[2, 2.5]", list_of(NUMBER)),
        ("['hall', dock]", list_of(PLACE)),
        ("$times + [5 m]", list_of(common([TIME, LENGTH]))),
        ("$battery < $low and not $ok", FLAG),
        ("$count == 1 or $ok", FLAG),
    ],
)
def test_an_expression_has_a_type_before_it_has_a_value(text: str, expected: Type) -> None:
    found, wrong = check(parse(text), Names())
    assert found == expected
    assert not wrong or "$count" in text


@for_all(
    "text",
    [
        "$battery < 30 %",
        "$scan > 0",
        "$speed < args.speed * 2",
        "$scan / 2 m < 50 %",
        "count($rooms) / 4 < 50 %",
        "$scan / 2 m < 0.5",
        "$work == success",
        "success == $work",
        "$work in [success, failure]",
        "$colour != 'red'",
        "$here == dock",
        "$name == dock",
        "$name == 'dock'",
        "dock in $rooms",
        "$here in [dock, kitchen]",
        "$name in $chores",
        "$wait in $times",
        "$mixed[1] < 5 s",
        "5 s in $times",
        "$anything == 5 s",
        "age($scan) > 5",
        "1 / 5 s < 3 Hz",
    ],
)
def test_a_sound_condition_has_no_problems(text: str) -> None:
    assert check_condition(parse(text), Names()) == []


@for_all(
    "text, place, message, fix",
    [
        ("$batery < 3 %", "$batery", "unknown name '$batery'", "did you mean '$battery'?"),
        ("$dock == kitchen", "$dock", "unknown name '$dock'", "write 'dock' without '$'"),
        ("$here == dok", "dok", "unknown name 'dok'", "did you mean 'dock'?"),
        ("$name == bob", "bob", "unknown name 'bob'", "a text needs quotes: write '\"bob\"'"),
        ("battery < 30 %", "battery", "unknown name 'battery'", "write '$battery'"),
        ("$work == sucess", "sucess", "'sucess' is none of success, failure", "did you mean 'success'?"),
        ("$colour == 'gren'", "'gren'", "unknown choice 'gren'", "did you mean 'green'?"),
        ("$colour in [red, gren]", "gren", "'gren' is none of red, green", "did you mean 'green'?"),
        ("$battery < 30 s", "$battery < 30 s", "a ratio is compared with a time", "units of a ratio: %"),
        ("$battery < 30", "$battery < 30", "a ratio is compared with a bare number", "write '30 %'"),
        ("0.3 > $battery", "0.3 > $battery", "a ratio is compared with a bare number", "write '30 %'"),
        ("$battery + 1 < $low", "$battery + 1", "a ratio is added to a bare number", "write '1 %'"),
        ("$battery < $n", "$battery < $n", "a ratio is compared with a number", "give 'n' a unit"),
        ("$turn < 45", "$turn < 45", "an angle is compared with a bare number", "write '45 deg' or '45 rad'"),
        ("$turn < -45", "$turn < -45", "an angle is compared with a bare number", "write '-45 deg' or '-45 rad'"),
        ("$speed - $wait > 0", "$speed - $wait", "a speed is reduced by a time", ""),
        (
            "$speed * $wait < 5 s",
            "$speed * $wait < 5 s",
            "a length is compared with a time",
            "units of a length: m, cm, mm, km, in",
        ),
        ("$here == 5 s", "$here == 5 s", "a place is compared with a time", ""),
        ("$pose == dock", "$pose == dock", "a pose is compared with a place", "write 'distance(a, b) < 10 cm'"),
        ("$work == dock", "$work == dock", "a choice is compared with a place", ""),
        ("$name < 'a'", "$name", "this must be a number; it is a text", ""),
        ("$ok + 1 < 2", "$ok", "this must be a number; it is a flag", ""),
        ("$mixed[0] > $mixed[1]", "$mixed[0] > $mixed[1]", "a length is compared with a time", ""),
        ("$mixed[$round] > 1 m", "$mixed[$round]", "this must be one quantity; it is a length or a time", ""),
        ("$mixed[$round] == 1 m", "$mixed[$round] == 1 m", "a length or a time is compared with a length", ""),
        ("$mixed[5 m] == 1 m", "5 m", "an item of a list is found by a number; this is a length", ""),
        ("5 s in $rooms", "5 s in $rooms", "a time is compared with a place", ""),
        ("$ok in $chores", "$ok", "a map holds names; this is a flag", ""),
        ("1 in $n", "$n", "'in' needs a list or a map; this is a number", ""),
        ("$rooms[dock] == dock", "dock", "an item of a list is found by a number; this is a place", ""),
        ("$chores[1] == $rooms", "1", "an entry of a map is found by a name; this is a count", ""),
        ("$here.x > 1 m", "$here.x", "a place has no fields", ""),
        ("$here[0] > 1 m", "$here[0]", "a place has no items", ""),
        ("age() > 1 s", "age()", "age() takes 1 argument, not 0", ""),
        ("distance(dock) < 1 m", "distance(dock)", "distance() takes 2 arguments, not 1", ""),
        ("min() < 1", "min()", "min() takes at least 1 argument, not 0", ""),
        ("round(5, -10) > 1", "round(5, -10)", "round() takes 1 argument, not 2", ""),
        ("age(5) > 1 s", "5", "age() needs a name with '$'", "such as age($scan)"),
        ("distance($pose, 5 m) < 1 m", "5 m", "this must be a pose; it is a length", ""),
        ("count($n) > 1", "$n", "count() needs a list or a map; this is a number", ""),
        ("round($scan) > 1", "$scan", "round() needs a number without a unit; this is a length", "divide by a unit"),
        ("min($wait, $speed) > 1", "min($wait, $speed)", "a time is compared with a speed", ""),
        ("min($wait) > 1", "$wait", "min() needs several values or a list; this is a time", ""),
        ("max($rooms) > 1", "$rooms", "this must be a number; it is a place", ""),
        ("$ok and $battery", "$battery", "this must be true or false; it is a ratio", ""),
        ("not $work", "$work", "this must be true or false; it is one of success, failure", ""),
        ("$work", "$work", "this must be true or false; it is one of success, failure", ""),
    ],
)
def test_a_mistake_is_told_once_with_its_place_and_a_fix(text: str, place: str, message: str, fix: str) -> None:
    (found,) = check_condition(parse(text), Names())
    assert text[found.start : found.end] == place
    assert found.message == message
    assert found.help.startswith(fix)
    assert bool(found.help) == bool(fix)


def test_all_mistakes_are_told_by_place() -> None:
    found = problems("$a < 1 and $battery < 5 s and $b")
    assert [problem.start for problem in found] == [0, 11, 30]


@for_all(
    "text, expected, message",
    [
        ("5", SPEED, None),
        ("-5", SPEED, None),
        ("5 s", SPEED, "this must be a speed; it is a time"),
        ("90", ANGLE, "this must be an angle; the unit is missing"),
        ("$n", SPEED, "this must be a speed; it is a number"),
        ("$round", COUNT, None),
        ("$round / 2", COUNT, "this must be a count; it is a quotient"),
        ("round($round / 2)", COUNT, None),
        ("$round / 4", RATIO, None),
        ("dock", POSE, None),
        ("$name", PLACE, None),
        ("$pose", PLACE, "this must be a place; it is a pose"),
        ("red", choice_of("red", "green"), None),
        ("$colour", choice_of("red"), "this must be one of red; it is one of red, green"),
        ("[dock, $here]", list_of(PLACE), None),
        ("[2.5]", list_of(COUNT), None),  # '[0]' does not say that they stay whole
        ("[dock]", list_of(TEXT), None),
        ("[5 s, 1 m]", list_of(common([TIME, LENGTH])), None),
        ("[5 s, 1 m]", list_of(TIME), "this must be a list, each a time; it is a list, each a time or a length"),
        (
            "$stop",
            map_with({"stay": TEXT}),
            "this must be a map, each a text; it is a map with to: a text, stay: a time",
        ),
        ("[5 s]", list_of(PLACE), "this must be a list, each a place; it is a list, each a time"),
    ],
)
def test_a_value_must_fit_where_it_stands(text: str, expected: Type, message: str | None) -> None:
    found = check_value(parse(text), Names(), expected)
    assert [problem.message for problem in found] == ([] if message is None else [message])


def test_every_type_accepts_itself() -> None:
    assert all(accepts(found, found) for found in TYPES.values())


atoms = st.sampled_from([f"${name}" for name in [*Names.known, "nothing"]] + ["1", "30 %", "5 s", "dock", "red", "'a'"])
operators = ["+", "-", "*", "/", "<", "==", "in", "not in", "and", "or"]
calls = st.sampled_from(["count", "age", "new", "distance", "min", "max", "abs", "round"])
expressions = st.recursive(
    atoms,
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from(operators), inner).map(lambda parts: f"({' '.join(parts)})"),
        st.tuples(st.sampled_from(["-", "not "]), inner).map(lambda parts: f"({''.join(parts)})"),
        st.tuples(calls, st.lists(inner, max_size=3)).map(lambda parts: f"{parts[0]}({', '.join(parts[1])})"),
        st.lists(inner, max_size=3).map(lambda parts: f"[{', '.join(parts)}]"),
        st.tuples(st.sampled_from(["$chores", "$rooms"]), inner).map(lambda parts: f"{parts[0]}[{parts[1]}]"),
    ),
    max_leaves=15,
)


@given(expressions)
def test_any_expression_can_be_checked(text: str) -> None:
    try:
        read = parse(text)
    except ExpressionError:
        return
    for problem in check_condition(read, Names()):
        assert 0 <= problem.start < problem.end <= len(text)
        assert problem.message
