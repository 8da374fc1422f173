"""A tree against a model: one finding for each mistake, at its place, in plain words."""

from __future__ import annotations

from typing import Literal

import pytest
from pydantic import Field

from rbxcompose.base.config import PLACE, Angle, Config, Length, Name, Place, PlaceName, Ratio, Speed
from rbxcompose.base.findings import Finding, Report
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import BROKEN, MappingNode
from rbxcompose.manifest.validate import validate
from tests.loops import for_all


class Inner(Config):
    speed: Speed
    axis: Angle = 0.0


class Thing(Config):
    name: Name = "thing"
    max_speed: Speed = Field(0.5, gt=0)
    charge: Ratio = Field(1.0, ge=0, le=1)
    size: Length = 1.0
    mode: Literal["fast", "slow"] = "slow"
    is_open: bool = False
    count: int = Field(1, ge=0)
    factor: float = 1.0
    about: str = ""
    words: tuple[str, ...] = ()
    parts: dict[Name, Inner] = {}
    limits: list[Length] = []
    inner: Inner | None = None
    home: PlaceName | None = None


class Needy(Config):
    runtime: int
    warn: int = 0


PLACES = {PLACE: {"dock": Place("dock", 0.0, 0.0, 0.0)}}


def check(text: str, model: type[Config] = Thing) -> tuple[Config | None, list[Finding]]:
    node, findings = read_text(text + "\n", "robot.yaml")
    assert isinstance(node, MappingNode)
    assert findings == []
    report = Report()
    return validate(model, node, ("components", "it"), report, PLACES), list(report)


MISTAKES = [
    ("max_sped: 1 m/s", "RBX1001", 1, "unknown key 'max_sped' in component 'it'", "", "did you mean 'max_speed'?"),
    (
        "parts: {a: {speed: 1 m/s, axes: 1 rad}}",
        "RBX1001",
        27,
        "unknown key 'axes' in 'parts.a' of component 'it'",
        "",
        "did you mean 'axis'?",
    ),
    (f"parts: {{{'a' * 61}: {{speed: 1 m/s}}}}", "RBX1005", 9, f"'{'a' * 61}' must have at most 60 characters", "", ""),
    ("inner: {}", "RBX1002", 1, "'inner' of component 'it' needs the key 'speed'", "", ""),
    ("max_speed: fast", "RBX1003", 12, "'max_speed' must be a speed, such as '0.3 m/s'", "this is text", ""),
    ("max_speed: 5 s", "RBX1003", 12, "'max_speed' must be a speed, such as '0.3 m/s'", "this is a time", ""),
    ("max_speed: [1]", "RBX1003", 12, "'max_speed' must be a speed, such as '0.3 m/s'", "this is a list", ""),
    ("charge: 50", "RBX1003", 9, "'charge' must be a ratio", "the unit is missing", "write '50 %'"),
    (
        "max_speed: mps",
        "RBX1003",
        12,
        "'max_speed' must be a speed, such as '0.3 m/s'",
        "this is text",
        "write a number before 'm/s'",
    ),
    ("is_open: 60 deg", "RBX1003", 10, "'is_open' must be true or false", "this is an angle", ""),
    ("is_open: yes", "RBX1003", 10, "'is_open' must be true or false", "this is text", ""),
    ("count: two", "RBX1003", 8, "'count' must be a whole number", "this is text", ""),
    ("count: 1.5", "RBX1003", 8, "'count' must be a whole number", "this is a number", ""),
    ('count: "2"', "RBX1003", 8, "'count' must be a whole number", "this is text", ""),
    ("factor: x", "RBX1003", 9, "'factor' must be a number", "this is text", ""),
    ("about: [a]", "RBX1003", 8, "'about' must be text", "this is a list", ""),
    ("about:", "RBX1003", 7, "'about' must be text", "this is empty", ""),
    ("words: a", "RBX1003", 8, "'words' must be a list", "this is text", ""),
    ("parts: [a]", "RBX1003", 8, "'parts' must be a map of keys and values", "this is a list", ""),
    ("inner: fast", "RBX1003", 8, "'inner' must be a map of keys and values", "this is text", ""),
    ("limits: [1 m, x]", "RBX1003", 15, "'limits[1]' must be a length, such as '0.5 m'", "this is text", ""),
    ("mode: fats", "RBX1004", 7, "'mode' must be one of fast, slow", "", "did you mean 'fast'?"),
    ("home: dok", "RBX1004", 7, "'home': there is no place 'dok'", "", "did you mean 'dock'?"),
    ("max_speed: -1 m/s", "RBX1005", 12, "'max_speed' must be greater than 0 m/s", "", ""),
    ("charge: 150 %", "RBX1005", 9, "'charge' must be at most 100 %", "", ""),
    ("count: -1", "RBX1005", 8, "'count' must be at least 0", "", ""),
    ("name: Big-Thing", "RBX1006", 7, "'Big-Thing' is not a valid name", "", ""),
    ("parts: {Front: {speed: 1 m/s}}", "RBX1006", 9, "'Front' is not a valid name", "", ""),
]


@for_all("text, code, column, message, label, fix", MISTAKES)
def test_a_mistake_is_one_finding(text: str, code: str, column: int, message: str, label: str, fix: str) -> None:
    read, findings = check(text)
    assert read is None
    (finding,) = findings
    assert finding.span
    assert (finding.code, finding.span.column, finding.message) == (code, column, message)
    assert finding.label == label
    assert fix in finding.help


def test_what_is_right_is_read() -> None:
    read, findings = check("max_speed: 1 km/h\nwords: [a, 7]\nparts: {a: {speed: 1 m/s}}\nhome: dock\ncount: 2")
    assert findings == []
    assert read == Thing(
        max_speed=1 / 3.6, words=("a", "7"), parts={"a": Inner(speed=1.0)}, home=PLACES[PLACE]["dock"], count=2
    )


@pytest.mark.parametrize("written", ["7", "1.50", "true", "0x1f"])
def test_a_text_field_takes_its_scalar_as_it_is_written(written: str) -> None:
    read, findings = check(f"about: {written}")
    assert findings == []
    assert isinstance(read, Thing)
    assert read.about == written


def test_all_mistakes_are_found_in_one_run() -> None:
    _, findings = check("max_sped: 1\ncount: x\nmode: y\ncharge: 5 s")
    assert [finding.code for finding in findings] == ["RBX1001", "RBX1003", "RBX1004", "RBX1003"]


def test_a_misspelt_key_is_not_missing_as_well() -> None:
    _, findings = check("runtme: 5\nwarn: 3", Needy)
    assert [(finding.code, finding.help) for finding in findings] == [("RBX1001", "did you mean 'runtime'?")]


def test_a_missing_key_is_said_where_the_map_begins() -> None:
    _, findings = check("warn: 3", Needy)
    assert [(finding.message, str(finding.span)) for finding in findings] == [
        ("component 'it' needs the key 'runtime'", "robot.yaml:1:1")
    ]


def test_a_value_that_could_not_be_filled_in_is_not_spoken_of_again() -> None:
    node, _ = read_text("max_speed: ${x}\ncount: y\n", "robot.yaml")
    assert isinstance(node, MappingNode)
    entry = node.entries["max_speed"]
    object.__setattr__(entry.value, "filled", BROKEN)
    report = Report()
    assert validate(Thing, node, (), report) is None
    assert [finding.message for finding in report] == ["'count' must be a whole number"]


def test_keys_that_stand_beside_the_models_own_are_suggested() -> None:
    node, _ = read_text("restrat: never\n", "robot.yaml")
    assert node
    report = Report()
    validate(Thing, node, ("components", "gui"), report, also=["restart"])
    assert [(finding.message, finding.help) for finding in report] == [
        ("unknown key 'restrat' in component 'gui'", "did you mean 'restart'?")
    ]
