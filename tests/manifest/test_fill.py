"""`${...}` is filled in with typed values; what cannot be is one finding inside the text."""

from __future__ import annotations

from rbxcompose.base.expressions.types import PLACE, TEXT, TYPES, UNKNOWN
from rbxcompose.base.findings import Finding, Report
from rbxcompose.base.units import LENGTH, SPEED, Quantity
from rbxcompose.manifest.fill import Names, Typed, fill, names_of, with_arguments
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import BROKEN, MappingNode, ScalarNode
from rbxcompose.manifest.validate import to_plain
from tests.loops import for_all


def read(text: str) -> MappingNode:
    node, findings = read_text(text + "\n", "robot.yaml")
    assert isinstance(node, MappingNode)
    assert findings == []
    return node


def names() -> Names:
    known = names_of("turtlebot", True, {"PORT": "/dev/ttyUSB1", "EMPTY": "", "BAUD": "115200"})
    corners = read("l: [a, b]").get("l")
    return with_arguments(
        known,
        {
            "speed": Typed(TYPES["speed"], Quantity(0.3, SPEED)),
            "rounds": Typed(TYPES["count"], 2),
            "home": Typed(PLACE, "dock"),
            "title": Typed(TEXT, "Ada"),
            "corners": Typed(TYPES["list"], corners),
            "wrong": Typed(UNKNOWN, BROKEN),
        },
    )


def filled(text: str, *, runs: bool = False) -> tuple[object, list[Finding]]:
    report = Report()
    tree = fill(read(f"x: {text}"), names(), report, runs=runs)
    data = to_plain(tree)
    assert isinstance(data, dict)
    return data["x"], list(report)


VALUES = [
    ("${args.speed}", Quantity(0.3, SPEED)),
    ("${ args.speed }", Quantity(0.3, SPEED)),
    ("${args.speed * 2}", Quantity(0.6, SPEED)),
    ("${args.speed * 2 s}", Quantity(0.6, LENGTH)),
    ("${args.rounds}", 2),
    ("${args.rounds + 1}", 3),
    ("${sim}", True),
    ("${not sim}", False),
    ("${robot.name}", "turtlebot"),
    ("${args.home}", "dock"),
    ("${args.corners}", ["a", "b"]),
    ("drives ${args.speed}, ${args.rounds} times, ${sim}", "drives 0.3 m/s, 2 times, true"),
    ('"${args.title} of ${robot.name}"', "Ada of turtlebot"),
    ("${env.PORT}", "/dev/ttyUSB1"),
    ("${env.BAUD}", 115200),
    ("${env.NONE:-/dev/ttyUSB0}", "/dev/ttyUSB0"),
    ("${env.EMPTY:-default}", "default"),
    ("${env.NONE:-}", None),
    ("a ${env.PORT} b", "a /dev/ttyUSB1 b"),
    ("costs $$5 and $ 5", "costs $5 and $ 5"),
    ("$${args.speed}", "${args.speed}"),
    ("costs $5", "costs $5"),
]


@for_all("text, value", VALUES)
def test_a_value_is_filled_in(text: str, value: object) -> None:
    data, findings = filled(text)
    assert findings == []
    assert (data, type(data)) == (value, type(value))


MISTAKES = [
    ("${args.sped}", "RBX1202", 6, "unknown name 'args.sped'", "did you mean 'args.speed'?"),
    ("${speed}", "RBX1202", 6, "unknown name 'speed'", "did you mean 'args.speed'?"),
    ("at ${robot.nam} now", "RBX1202", 9, "unknown name 'robot.nam'", "did you mean 'robot.name'?"),
    ("${1 + env.PORT}", "RBX1202", 10, "unknown name 'env.PORT'", "must stand alone"),
    ("${args.speed * }", "RBX1201", 19, "a value is missing at the end", ""),
    ("${}", "RBX1201", 6, "", ""),
    ("${args.speed", "RBX1201", 4, "this '${' is never closed", ""),
    ("${$speed}", "RBX1201", 6, "", ""),
    ("${args.speed + 1 s}", "RBX1203", 6, "", ""),
    ("${1 / 0}", "RBX1203", 10, "division by zero", ""),
    ("goes to ${args.corners}", "RBX1203", 12, "a list cannot be part of a text", ""),
    ("${env.NONE}", "RBX1204", 4, "the environment variable 'NONE' is not set", "${env.NONE:-DEFAULT}"),
    ("${env.EMPTY:?say why}", "RBX1204", 4, "the environment variable 'EMPTY' is not set", ""),
    ("$speed", "RBX1205", 4, "'$speed' is looked up while the robot runs", "write '${args.speed}'"),
    ("$battery", "RBX1205", 4, "'$battery' is looked up while the robot runs", "write '$$' for a dollar"),
]


@for_all("text, code, column, message, fix", MISTAKES)
def test_what_cannot_be_filled_in_is_one_finding(text: str, code: str, column: int, message: str, fix: str) -> None:
    data, findings = filled(text)
    assert data is BROKEN
    (finding,) = findings
    assert finding.span
    assert (finding.code, finding.span.column) == (code, column)
    assert finding.message.startswith(message)
    assert fix in finding.help


def test_why_a_variable_is_needed_stands_beside_the_caret() -> None:
    _, (finding,) = filled("${env.TOKEN:?the key of your console}")
    assert finding.label == "the key of your console"


def test_what_uses_a_broken_argument_is_broken_without_another_word() -> None:
    assert filled("${args.wrong}") == (BROKEN, [])
    assert filled("${args.wrong * 2}") == (BROKEN, [])


def test_in_a_mission_dollar_names_stay_for_later() -> None:
    assert filled("$battery < $low and ${sim}", runs=True) == ("$battery < $low and true", [])


def test_braces_round_what_is_known_only_later_are_a_finding_with_the_fix() -> None:
    _, (finding,) = filled("${battery} < 30 %", runs=True)
    assert (finding.code, finding.help) == ("RBX1202", "what is known while the robot runs is written '$battery'")


def test_a_part_of_an_escaped_text_is_shown_by_the_whole_text() -> None:
    _, (finding,) = filled('"\\"quoted\\" ${args.sped}"')
    assert finding.span
    assert (finding.span.column, finding.span.end_column) == (4, 29)


def test_what_holds_nothing_to_fill_in_stays_the_same_object() -> None:
    tree = read("a: {b: [1, x]}")
    assert fill(tree, names(), Report()) is tree


def test_a_filled_scalar_keeps_its_place_and_its_text() -> None:
    tree = fill(read("x: ${args.speed}"), names(), Report())
    value = tree.get("x")
    assert isinstance(value, ScalarNode)
    assert (value.text, str(value.span)) == ("${args.speed}", "robot.yaml:1:4")
