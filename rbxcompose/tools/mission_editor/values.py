"""Values of steps as a form shows and changes them: in one line, or as lines that stay as somebody wrote them."""

from __future__ import annotations

from collections.abc import Mapping
from textwrap import dedent
from typing import Any

from rbxcompose.base.requests import Refused
from rbxcompose.manifest.yaml_nodes import compose
from rbxcompose.tools.mission_editor.patch import BY_HAND, Patch, Written, path_of, scalar_text, shifted
from rbxcompose.tools.mission_editor.yaml_places import (
    BLOCK_MARK,
    INDENT,
    SCALAR_MARK,
    Path,
    PlacedNode,
    TextLines,
    TextPatch,
    placed,
    put_into,
    tree_at,
)

LINE, LINES, TEXT, FIXED = "line", "lines", "text", "fixed"
"""How a value is edited: in a line of YAML, in several, as a text of several lines, or not in a form."""


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


def set_value(patch: Patch, operation: Mapping[str, Any]) -> TextPatch:
    """Give a key of the block at `path`, or of the map `within` it, a value; an empty one takes the key away."""
    path, within = path_of(operation["path"]), path_of(operation.get("within", ()))
    key, value = str(operation["key"]), str(operation["value"])
    where, step = (*path, *within), patch.node(path)
    if not value.strip():
        node = patch.node(where)
        return patch.unset(where, node, key, node.get(key) if node.form == "map" else None, path)
    made = _written(value, str(operation.get("shape") or LINE))
    inside = patch.root.at(where)
    if within and (inside is None or (inside.form == "scalar" and not inside.text)):
        entry = f"{key}:{made.behind(0)}".split("\n")
        made = Written("", tuple(entry), ["map", [[("scalar", key, SCALAR_MARK), made.plain]], BLOCK_MARK])
        key, where = str(within[-1]), path
    if step.form == "scalar" and where == path and key == step.text:
        return _after_word(patch, path, step, made)
    node = patch.node(where)
    pair = next((pair for pair in node.pairs if pair[0].text == key), None)
    if pair is None:
        return patch.add_key(where, node, key, made, path)
    if pair[1].form == "alias":
        raise Refused(f"'{key}' repeats another value: {BY_HAND}")
    _replace(patch, node, *pair, made)
    put_into(tree_at(patch.tree, where), key, made.plain)
    return patch.done(path)


def _after_word(patch: Patch, path: Path, step: PlacedNode, made: Written) -> TextPatch:
    """Give a step that is only a word its value."""
    column = patch.lines.column(step.start)
    patch.replace(step.end, step.end, f": {made.head}" if made.head else ":")
    if made.lines:
        patch.paste(patch.lines.of(step.start) + 1, made.below(column + INDENT))
    entry = [("scalar", step.text, step.mark), made.plain]
    put_into(tree_at(patch.tree, path[:-1]), path[-1], ["map", [entry], BLOCK_MARK])
    return patch.done(path)


def _replace(patch: Patch, node: PlacedNode, key: PlacedNode, old: PlacedNode, made: Written) -> None:
    lines, text = patch.lines, patch.lines.text
    colon = text.find(":", key.end) + 1
    column = lines.column(key.start)
    if made.lines and node.is_flow:
        raise Refused(f"'{key.text}' is written within a line: {BY_HAND}")
    if old.form in ("list", "map") and not old.is_flow:
        if not lines.begins(old.start):
            raise Refused(f"'{key.text}' has an anchor or a tag: {BY_HAND}")
        first, last = lines.region(old.start, old.end, lines.column(old.start))
        if made.lines and not made.head:
            patch.cut(first, last)
            patch.paste(first, made.below(lines.column(old.start)))
            return
        if any(map(lines.is_comment, range(first, last))):
            raise Refused(f"'{key.text}' has comments in it: {BY_HAND}")
        patch.cut(first, last)
        patch.replace(colon, colon, f" {made.head}")
        if made.lines:
            patch.paste(first, made.below(column + INDENT))
        return
    gap = " " if old.start == old.end and text[old.start - 1 : old.start] == ":" else ""
    if not made.lines:
        patch.replace(old.start, old.end, f"{gap}{made.head}")
        return
    patch.replace(old.start if made.head else colon, old.end, f"{gap}{made.head}" if made.head else "")
    below = lines.of(max(old.end - 1, old.start)) + 1
    patch.paste(below, made.below(column + INDENT))


def _written(value: str, shape: str) -> Written:
    """Return a value as it is written behind its key."""
    if shape == TEXT and "\n" in value:
        is_ended = value.endswith("\n")
        value = value.rstrip("\n") + ("\n" if is_ended else "")
        lines = value.rstrip("\n").split("\n")
        indent = str(INDENT) if not lines[0] or lines[0].startswith(" ") else ""
        plain = ("scalar", value, (*BLOCK_MARK, "|"))
        return Written(f"|{indent}{'' if is_ended else '-'}", tuple(lines), plain)
    if shape == LINES:
        value = dedent(value).strip("\n")
        node = placed(f"{value}\n")
        if node is None or compose(value, "")[1] is not None:
            raise Refused("this cannot be read as YAML")
        if "\n" in value or not (node.form == "scalar" or node.is_flow):
            return Written("", tuple(value.split("\n")), node.plain())
    written = scalar_text(value)
    node = placed(written)
    return Written(written, (), node.plain() if node is not None else ("scalar", "", SCALAR_MARK))
