"""The `$names` of a mission and the `${...}` of other manifests that are visible at one place."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.expressions.types import UNKNOWN
from rbxcompose.findings import Span
from rbxcompose.lsp.document import Spot
from rbxcompose.manifest.tree import MappingNode, ScalarNode, at, key_span
from rbxcompose.missions.analysis.scope_types import base_names, views
from rbxcompose.missions.engine.condition_watches import POSE
from rbxcompose.missions.program.program import Program
from rbxcompose.references import ARGUMENT

_FILLS = {"robot.name": "name of the robot", "sim": "true in simulation", "env.": "an environment variable"}
_FILLS |= {"secret.": "a secret, from a file of its own or the environment; it is never shown"}


def fills(spot: Spot) -> dict[str, str]:
    """Return the names that `${...}` may use."""
    arguments = {f"args.{name}": about or "argument" for name, about in spot.known.of(ARGUMENT).items()}
    return {**arguments, **_FILLS}


def variables(spot: Spot) -> dict[str, str]:
    """Return the `$names` readable at a place of a mission, each with its type and origin."""
    root, robot = spot.cursor.root, spot.known.robot
    found = {POSE: "a pose, in `map`"}
    if robot is not None:
        for name, source in robot.values.items():
            found[name] = f"{source.type.phrase}, a value of the robot from {source.topic}"
    for section, one in (("inputs", "an input"), ("data", "a datum")):
        found |= {name: f"{phrase}, {one}" for name, phrase in _declared(spot, root, section)}
    return {**found, **{name: f"{phrase}, the item of a loop" for name, phrase in _items(spot)}}


def variable_span(spot: Spot, name: str) -> Span | None:
    """Return where a `$name` comes from; the file is empty for the text itself."""
    root, robot = spot.cursor.root, spot.known.robot
    for section in ("inputs", "data"):
        if at(root, (section, name)) is not None:
            return key_span(root, (section, name))
    for length in range(len(spot.cursor.path), -1, -1):
        word = at(root, (*spot.cursor.path[:length], "for"))
        if isinstance(word, ScalarNode) and word.text == name:
            return word.span
    if robot is not None and name in robot.manifest.values:
        return key_span(robot.manifest.root, ("values", name))
    return None


def _program(spot: Spot) -> Program | None:
    missions = spot.known.robot.missions.values() if spot.known.robot else ()
    path = spot.document.path
    entries = spot.known.robot.manifest.missions if spot.known.robot else {}
    return next((one.program for one in missions if entries[one.name].path == path), None)


def _declared(spot: Spot, root: MappingNode, section: str) -> Iterator[tuple[str, str]]:
    named, program = root.get(section), _program(spot)
    for name in named.entries if isinstance(named, MappingNode) else ():
        known = base_names(program, spot.known.robot.names).get(name) if program and spot.known.robot else None
        word = at(named, (name, "type")) if isinstance(named, MappingNode) else None
        yield name, known.phrase if known else word.text if isinstance(word, ScalarNode) else UNKNOWN.phrase


def _items(spot: Spot) -> Iterator[tuple[str, str]]:
    """Yield the items of the loops around a place, with their types if the mission could be read."""
    program, robot = _program(spot), spot.known.robot
    types = {}
    if program is not None and robot is not None:
        for view in views(program, robot.names):
            if view.node.parent is not None and (item := program.nodes[view.node.parent].item):
                types[item] = view.scope.names[item].phrase
    for length in range(len(spot.cursor.path) + 1):
        word = at(spot.cursor.root, (*spot.cursor.path[:length], "for"))
        if isinstance(word, ScalarNode):
            yield word.text, types.get(word.text, UNKNOWN.phrase)
