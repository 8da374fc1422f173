"""Giving values to the inputs of a mission."""

from __future__ import annotations

from rbxcompose.base.expressions.values import Value
from rbxcompose.base.findings import Finding
from rbxcompose.manifest.tree import MappingNode
from rbxcompose.missions.engine.inputs import bind_inputs
from rbxcompose.testing import compile_mission
from tests.loops import for_all
from tests.missions.simulated import PLACES, program_of, robot_with, tree

MISSION = """
inputs:
  rounds: {type: count, default: 2, max: 5}
  pause: {type: time, min: 1 s}
  home: {type: place, default: dock}
  mode: {type: choice, choices: [slow, fast], default: slow}
  words: {type: text, default: hello}
  stays: {type: list, default: [5 s]}
do: a
"""


def bound(text: str) -> tuple[dict[str, Value], list[Finding]]:
    """Return what `with:` of this text gives to the mission."""
    root = tree("with:" + text, "robot.yaml")
    given = root.get("with")
    entries = given.entries if isinstance(given, MappingNode) else {}
    return bind_inputs(program_of(MISSION), entries, PLACES, root.span)


def test_what_is_not_given_has_its_default_and_places_are_places() -> None:
    values, findings = bound("\n  pause: 2 s\n  words: 7")
    assert findings == []
    assert values == {"rounds": 2.0, "pause": 2.0, "home": PLACES["dock"], "mode": "slow", "words": "7", "stays": [5.0]}


@for_all(
    "given, message, help_text",
    [
        ("pause: 2 s\n  rounds: many", "the input 'rounds' must be a whole number, at least 0", ""),
        ("pause: 2 s\n  rounds: 6", "the input 'rounds' is above its 'max' of 5: 6", ""),
        ("pause: 0.5 s", "the input 'pause' is below its 'min' of 1 s: 0.5 s", ""),
        ("pause: 2 kg", "the input 'pause' must be a time, such as '5 s'", ""),
        ("pause: 2 m", "the input 'pause' must be a time, such as '5 s'", "if these are minutes, write '2 min'"),
        ("pause: 2 s\n  mode: fats", "the input 'mode' is not one of the choices: 'fats'", "did you mean 'fast'?"),
        ("pause: 2 s\n  home: dok", "there is no place 'dok'", "did you mean 'dock'?"),
        ("pause: 2 s\n  stays: [5 m]", "the input 'stays' must be a list, each a time", ""),
        ("pause: 2 s\n  round: 3", "the mission '' has no input 'round'", "did you mean 'rounds'?"),
        ("rounds: 3", "the input 'pause' of the mission '' needs a value", "write it under 'with': 'pause: ...'"),
    ],
)
def test_each_mistake_is_a_finding(given: str, message: str, help_text: str) -> None:
    _, findings = bound(f"\n  {given}")
    assert [(finding.message, finding.help) for finding in findings] == [(message, help_text)]


def test_a_mission_that_uses_it_is_held_to_the_types_of_its_defaults() -> None:
    robot = robot_with({"used": MISSION})
    (found,) = compile_mission("do: {use: used, with: {pause: 2 s, stays: [5 m]}}", robot)[1]
    assert (found.code, found.label) == ("RBX4113", "this is a list, each a length")
