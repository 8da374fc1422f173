"""Declared arguments: types, limits, choices, and what they say of a wrong value."""

from __future__ import annotations

from rbxcompose.base.findings import Finding, Report
from rbxcompose.base.units import SPEED, Quantity
from rbxcompose.manifest.arguments import read_argument
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import BROKEN, MappingNode
from rbxcompose.manifest.validate import to_plain
from tests.loops import for_all


def read(declaration: str) -> tuple[object, list[Finding]]:
    """Return the default of an argument, read by its declaration."""
    node, findings = read_text(declaration + "\n", "robot.yaml")
    assert node
    assert findings == []
    report = Report()
    argument = read_argument("it", node, ("args", "it"), report)
    value = argument.read(argument.default, report) if argument and argument.default else BROKEN
    return to_plain(value) if isinstance(value, MappingNode) else value, list(report)


VALUES = [
    ("{type: speed, default: 0.3 m/s, max: 0.5 m/s}", Quantity(0.3, SPEED)),
    ("{type: speed, default: 0.3}", Quantity(0.3, SPEED)),
    ("{type: count, default: 2, min: 1}", 2),
    ("{type: number, default: 2}", 2.0),
    ("{type: text, default: 7}", "7"),
    ("{type: flag, default: true}", True),
    ("{type: place, default: dock}", "dock"),
    ("{type: pose, default: {x: 1 m, y: 2 m}}", {"x": "1 m", "y": "2 m"}),
    ("{type: choice, choices: [fast, slow], default: slow}", "slow"),
    ("{type: map, default: {a: 1}}", {"a": 1}),
]


@for_all("declaration, value", VALUES)
def test_a_value_has_the_type_that_is_declared(declaration: str, value: object) -> None:
    read_value, findings = read(declaration)
    assert findings == []
    assert (read_value, type(read_value)) == (value, type(value))


MISTAKES = [
    ("{type: sped, default: 1}", "RBX1004", "there is no type 'sped'"),
    ("{default: 1}", "RBX1002", "argument 'it' needs the key 'type'"),
    ("{type: choice, default: a}", "RBX1002", "argument 'it' is a choice and needs 'choices'"),
    ("{type: choice, choices: [fast], default: slow}", "RBX1004", "'it' must be 'fast'"),
    ("{type: speed, default: 5 s}", "RBX1003", "'it' must be a speed, such as '0.3 m/s'"),
    ("{type: ratio, default: 0.5}", "RBX1003", "'it' must be a ratio"),
    ("{type: speed, default: 0.6 m/s, max: 0.5 m/s}", "RBX1005", "'it' must be at most 0.5 m/s"),
    ("{type: count, default: 0, min: 1}", "RBX1005", "'it' must be at least 1"),
    ("{type: count, default: -1}", "RBX1003", "'it' must be a whole number, not below 0"),
    ("{type: count, default: 1.5}", "RBX1003", "'it' must be a whole number, not below 0"),
    ("{type: flag, default: on}", "RBX1003", "'it' must be true or false"),
    ("{type: list, default: a}", "RBX1003", "'it' must be a list"),
    ("{type: text, default: [a]}", "RBX1003", "'it' must be a text"),
    ("{type: speed, default: 1 m/s, max: fast}", "RBX1003", "'max' must be a speed, such as '0.3 m/s'"),
    ("{type: text, default: a, max: 3}", "RBX1003", "'max' does not apply to a text"),
    ("{type: speed, defualt: 1 m/s}", "RBX1001", "unknown key 'defualt' in argument 'it'"),
]


@for_all("declaration, code, message", MISTAKES)
def test_a_wrong_declaration_or_value_is_one_finding(declaration: str, code: str, message: str) -> None:
    _, findings = read(declaration)
    assert [(finding.code, finding.message) for finding in findings] == [(code, message)]
