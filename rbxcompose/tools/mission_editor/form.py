"""What can be put into a mission, and the form of a block: what it can be given, and what there is to choose.

Both follow from what kinds, modifiers and skills declare.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path as FilePath
from textwrap import dedent
from typing import Any

from rbxcompose.base.config import PLACE
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.expressions.types import COUNT, PLACED, STRUCTURED, Type, TypeKind, accepts, quantity_of
from rbxcompose.base.requests import Refused
from rbxcompose.base.units import Dimension, units_of
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.schema.documents import schema_for
from rbxcompose.compiler.schema.guide import Guide, GuidedValue
from rbxcompose.compiler.schema.mission import ITEM_NAME
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode
from rbxcompose.missions.language.fields import first_line
from rbxcompose.missions.program.registry import anywhere, kinds
from rbxcompose.tools.lsp.answers import typed_variables
from rbxcompose.tools.lsp.document import SKILL, Cursor, Document, KnownNames, Spot, quick_tree
from rbxcompose.tools.lsp.project import MISSION
from rbxcompose.tools.mission_editor.outline import INTERRUPT, STATE, MissionOutline, kind_of, slots_of
from rbxcompose.tools.mission_editor.patches import FIXED, LINE, LINES, TEXT, change, shifted
from rbxcompose.tools.mission_editor.yaml_places import BLOCK_MARK, Path, PlacedNode, TextLines, placed
from rbxcompose.tools.mission_files import example_step

_VALUES = frozenset(("string", "number", "integer", "boolean", "null"))
_MOST = 200  # names to choose from
_UNKNOWN = Type(TypeKind.UNKNOWN)
_OF_ANYTHING = (TypeKind.FLAG, TypeKind.TEXT)  # a comparison, or a text that has values in it


def guide_of(robot: Robot, file: FilePath, root: MappingNode) -> tuple[Guide, KnownNames]:
    """Return what can be at each place of a mission, and the names that it can use."""
    known = KnownNames(file, root, robot)
    return Guide(schema_for(MISSION, robot), root, known.types), known


def form(robot: Robot, file: FilePath, text: str, path: Path) -> dict[str, Any]:
    """Return the values of the step, state or interrupt at a path, and its own name.

    Raises:
        Refused: if there is none.
    """
    outline = MissionOutline(text)
    block, node = outline.at(path), outline.root.at(path) if outline.root is not None else None
    if block is None or node is None or node.form not in ("map", "scalar"):
        raise Refused("this block has no options")
    kind = kind_of(node) if block.kind not in (STATE, INTERRUPT) else ""
    if node.form == "scalar":  # as it would be with an option
        text = change(text, {"op": "set", "path": path, "key": "name", "value": "x"}).applied(text)
    root = quick_tree(text)
    if not isinstance(root, MappingNode):
        raise Refused("the text cannot be read")
    guide, known = guide_of(robot, file, root)
    drawn = _FormDrawing(Document(file, text, robot), root, guide, known, outline.lines, path, kind)
    fields = list(drawn.fields(node))
    fields.sort(key=lambda one: (not one["is_word"], not one["within"], not one["value"], one["shape"] != LINE))
    name = str(path[-1]) if any(slot.path == path[:-1] and slot.has_names for slot in outline.all_slots()) else ""
    about = guide.describe((*path, kind)) if kind else ""
    return {"kind": block.kind, "name": name, "about": about, "fields": fields}


@dataclass(frozen=True, slots=True)
class _FormDrawing:
    """What the fields of a block's form are drawn from; `lines` are of the text as it is, `kind` is its word."""

    document: Document
    root: MappingNode
    guide: Guide
    known: KnownNames
    lines: TextLines
    path: Path
    kind: str

    def fields(self, node: PlacedNode) -> Iterator[dict[str, Any]]:
        """Yield the fields of the block, and those of the map behind its word."""
        path, kind = self.path, self.kind
        inside = {slot.path[len(path)] for slot in slots_of(node, path) if len(slot.path) > len(path)}
        inside |= {"do", "machine"}
        keys, main = self.guide.keys(path), self._main()
        own = {kind, *anywhere()} if kind and kind not in kinds() else keys  # a skill is one key of a step
        for key, schema in keys.items():
            if key not in own or key in inside:
                continue
            there = node.get(key) if node.form == "map" else None
            parts = list(self._parts(there)) if key == kind else []
            yield from parts
            if not parts or (main is not None and (there is None or there.form != "map")):
                yield self._field((*path, key), schema, there, main if key == kind else None)

    def _parts(self, there: PlacedNode | None) -> Iterator[dict[str, Any]]:
        """Yield the entries that the map behind a word can have, if a map is there, or nothing."""
        if there is not None and there.form != "map" and (there.form != "scalar" or there.text):
            return
        skill, word = self.known.skills.get(self.kind), (*self.path, self.kind)
        for key, schema in self.guide.keys(word).items():
            of = skill.arguments.get(key, _UNKNOWN) if skill is not None else None
            written = there.get(key) if there is not None and there.form == "map" else None
            yield self._field((*word, key), schema, written, of)

    def _main(self) -> Type | None:
        """Return the type of the main argument of a skill."""
        skill = self.known.skills.get(self.kind)
        return skill.arguments.get(skill.main) if skill is not None and skill.main else None

    def _field(
        self, where: Path, schema: Mapping[str, Any], there: PlacedNode | None, of: Type | None
    ) -> dict[str, Any]:
        shape = shape_of(self.lines, there)
        is_empty = there is None or (there.form == "scalar" and not there.text)
        if is_empty and ((of is not None and of.kind in STRUCTURED) or not _takes_value(schema)):
            shape = LINES
        spot = Spot(self.document, Cursor(self.root, where, "", "", False), self.known, self.guide)
        return {
            "key": where[-1],
            "within": list(where[len(self.path) : -1]),
            "about": str(schema.get("description", "")),
            "value": "" if there is None else shown_value(self.lines, there),
            "shape": shape,
            "is_word": where == (*self.path, self.kind),
            **(_choices(self.guide.value(where), spot, schema, of) if shape == LINE else _NO_CHOICES),
        }


_NO_CHOICES: Mapping[str, Any] = {"choices": [], "only": False, "units": [], "default": ""}


def _choices(value: GuidedValue, spot: Spot, schema: Mapping[str, Any], of: Type | None) -> dict[str, Any]:
    """Return what a field takes: its unit, and what can be chosen; `only` if it is nothing but one of these."""
    only = [str(word) for word in schema.get("enum", ())]
    kind = PLACE if of is not None and of.kind in PLACED else value.names
    names = spot.known.of(kind, spot.cursor.path) if kind else {}
    of_skill = of.choices if of is not None else ()
    flags = ("true", "false") if of is not None and of.kind is TypeKind.FLAG else ()
    is_name = schema.get("pattern") == ITEM_NAME["pattern"]
    dimension: Dimension | None = of.dimension if of is not None else value.dimension
    wanted = of or (quantity_of(dimension) if dimension else COUNT if "integer" in schema.get("type", ()) else _UNKNOWN)
    if wanted.kind in _OF_ANYTHING:
        wanted = _UNKNOWN
    known = {} if only or kind or is_name else typed_variables(spot)
    values = (f"${name}" for name, (given, _) in known.items() if accepts(wanted, given))
    examples = (one for one in value.examples if one.lower() not in value.words)
    found = [*only, *names, *of_skill, *flags, *value.words, *examples, *values]
    default = "" if value.default is None else str(value.default)
    return {
        "choices": list(dict.fromkeys(found))[:_MOST],
        "only": bool(only),
        "units": list(units_of(dimension)) if dimension else [],
        "default": default,
    }


def shape_of(lines: TextLines, node: PlacedNode | None) -> str:
    """Return how a value can be edited; None is one that is not there."""
    if node is None:
        return LINE
    raw = lines.text[node.start : node.end]
    if node.form == "alias" or (node.mark[:2] != BLOCK_MARK and "\n" in raw):
        return FIXED
    if node.form == "scalar":
        return TEXT if "\n" in raw else LINE
    if node.is_flow and "\n" not in raw:
        return LINE
    return LINES if node.is_flow or lines.begins(node.start) else FIXED


def shown_value(lines: TextLines, node: PlacedNode) -> str:
    """Return a value as a form shows it: what is in lines of its own with its comments, as if it stood alone."""
    if node.form == "scalar":
        return node.text
    if node.is_flow or not lines.begins(node.start):
        return lines.text[node.start : node.end]
    column = lines.column(node.start)
    first, last = lines.region(node.start, node.end, column)
    return shifted(lines.lines[first:last], -column)


def _takes_value(schema: Mapping[str, Any]) -> bool:
    """Return whether a value in one line is possible."""
    if "enum" in schema or "pattern" in schema:
        return True
    if "anyOf" in schema:
        return any(map(_takes_value, schema["anyOf"]))
    types = schema.get("type", ())
    return not _VALUES.isdisjoint([types] if isinstance(types, str) else types)


def palette(robot: Robot, file: FilePath) -> list[dict[str, str]]:
    """Return what a step can be: first this robot's skills, then the kinds, each with a line of help and its YAML."""
    guide, known = guide_of(robot, file, MappingNode({"do": _entry("do", MappingNode({}))}))
    keys = guide.keys(("do",))
    about = {name: str(schema.get("description", "")).replace("`", "'") for name, schema in keys.items()}
    skills = [
        {"word": name, "sort": "skill", "about": about.get(name, ""), "yaml": _skill(robot, file, name)}
        for name in sorted(known.of(SKILL))
    ]
    words = [
        {"word": name, "sort": "kind", "about": first_line(cls.__doc__), "yaml": example_of(name)}
        for name, cls in kinds().items()
    ]
    return [*skills, *words]


def _entry(key: str, value: TreeNode) -> Entry:
    return Entry(ScalarNode(key, value.span), value)


def _skill(robot: Robot, file: FilePath, name: str) -> str:
    """Return a step that uses a skill, with the first value that its main argument may have, or an example."""
    empty = ScalarNode("", MappingNode().span)
    root = MappingNode({"do": _entry("do", MappingNode({name: _entry(name, empty)}))})
    guide, known = guide_of(robot, file, root)
    value = guide.value(("do", name))
    found = [*(known.of(value.names) if value.names else ()), *value.words, *value.examples]
    return f"{name}: {found[0]}" if found else example_step(known.skills[name])


@cache
def example_of(kind: str) -> str:
    """Return a step of a kind as its docstring shows it."""
    text = dedent((inspect.getdoc(kinds()[kind]) or "").partition("Example:")[2]).strip("\n")
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
