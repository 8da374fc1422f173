"""What can be put into a mission: it follows from what kinds and skills declare."""

from __future__ import annotations

import inspect
from functools import cache
from pathlib import Path as FilePath
from textwrap import dedent

from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.schema.mission import skills_of
from rbxcompose.manifest.tree import Entry, MappingNode, ScalarNode, TreeNode
from rbxcompose.missions.language.fields import first_line
from rbxcompose.missions.program.registry import kinds
from rbxcompose.tools.lsp.names import SKILL
from rbxcompose.tools.mission_editor.form import guide_of
from rbxcompose.tools.mission_editor.outline import kind_of
from rbxcompose.tools.mission_editor.yaml_places import TextLines, placed

_EXAMPLE = "Example:"


def palette(robot: Robot, file: FilePath) -> list[dict[str, str]]:
    """Return what a step can be: first this robot's skills, then the kinds, each with a line of help and its YAML."""
    guide, known = guide_of(robot, file, MappingNode({"do": _entry("do", MappingNode({}))}))
    about = {name: str(schema.get("description", "")) for name, schema in guide.keys(("do",)).items()}
    # The guide knows all types that offer a skill; here it is one of those that this robot has.
    own = skills_of({component.type_name for component in robot.components.values()})
    about |= {name: text.replace("`", "'") for name, (_, text) in own.items()}
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
    """Return a step that uses a skill, with the first value that its main argument may have."""
    empty = ScalarNode("", MappingNode().span)
    root = MappingNode({"do": _entry("do", MappingNode({name: _entry(name, empty)}))})
    guide, known = guide_of(robot, file, root)
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
