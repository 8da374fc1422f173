"""Answers to an editor: hovers, definitions, outlines."""

from __future__ import annotations

import re
from collections.abc import Iterator

from rbxcompose.base.config import ARGUMENT, COMPONENT, FILE, PLACE, PORT, PREFIXED, RUNNING
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.types import POSE, TYPES, UNKNOWN, Type
from rbxcompose.base.findings import Span
from rbxcompose.base.units import Quantity, format_quantity
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.sections.composition import args
from rbxcompose.manifest import tree
from rbxcompose.manifest.documents import ManifestHeader
from rbxcompose.manifest.files import resolve, shown_name
from rbxcompose.manifest.registry import naming
from rbxcompose.manifest.section import EVERYWHERE
from rbxcompose.missions.analysis.examined import base_names, views
from rbxcompose.missions.engine.world import POSE as POSE_NAME
from rbxcompose.missions.language.grammar import Takes
from rbxcompose.missions.program.program import Program
from rbxcompose.missions.program.registry import keys_taking, kinds, modifier_keys
from rbxcompose.tools.lsp.document import SKILL, Document, Spot, below_profile, named_by_key, quick_tree
from rbxcompose.tools.lsp.project import MISSION, kind_of

_FILLS = {"robot.name": "name of the robot", "sim": "true in simulation", "env.": "an environment variable"}
_FILLS |= {"secret.": "a secret, from a file of its own or the environment; it is never shown"}
DEEPEST = 12  # levels of steps that an editor shows
_DETAIL = 60  # characters of a value
_BODIES = ("do", "machine", "interrupts")
_FRONT = re.compile(r"[A-Za-z0-9_.]*+(\s*+\{?\$)?+")  # read backwards from the position
_BACK = re.compile(r"[A-Za-z0-9_.]*")
_SERVING = ("serves_action", "serves", "serves_topic")  # kinds of ports that are skills


def fills(spot: Spot) -> dict[str, str]:
    """Return the names that `${...}` may use."""
    arguments = {f"args.{name}": about or "argument" for name, about in spot.known.of(ARGUMENT).items()}
    return {**arguments, **_FILLS}


def variables(spot: Spot) -> dict[str, str]:
    """Return the `$names` readable at a place of a mission, each with its type and origin in words."""
    return {name: f"{type_.phrase}, {origin}" for name, (type_, origin) in typed_variables(spot).items()}


def typed_variables(spot: Spot) -> dict[str, tuple[Type, str]]:
    """Return the `$names` readable at a place of a mission, each with its type, as last read, and its origin."""
    root, robot = spot.cursor.root, spot.known.robot
    found = {POSE_NAME: (POSE, "in `map`")}
    if robot is not None:
        for name, source in robot.values.items():
            found[name] = source.type, f"a value of the robot from {source.topic}"
    for section, text in (("inputs", "an input"), ("data", "a datum")):
        found |= {name: (type_, text) for name, type_ in _declared(spot, root, section)}
    return {**found, **{name: (type_, "the item of a loop") for name, type_ in _items(spot)}}


def variable_span(spot: Spot, name: str) -> Span | None:
    """Return where a `$name` comes from; the file is empty for the text itself."""
    root, robot = spot.cursor.root, spot.known.robot
    for section in ("inputs", "data"):
        if tree.at(root, (section, name)) is not None:
            return tree.key_span(root, (section, name))
    for length in range(len(spot.cursor.path), -1, -1):
        word = tree.at(root, (*spot.cursor.path[:length], "for"))
        if isinstance(word, tree.ScalarNode) and word.text == name:
            return word.span
    if robot is not None and name in robot.manifest.values:
        return tree.key_span(robot.manifest.root, ("values", name))
    return None


def _program(spot: Spot) -> Program | None:
    missions = spot.known.robot.missions.values() if spot.known.robot else ()
    path = spot.document.path
    entries = spot.known.robot.manifest.missions if spot.known.robot else {}
    return next((mission.program for mission in missions if entries[mission.name].path == path), None)


def _declared(spot: Spot, root: tree.MappingNode, section: str) -> Iterator[tuple[str, Type]]:
    program = _program(spot)
    for name, entry in tree.entries_of(root.get(section)).items():
        known = base_names(program, spot.known.robot.names).get(name) if program and spot.known.robot else None
        word = tree.at(entry.value, ("type",))
        yield name, known or TYPES.get(word.text if isinstance(word, tree.ScalarNode) else "", UNKNOWN)


def _items(spot: Spot) -> Iterator[tuple[str, Type]]:
    """Yield the items of the loops around a place, with their types if the mission could be read."""
    program, robot = _program(spot), spot.known.robot
    types = {}
    if program is not None and robot is not None:
        for view in views(program, robot.names):
            if view.node.parent is not None and (item := program.nodes[view.node.parent].item):
                types[item] = view.scope.names[item]
    for length in range(len(spot.cursor.path) + 1):
        word = tree.at(spot.cursor.root, (*spot.cursor.path[:length], "for"))
        if isinstance(word, tree.ScalarNode):
            yield word.text, types.get(word.text, UNKNOWN)


@dataclass(frozen=True, slots=True)
class OutlineEntry:
    """One line of an outline: `sort` is 'section', 'name', 'step', 'state' or 'value'."""

    name: str
    sort: str
    detail: str
    span: Span
    key: Span
    below: tuple[OutlineEntry, ...] = ()


def outline(text: str) -> list[OutlineEntry]:
    """Return the outline of a text; empty while it is no YAML."""
    root = quick_tree(text)
    if not isinstance(root, tree.MappingNode):
        return []
    is_mission = kind_of(text) == MISSION
    sections = ((name, entry) for name, entry in root.entries.items() if name not in ManifestHeader.model_fields)
    return [_section(name, entry, is_mission) for name, entry in sections]


def _section(name: str, entry: tree.Entry, is_mission: bool) -> OutlineEntry:
    if is_mission and name in _BODIES:
        return _made(entry, "section", tuple(_of_body(name, entry.value, 1)))
    return _made(entry, "section", tuple(_named(entry.value)))


def _named(node: tree.TreeNode) -> Iterator[OutlineEntry]:
    for entry in tree.entries_of(node).values():
        inner = (one for _, one in tree.entries_of(entry.value).items() if not isinstance(one.value, tree.ScalarNode))
        yield _made(entry, "name", tuple(_made(item, "value", tuple(_named(item.value))) for item in inner))


def _of_body(key: str, node: tree.TreeNode, level: int) -> Iterator[OutlineEntry]:
    """Yield what stands below a key of a mission: steps, or names with steps."""
    if level > DEEPEST:
        return
    if isinstance(node, tree.SequenceNode) and key in keys_taking(Takes.STEP, Takes.STEPS, Takes.BRANCHES):
        for item in node.items:
            yield from _step(item, level)
    elif isinstance(node, tree.MappingNode) and key in keys_taking(Takes.STATES, Takes.INTERRUPTS):
        for entry in node.entries.values():
            yield _made(entry, "state", tuple(_inside(entry.value, level)))
    elif isinstance(node, tree.MappingNode) and key in keys_taking(Takes.BRANCHES, Takes.CASES):
        for entry in node.entries.values():
            yield _made(entry, "state", tuple(_step(entry.value, level + 1)))
    elif isinstance(node, tree.MappingNode) and key == "machine":
        for name, entry in node.entries.items():
            yield from _of_body(name, entry.value, level)
    elif key in keys_taking(Takes.STEP):
        yield from _step(node, level)


def _step(node: tree.TreeNode, level: int) -> Iterator[OutlineEntry]:
    if isinstance(node, tree.ScalarNode) and node.text:
        yield OutlineEntry(node.text, "step", "", node.span, node.span)
    elif isinstance(node, tree.SequenceNode):
        yield from _of_body("sequence", node, level)
    elif isinstance(node, tree.MappingNode):
        own = [key for key in node.entries if key not in ("name", *modifier_keys())]
        word = next((key for key in own if key in kinds()), own[0] if own else "")
        if word:
            entry = node.entries[word]
            yield OutlineEntry(
                word, "step", _detail(entry.value), _around(node), entry.key.span, tuple(_inside(node, level))
            )


def _inside(node: tree.TreeNode, level: int) -> Iterator[OutlineEntry]:
    if isinstance(node, tree.MappingNode):
        for key, entry in node.entries.items():
            yield from _of_body(key, entry.value, level + 1)
    else:
        yield from _step(node, level + 1)


def _made(entry: tree.Entry, sort: str, below: tuple[OutlineEntry, ...]) -> OutlineEntry:
    key, value = entry.key.span, entry.value.span
    span = Span(key.file, key.line, key.column, *max(_end(key), _end(value)))
    return OutlineEntry(entry.key.text, sort, _detail(entry.value), span, key, below)


def _around(node: tree.MappingNode) -> Span:
    first = next(iter(node.entries.values())).key.span
    return Span(first.file, first.line, first.column, *max(_end(node.span), _end(first)))


def _end(span: Span) -> tuple[int, int]:
    return span.end_line, span.end_column


def _detail(node: tree.TreeNode) -> str:
    if isinstance(node, tree.MappingNode) and isinstance(word := node.get("type"), tree.ScalarNode):
        node = word
    text = " ".join(node.text.split()) if isinstance(node, tree.ScalarNode) else ""
    return text if len(text) <= _DETAIL else f"{text[: _DETAIL - 3]}..."


def define(document: Document, line: int, column: int) -> Span | None:
    """Return the place that defines what a position (from 0) names, or None."""
    spot = document.at(line, column)
    if spot is None:
        return None
    span = _file(spot) or _definition_named(spot, word_at(spot))
    return _here(spot, span) if span is not None and not span.file else span


def word_at(spot: Spot) -> str:
    """Return the name at a position, with `$` or `${` before it."""
    front, back = _FRONT.match(spot.cursor.before[::-1]), _BACK.match(spot.cursor.after)
    return f"{front[0][::-1] if front else ''}{back[0] if back else ''}"


def _here(spot: Spot, span: Span) -> Span:
    """Return a place of the text with its file."""
    return Span(shown_name(spot.document.path), span.line, span.column, span.end_line, span.end_column)


def _file(spot: Spot) -> Span | None:
    if spot.document.is_mission or spot.cursor.is_key or spot.guide.value(spot.cursor.path).names != FILE:
        return None
    place = Span("", 1, 1, 1, 1)
    found = resolve(spot.cursor.text, spot.document.path, place, may_be_robot=True)
    return Span(shown_name(found), 1, 1, 1, 1) if not hasattr(found, "code") else None


def _definition_named(spot: Spot, word: str) -> Span | None:
    if word.startswith("${"):
        name = word.removeprefix("${").strip()
        return _own(spot, (args.name, name.removeprefix("args."))) if name.startswith("args.") else None
    if word.startswith("$"):
        return variable_span(spot, word.removeprefix("$").partition(".")[0])
    cursor = spot.cursor
    if cursor.is_key:
        kind = named_by_key(cursor.path, is_overlay=False)
        return _skill(spot, word) if spot.document.is_mission else _of_kind(spot, kind, word)
    kind = spot.guide.value(cursor.path).names
    if spot.document.is_mission:
        return _of_kind(spot, PLACE, word) or _skill(spot, word)
    return _of_kind(spot, kind, word)


def _of_kind(spot: Spot, kind: str, word: str) -> Span | None:
    if kind == SKILL:
        return _skill(spot, word)
    _, kind = PREFIXED.get(kind, ("", kind))
    name = word.partition(".")[0] if kind == PORT else word
    paths = ((one.name, *one.at, name) for one in naming(COMPONENT if kind in (PORT, RUNNING) else kind))
    return next((span for path in paths if (span := _own(spot, path))), None)


def _own(spot: Spot, path: tree.KeyPath) -> Span | None:
    """Return the place of an entry: in the text itself, else in the composed robot."""
    if not spot.document.is_mission and tree.at(spot.cursor.root, path) is not None:
        return tree.key_span(spot.cursor.root, path)
    robot = spot.known.robot
    if robot is not None and tree.at(robot.manifest.root, path) is not None:
        return tree.key_span(robot.manifest.root, path)
    return None


def _skill(spot: Spot, word: str) -> Span | None:
    """Return the place of the component that offers a skill."""
    robot = spot.known.robot
    source = robot.skills.get(word) if robot else None
    if robot is None or source is None:
        return None
    ends = (end for end in robot.ends if end.port.kind in _SERVING and end.topic == source.topic)
    return next((robot.component_span(end.instance) for end in ends), None)


def describe(document: Document, line: int, column: int) -> str:
    """Return what is known about a position (from 0): its purpose, dimension, value and the origin of that."""
    spot = document.at(line, column)
    if spot is None or not spot.cursor.text:
        return ""
    return "\n\n".join(part for part in (_name(spot), _field(spot), _value(spot)) if part)


def _name(spot: Spot) -> str:
    """Return what the name at the position refers to."""
    word, cursor = word_at(spot), spot.cursor
    if word.startswith("${"):
        name = word.removeprefix("${").strip()
        return _described(f"${{{name}}}", fills(spot).get(name, ""))
    if word.startswith("$"):
        return _described(word, variables(spot).get(word.removeprefix("$").partition(".")[0], ""))
    if spot.document.is_mission:
        skill = _described(word, spot.known.of(SKILL).get(word, ""))
        return skill or ("" if cursor.is_key else _described(word, spot.known.of(PLACE).get(word, "")))
    if cursor.is_key:
        return ""
    kind = spot.guide.value(cursor.path).names
    return _described(word, spot.known.of(kind, cursor.path).get(word, "")) if kind else ""


def _described(name: str, about: str) -> str:
    return f"`{name}`: {about}" if about else ""


def _field(spot: Spot) -> str:
    """Return the purpose of the key, what it measures, and its default."""
    path = spot.cursor.place
    value = spot.guide.value(path)
    words = _type(spot) if spot.cursor.is_key else value.words.get(spot.cursor.text, "")
    dimension = f"Takes {value.dimension.phrase}." if value.dimension else ""
    default = "" if value.default is None else f"Default: `{value.default}`."
    return "\n\n".join(part for part in (words, spot.guide.describe(path), f"{dimension} {default}".strip()) if part)


def _type(spot: Spot) -> str:
    """Return what the type of the entry named at the position is."""
    place = (*spot.cursor.place, "type")
    return spot.guide.value(place).words.get(tree.text_at(spot.cursor.root, place), "")


def _value(spot: Spot) -> str:
    """Return the value in the composed robot with its file, line and column, and the values it replaced."""
    robot = spot.known.robot
    if robot is None or spot.document.kind not in EVERYWHERE:
        return ""
    path = below_profile(spot.cursor.place)
    node = tree.at(robot.manifest.root, path)
    if not isinstance(node, tree.ScalarNode) or node.filled is tree.BROKEN or not node.text:
        return ""
    filled = node.filled
    shown = format_quantity(filled.value, filled.dimension) if isinstance(filled, Quantity) else filled
    return f"`{node.text}`{'' if filled is None else f' = `{shown}`'} from {node.span}{''.join(_lost(robot, path))}"


def _lost(robot: Robot, path: tree.KeyPath) -> Iterator[str]:
    """Yield the values that a later layer has replaced, latest first."""
    for step in reversed(robot.manifest.history.of(path)[:-1]):
        if isinstance(step.node, tree.ScalarNode):
            yield f"; {step.layer} had `{step.node.text}` ({step.node.span})"
