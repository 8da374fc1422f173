"""A change of a mission's text while it is made: its edits, and the tree that it is meant to have afterwards."""

from __future__ import annotations

import json
from copy import deepcopy
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import Refused
from rbxcompose.tools.mission_editor.outline import INTERRUPTS, MissionOutline
from rbxcompose.tools.mission_editor.yaml_places import (
    BLOCK_MARK,
    INDENT,
    SCALAR_MARK,
    Path,
    PlacedNode,
    PlainTree,
    TextPatch,
    YamlPatch,
    placed,
    put_into,
    take_out,
    tree_at,
)

BY_HAND = "change it in the text"


@dataclass(frozen=True, slots=True)
class Written:
    """A value as it is written: what stands behind its key, the lines below that, and what it is."""

    head: str
    lines: tuple[str, ...]
    plain: PlainTree

    def below(self, column: int) -> str:
        """Return the lines below the key."""
        return shifted(list(self.lines), column)

    def behind(self, column: int) -> str:
        """Return all that follows the colon of a key at a column."""
        return f"{' ' if self.head else ''}{self.head}" + (f"\n{self.below(column + INDENT)}" if self.lines else "")


class Patch(YamlPatch):
    """Makes one change of a mission's outline."""

    BY_HAND = BY_HAND
    OVERLAP = "what is moved and where it goes overlap"

    def __init__(self, outline: MissionOutline, root: PlacedNode) -> None:
        super().__init__(outline.lines, root)
        self.outline = outline

    def node(self, path: Path) -> PlacedNode:
        """Return the node at a path.

        Raises:
            Refused: if there is none.
        """
        found = self.root.at(path)
        if found is None:
            raise Refused("the text has changed: choose again")
        return found

    def movable(self, path: Path) -> tuple[int, int, int]:
        """Return the lines of a block that can be moved, and its column.

        Raises:
            Refused: if it cannot.
        """
        self.node(path)
        region = self.outline.region(path)
        block = self.outline.at(path)
        if region is None or block is None or block.is_fixed:
            raise Refused(f"it is the only step here, or written within a line: {BY_HAND}")
        return region

    def is_list_of_steps(self, path: Path) -> bool:
        """Return whether there is a list of steps."""
        node = self.root.at(path)
        return node is not None and node.form == "list" and self.outline.at((*path, 0)) is not None

    def takes_names(self, path: Path) -> bool:
        """Return whether what is in a slot has names, as it is written."""
        return any(slot.path == path and slot.has_names for slot in self.outline.all_slots())

    def text_of(self, first: int, last: int) -> str:
        """Return lines of the text."""
        return "\n".join(self.lines.lines[first:last])

    def place(self, path: Path, to: Path, index: int) -> TextPatch:
        """Move a block into a slot."""
        first, last, column = self.movable(path)
        if path == to[: len(path)]:
            raise Refused("a step cannot be put into itself")
        source, key = tree_at(self.tree, path[:-1]), path[-1]
        if to == path[:-1]:
            return self.place_near(path, index)
        if not isinstance(key, int):
            raise Refused("what has a name stays where its kind belongs")
        above = self.node(path[:-1])
        if len(above.items) == 1:
            raise Refused("this is the only one here: what is around it would be empty")
        if not any(slot.path == to and slot.of == "step" for slot in self.outline.all_slots()):
            raise Refused("no step can be there")
        if self.root.at(to) is None:
            raise Refused(f"nothing is there yet: add '{to[-1]}' first")
        if self.takes_names(to):
            raise Refused("what is there has names: copy its text there by hand")
        moved = source[1][key]
        made = self.insert_item(to, index, self.lines.lines[first:last], deepcopy(moved), column)
        self.cut(first, last)
        source[1] = [one for one in source[1] if one is not moved]
        return self.done(path_after(made, path))

    def place_near(self, path: Path, index: int) -> TextPatch:
        """Move a block within its list or map."""
        first, last, _ = self.movable(path)
        container, above = tree_at(self.tree, path[:-1]), self.node(path[:-1])
        keys: list[str | int] = list(range(len(above.items))) or [key.text for key, _ in above.pairs]
        at, index = keys.index(path[-1]), max(0, min(index, len(keys)))
        if index in (at, at + 1):
            raise Refused("it is there already")
        if index < len(keys):
            line = self.region((*path[:-1], keys[index]))[0]
        else:
            line = self.region((*path[:-1], keys[-1]))[1]
        self.paste(line, self.text_of(first, last))
        self.cut(first, last)
        moved = container[1].pop(at)
        target = index - 1 if index > at else index
        container[1].insert(target, moved)
        return self.done((*path[:-1], target if isinstance(path[-1], int) else path[-1]))

    def region(self, path: Path) -> tuple[int, int, int]:
        """Return the lines of an item or an entry, and its column.

        Raises:
            Refused: if it shares them with something else.
        """
        found = self.outline.region(path)
        if found is None:
            raise Refused(f"it is written within a line: {BY_HAND}")
        return found

    def insert_item(self, to: Path, index: int, lines: list[str], new: PlainTree, column: int = 0) -> Path:
        """Write an item, whose dash is at `column`, into a list of steps, or beside the only step of a slot."""
        node = self.node(to)
        if node.form == "list":
            if node.is_flow or not node.items:
                raise Refused(f"the list is written within brackets: {BY_HAND}")
            index = max(0, min(index, len(node.items)))
            near = self.region((*to, min(index, len(node.items) - 1)))
            line = near[0] if index < len(node.items) else near[1]
            self.paste(line, shifted(lines, near[2] - column))
            tree_at(self.tree, to)[1].insert(index, new)
            return (*to, index)
        index = min(1, max(0, index))
        old = tree_at(self.tree, to)
        if node.form == "map" and not node.is_flow and self.lines.begins(node.start):
            target = self.wrap(node)
            first, last = self.lines.region(node.start, node.end, target)
            self.paste(last if index else first, shifted(lines, target - column))
        else:
            target = self.wrap_word(node, to)
            line = self.lines.of(max(node.end - 1, node.start))
            if index == 0:
                raise Refused("put it behind this step, then move it")
            self.paste(line + 1, shifted(lines, target - column))
        put_into(tree_at(self.tree, to[:-1]), to[-1], ["list", [new, old] if index == 0 else [old, new], BLOCK_MARK])
        return (*to, index)

    def wrap(self, node: PlacedNode) -> int:
        """Make the only step of a slot the first item of a list; return the column of its dash."""
        column, first = self.lines.column(node.start), self.lines.of(node.start)
        self.replace(node.start, node.start, "- ")
        for line in range(first + 1, self.lines.of(max(node.end - 1, node.start)) + 1):
            if self.lines.lines[line].strip():
                self.replace(self.lines.starts[line], self.lines.starts[line], " " * INDENT)
        return column

    def wrap_word(self, node: PlacedNode, path: Path) -> int:
        """Make a step that stands behind its key, `do: dock`, the first item of a list below that."""
        key = next((key for key, value in self.node(path[:-1]).pairs if value is node), None)
        if key is None or "\n" in self.lines.text[key.start : node.end] or node.start == node.end:
            raise Refused(f"it cannot become a list: {BY_HAND}")
        column = self.lines.column(key.start) + INDENT
        self.replace(key.end + 1, node.start, f"\n{' ' * column}- ")
        return column

    def insert_entry(self, path: Path, index: int, name: str, snippet: str, plain: PlainTree) -> TextPatch:
        """Write an entry with a name into a map of states, branches or interrupts."""
        node = self.node(path)
        names = [key.text for key, _ in node.pairs]
        if not name or scalar_text(name) != name:
            raise Refused("it needs a name: letters, digits and underscores")
        if name in names:
            raise Refused(f"there is '{name}' already")
        if node.is_flow or not names:
            raise Refused(f"the map is written within brackets: {BY_HAND}")
        index = max(0, min(index, len(names)))
        near = self.region((*path, names[min(index, len(names) - 1)]))
        lines = [f"{name}:", *(f"{' ' * INDENT}{line}" if line else "" for line in snippet.split("\n"))]
        self.paste(near[0] if index < len(names) else near[1], shifted(lines, near[2]))
        tree_at(self.tree, path)[1].insert(index, [("scalar", name, SCALAR_MARK), plain])
        return self.done((*path, name))

    def first_interrupt(self, name: str, snippet: str, plain: PlainTree) -> TextPatch:
        """Write the key `interrupts` with its first entry before what the mission does."""
        keys = [key.text for key, _ in self.root.pairs]
        body = next((key for key in ("do", "machine") if key in keys), "")
        if not body or not name or scalar_text(name) != name:
            raise Refused("it needs a name, and a mission that does something")
        lines = [f"{INTERRUPTS}:", f"{' ' * INDENT}{name}:"]
        lines += [f"{' ' * 2 * INDENT}{line}" if line else "" for line in snippet.split("\n")]
        first, _, column = self.region((body,))
        self.paste(first, f"{shifted(lines, column)}\n")
        inner = ["map", [[("scalar", name, SCALAR_MARK), plain]], BLOCK_MARK]
        self.tree[1].insert(keys.index(body), [("scalar", INTERRUPTS, SCALAR_MARK), inner])
        return self.done((INTERRUPTS, name))

    def add_key(self, path: Path, node: PlacedNode, key: str, made: Written, chosen: Path) -> TextPatch:
        """Write a key that was not there below the others of a step."""
        lines, pair = self.lines, [("scalar", key, SCALAR_MARK), made.plain]
        if node.form == "map" and node.is_flow:
            if made.lines:
                raise Refused(f"this is written within a line: {BY_HAND}")
            if not node.pairs:
                raise Refused(f"the map is empty: {BY_HAND}")
            end = max(node.pairs[-1][1].end, node.pairs[-1][0].end + 1)
            self.replace(end, end, f", {key}: {made.head}")
            tree_at(self.tree, path)[1].append(pair)
            return self.done(chosen)
        if node.form == "map":
            # Right below the word of the step if its value is short, so that it stays with what it is about.
            word, value = node.pairs[0]
            is_short = value.form == "scalar" and "\n" not in lines.text[word.start : value.end]
            behind, index = (node.pairs[0], 1) if is_short else (node.pairs[-1], len(node.pairs))
            end = max(behind[1].end, behind[0].end + 1)
            column = lines.column(node.pairs[0][0].start)
            last = lines.of(max(end - 1, 0)) + 1
            if not is_short:
                last = lines.region(node.start, node.end, column)[1]
            self.paste(last, f"{' ' * column}{key}:{made.behind(column)}")
            tree_at(self.tree, path)[1].insert(index, pair)
            return self.done(chosen)
        if node.form != "scalar" or "\n" in lines.text[node.start : node.end] or not node.text:
            raise Refused(f"this step has no keys: {BY_HAND}")
        if not lines.text[lines.starts[lines.of(node.start)] : node.start].strip(" -") == "":
            raise Refused(f"this step is written behind its key: {BY_HAND}")
        self.replace(node.end, node.end, ":")
        column = lines.column(node.start)
        self.paste(lines.of(node.start) + 1, f"{' ' * column}{key}:{made.behind(column)}")
        step = ["map", [[("scalar", node.text, node.mark), ("scalar", "", SCALAR_MARK)], pair], BLOCK_MARK]
        put_into(tree_at(self.tree, path[:-1]), path[-1], step)
        return self.done(chosen)

    def unset(self, path: Path, node: PlacedNode, key: str, old: PlacedNode | None, chosen: Path) -> TextPatch:
        """Take a key of a step away, or the value of its word."""
        if old is None:
            raise Refused(f"there is no '{key}'")
        names = [name.text for name, _ in node.pairs]
        at = names.index(key)
        if at == 0 and (path == chosen or len(names) == 1):
            if path != chosen:
                raise Refused(f"'{key}' is the only one here: {BY_HAND}")
            if old.form != "scalar" or "\n" in self.lines.text[old.start : old.end]:
                raise Refused(f"'{key}' is the word of the step: {BY_HAND}")
            start = node.pairs[0][0].end + 1
            self.replace(start, old.end, "")
            put_into(tree_at(self.tree, path), key, ("scalar", "", SCALAR_MARK))
            return self.done(chosen)
        if node.is_flow:
            if at == 0:
                self.replace(node.pairs[0][0].start, node.pairs[1][0].start, "")
            else:
                before = node.pairs[at - 1]
                self.replace(max(before[1].end, before[0].end + 1), old.end, "")
        else:
            first, last, _ = self.region((*path, key))
            self.cut(first, last)
        take_out(tree_at(self.tree, path), key)
        return self.done(chosen)


def path_of(given: Any) -> Path:
    """Return a path that came from outside.

    Raises:
        Refused: if it is none.
    """
    if not isinstance(given, list | tuple) or not all(type(key) in (str, int) for key in given):
        raise Refused("this is no place in a mission")
    return tuple(given)


def path_after(made: Path, gone: Path) -> Path:
    """Return a path as it is when an item of a list is gone."""
    above, index = gone[:-1], gone[-1]
    at = made[len(above)] if len(made) > len(above) and made[: len(above)] == above else None
    if isinstance(at, int) and isinstance(index, int) and at > index:
        return (*above, at - 1, *made[len(gone) :])
    return made


def as_item(lines: list[str]) -> list[str]:
    """Return the lines of a node as an item of a list."""
    return [f"- {lines[0]}", *(f"{' ' * INDENT}{line}" if line else "" for line in lines[1:])]


def shifted(lines: list[str], columns: int) -> str:
    """Return lines that begin some columns further right or left."""
    if columns >= 0:
        return "\n".join(f"{' ' * columns}{line}" if line.strip() else line for line in lines)
    return "\n".join(line[min(-columns, len(line) - len(line.lstrip(" "))) :] for line in lines)


def scalar_text(value: str) -> str:
    """Return a value as YAML in one line, in quotes only if it needs them."""
    value = " ".join(value.split())
    node = placed(f"- {value}\n") if value else None
    item = node.items[0] if node is not None and node.form == "list" and len(node.items) == 1 else None
    is_value = item is not None and (item.form == "scalar" or item.is_flow) and item.mark[:2] == BLOCK_MARK
    is_whole = item is not None and item.end == len(value) + 2
    return value if is_value and is_whole else json.dumps(value, ensure_ascii=False)
