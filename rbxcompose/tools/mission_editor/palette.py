"""What can be put into a mission, and the form of a step: both follow from what kinds and skills declare."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from functools import cache
from pathlib import Path as FilePath
from textwrap import dedent
from typing import Any

from rbxcompose.base.requests import Refused
from rbxcompose.base.units import units_of
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.schema.documents import schema_for
from rbxcompose.compiler.schema.guide import Guide, GuidedValue
from rbxcompose.compiler.schema.mission import ITEM_NAME
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode
from rbxcompose.missions.language.fields import first_line
from rbxcompose.missions.language.keys import anywhere
from rbxcompose.missions.program.registry import kinds
from rbxcompose.tools.lsp.answers import variables
from rbxcompose.tools.lsp.document import Cursor, Document, Spot, quick_tree
from rbxcompose.tools.lsp.names import SKILL, KnownNames
from rbxcompose.tools.lsp.project import MISSION
from rbxcompose.tools.mission_editor.outline import MissionOutline, kind_of, slots_of
from rbxcompose.tools.mission_editor.patches import change
from rbxcompose.tools.mission_editor.yaml_places import Path, TextLines, placed

_EXAMPLE = "Example:"
_VALUES = frozenset(("string", "number", "integer", "boolean", "null"))
_MOST = 200  # names to choose from


def palette(robot: Robot, file: FilePath) -> list[dict[str, str]]:
    """Return what a step can be: first this robot's skills, then the kinds, each with a line of help and its YAML."""
    guide, known = _guide(robot, file, MappingNode({"do": _entry("do", MappingNode({}))}))
    about = {name: str(schema.get("description", "")) for name, schema in guide.keys(("do",)).items()}
    skills = [
        {"word": name, "sort": "skill", "about": about.get(name, ""), "yaml": _skill(robot, file, name)}
        for name in sorted(known.of(SKILL))
    ]
    words = [
        {"word": name, "sort": "kind", "about": first_line(cls.__doc__), "yaml": example_of(name)}
        for name, cls in kinds().items()
    ]
    return [*skills, *words]


def form(robot: Robot, file: FilePath, text: str, path: Path) -> dict[str, Any]:
    """Return the values of the step, state or interrupt at a path that can be typed in one line, and its own name.

    Raises:
        Refused: if there is none.
    """
    outline = MissionOutline(text)
    block, node = outline.at(path), outline.root.at(path) if outline.root is not None else None
    if block is None or node is None or node.form not in ("map", "scalar"):
        raise Refused("this block has no options")
    kind = kind_of(node) if block.kind not in ("state", "interrupt") else ""
    if node.form == "scalar":  # as it would be with an option
        text = change(text, {"op": "set", "path": path, "key": "name", "value": "x"}).applied(text)
    root = quick_tree(text)
    if not isinstance(root, MappingNode):
        raise Refused("the text cannot be read")
    guide, known = _guide(robot, file, root)
    inside = {slot.path[len(path)] for slot in slots_of(node, path) if len(slot.path) > len(path)} | {"do", "machine"}
    keys = guide.keys(path)
    own = {kind, *anywhere()} if kind and kind not in kinds() else keys  # a skill is one key of a step
    fields = []
    for key, schema in keys.items():
        is_there = node.get(key) if node.form == "map" else None
        if key not in own or key in inside - {kind} or not _takes_value(schema):
            continue
        where = (*path, key)
        spot = Spot(Document(file, text, robot), Cursor(root, where, "", "", False), known, guide)
        is_short = is_there is None or is_there.form == "scalar" or is_there.is_flow
        shown = text[is_there.start : is_there.end] if is_there is not None and node.form == "map" else ""
        fields.append(
            {
                "key": key,
                "about": str(schema.get("description", "")),
                "value": is_there.text if is_there is not None and is_there.form == "scalar" else shown,
                "is_fixed": not is_short or "\n" in shown,
                "is_word": key == kind,
                **_choices(guide.value(where), spot, schema),
            }
        )
    fields.sort(key=lambda one: (not one["is_word"], not one["value"]))
    name = str(path[-1]) if any(slot.path == path[:-1] and slot.has_names for slot in outline.all_slots()) else ""
    about = guide.describe((*path, kind)) if kind else ""
    return {"kind": block.kind, "name": name, "about": about, "fields": fields}


def _choices(value: GuidedValue, spot: Spot, schema: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a field takes: its unit, and what can be chosen; `only` if it is nothing but one of these."""
    only = [str(word) for word in schema.get("enum", ())]
    names = spot.known.of(value.names, spot.cursor.path) if value.names else {}
    is_name = schema.get("pattern") == ITEM_NAME["pattern"]
    values = () if only or value.names or is_name else (f"${name}" for name in variables(spot))
    examples = (one for one in value.examples if one.lower() not in value.words)
    found = [*only, *names, *value.words, *examples, *values]
    unit = units_of(value.dimension) if value.dimension else ()
    default = "" if value.default is None else str(value.default)
    return {"choices": list(dict.fromkeys(found))[:_MOST], "only": bool(only), "units": list(unit), "default": default}


def _takes_value(schema: Mapping[str, Any]) -> bool:
    """Return whether a value in one line is possible."""
    if "enum" in schema or "pattern" in schema:
        return True
    if "anyOf" in schema:
        return any(map(_takes_value, schema["anyOf"]))
    types = schema.get("type", ())
    return not _VALUES.isdisjoint([types] if isinstance(types, str) else types)


def _guide(robot: Robot, file: FilePath, root: MappingNode) -> tuple[Guide, KnownNames]:
    known = KnownNames(file, root, robot)
    return Guide(schema_for(MISSION, known.skills), root, known.types), known


def _entry(key: str, value: TreeNode) -> Entry:
    return Entry(ScalarNode(key, value.span), value)


def _skill(robot: Robot, file: FilePath, name: str) -> str:
    """Return a step that uses a skill, with the first value that its main argument may have."""
    empty = ScalarNode("", MappingNode().span)
    root = MappingNode({"do": _entry("do", MappingNode({name: _entry(name, empty)}))})
    guide, known = _guide(robot, file, root)
    value = guide.value(("do", name))
    found = [*(known.of(value.names) if value.names else ()), *value.words, *value.examples]
    return f"{name}: {found[0]}" if found else f"{name}:"


@cache
def example_of(kind: str) -> str:
    """Return a step of a kind as its docstring shows it."""
    text = dedent((inspect.getdoc(kinds()[kind]) or "").partition(_EXAMPLE)[2]).strip("\n")
    root = placed(f"{text}\n") if text else None
    body = root.get("do") if root is not None else None
    if root is not None and body is None and root.get(kind) is not None:
        return text
    found = [one for one in body.all() if one.form == "map" and kind_of(one) == kind] if body is not None else []
    if not found:
        return f"{kind}:"
    lines = TextLines(text)
    column = lines.column(found[0].start)
    first, last = lines.of(found[0].start), lines.of(max(found[0].end - 1, 0)) + 1
    rest = [line[column:] for line in lines.lines[first + 1 : last]]
    return "\n".join([lines.lines[first][column:], *rest])
