"""Changes of a mission's outline as changes of its text: every byte that does not belong to the change stays.

`change` says which parts of a text to replace. What comes of it is parsed again: if it is not exactly the tree that was
meant, the change is refused, and nobody has lost anything.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from copy import deepcopy
from itertools import pairwise
from types import MappingProxyType
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import Refused
from rbxcompose.manifest.yaml_nodes import compose
from rbxcompose.tools.mission_editor.outline import ONE, MissionOutline, Slot
from rbxcompose.tools.mission_editor.yaml_places import Path, PlacedNode, PlainTree, placed

INDENT = 2
INTERRUPTS = "interrupts"
_BY_HAND = "change it in the text"
_PLAIN = PlacedNode("scalar", 0, 0, "", (None, None, "")).plain()
_SCALAR = _PLAIN[2]  # the mark of a scalar without quotes
_BLOCK = (None, None)  # of a list or a map


@dataclass(frozen=True, slots=True)
class TextEdit:
    """Replaces what is between two offsets of a text."""

    start: int
    end: int
    text: str


@dataclass(frozen=True, slots=True)
class TextPatch:
    """Edits that do not overlap, in the order of the text, and the path of what is chosen afterwards."""

    edits: tuple[TextEdit, ...]
    chosen: Path

    def applied(self, text: str) -> str:
        """Return a text with the edits."""
        for edit in reversed(self.edits):
            text = f"{text[: edit.start]}{edit.text}{text[edit.end :]}"
        return text


def change(text: str, operation: Mapping[str, Any]) -> TextPatch:
    """Return how an operation changes a text: its `op`, the `path` of a block, and what else it needs.

    Raises:
        Refused: if that is impossible, or cannot be done without touching anything else.
    """
    outline = MissionOutline(text)
    if outline.root is None:
        raise Refused(f"the text cannot be read: {_BY_HAND} first")
    try:
        made = OPERATIONS[operation["op"]](_Patch(outline, outline.root), operation)
    except (KeyError, TypeError, ValueError) as error:
        raise Refused("this is no change of a mission") from error
    return made


class _Patch:
    """Collects the edits of one operation, and what the tree is to be afterwards."""

    def __init__(self, outline: MissionOutline, root: PlacedNode) -> None:
        self.outline = outline
        self.lines = outline.lines
        self.edits: list[TextEdit] = []
        self.root = root
        self.tree: PlainTree = root.plain()

    # Operations

    def delete(self, operation: Mapping[str, Any]) -> TextPatch:
        """Take a step, a state or an interrupt out."""
        path = path_of(operation["path"])
        first, last, _ = self.movable(path)
        above = self.node(path[:-1])
        if len(above.items) + len(above.pairs) == 1:
            raise Refused("this is the only one here: delete what is around it")
        self.cut(first, last)
        _take(_at(self.tree, path[:-1]), path[-1])
        return self.done(path[:-1] if not isinstance(path[-1], int) else (*path[:-1], max(0, path[-1] - 1)))

    def duplicate(self, operation: Mapping[str, Any]) -> TextPatch:
        """Write a block once more below itself; a named one gets another name."""
        path = path_of(operation["path"])
        first, last, _ = self.movable(path)
        block, container = self.text_of(first, last), _at(self.tree, path[:-1])
        if isinstance(path[-1], int):
            self.paste(last, block)
            container[1].insert(path[-1] + 1, deepcopy(container[1][path[-1]]))
            return self.done((*path[:-1], path[-1] + 1))
        names = [key.text for key, _ in self.node(path[:-1]).pairs]
        name = next(one for number in range(2, 10_000) if (one := f"{path[-1]}_{number}") not in names)
        key = next(key for key, _ in self.node(path[:-1]).pairs if key.text == path[-1])
        at = key.start - self.lines.starts[first]
        self.paste(last, f"{block[:at]}{name}{block[at + key.end - key.start :]}")
        index = names.index(str(path[-1]))
        container[1].insert(index + 1, [("scalar", name, _SCALAR), deepcopy(container[1][index][1])])
        return self.done((*path[:-1], name))

    def move(self, operation: Mapping[str, Any]) -> TextPatch:
        """Move a block `up`, `down`, `in` (to the end of the step before it) or `out` (behind the step around it)."""
        path, way = path_of(operation["path"]), operation["way"]
        self.movable(path)
        above = self.node(path[:-1])
        names = [key.text for key, _ in above.pairs]
        index = path[-1] if isinstance(path[-1], int) else names.index(path[-1])
        if way in ("up", "down"):
            target = index - 1 if way == "up" else index + 2
            if not 0 <= target <= len(above.items) + len(above.pairs):
                raise Refused(f"this is the {'first' if way == 'up' else 'last'} one here")
            return self.place(path, path[:-1], target)
        if not isinstance(path[-1], int):
            raise Refused("what has a name stays where its kind belongs")
        if way == "in":
            if index == 0:
                raise Refused("there is no step before it that could take it")
            block = self.outline.at((*path[:-1], index - 1))
            slots = [slot for slot in block.slots if slot.of == "step" and slot.holds != "named"] if block else []
            found = [slot for slot in slots if self.root.at(slot.path) is not None]
            if not found:
                raise Refused("the step before it cannot hold others")
            slot = found[-1]
            return self.place(path, slot.path, self.length(slot.path))
        for length in range(len(path) - 2, 0, -1):
            outer = path[:length]
            if isinstance(outer[-1], int) and self.is_list_of_steps(outer[:-1]):
                return self.place(path, outer[:-1], outer[-1] + 1)
        raise Refused("there is no list of steps around it")

    def move_to(self, operation: Mapping[str, Any]) -> TextPatch:
        """Move a block to a place: before the one with `index` in the slot `to`."""
        path, to, index = path_of(operation["path"]), path_of(operation["to"]), int(operation["index"])
        self.movable(path)
        return self.place(path, to, index)

    def insert(self, operation: Mapping[str, Any]) -> TextPatch:
        """Write a new block, given as lines of YAML, into the slot `path`, before the one with `index`.

        In a slot whose entries have names, `name` is the one of the new entry.
        """
        path, index = path_of(operation["path"]), int(operation["index"])
        snippet, name = str(operation["yaml"]).rstrip("\n"), str(operation.get("name") or "")
        new = placed(snippet)
        if new is None or compose(snippet, "")[1] is not None or not snippet.strip():
            raise Refused("what is to be inserted is no YAML")
        node = self.root.at(path)
        if node is None and path == (INTERRUPTS,):
            return self.first_interrupt(name, snippet, new.plain())
        if node is not None and node.form == "map" and (name or not self.is_step_slot(path)):
            return self.insert_entry(path, index, name, snippet, new.plain())
        lines = _item(snippet.split("\n"))
        return self.done(self.insert_item(path, index, lines, new.plain()))

    def set(self, operation: Mapping[str, Any]) -> TextPatch:
        """Give the key `key` of the block at `path` a value; an empty one takes the key away."""
        path, key, value = path_of(operation["path"]), str(operation["key"]), str(operation["value"])
        node, written = self.node(path), _scalar(value)
        old = node.get(key) if node.form == "map" else None
        if not value.strip():
            return self.unset(path, node, key, old)
        fresh = placed(written)
        plain = fresh.plain() if fresh is not None else ("scalar", "", _SCALAR)
        if old is not None:
            if not (old.form == "scalar" or old.is_flow) or "\n" in self.lines.text[old.start : old.end]:
                raise Refused(f"'{key}' is written in several lines: {_BY_HAND}")
            gap = " " if old.start == old.end and self.lines.text[old.start - 1 : old.start] == ":" else ""
            self.edits.append(TextEdit(old.start, old.end, f"{gap}{written}"))
            _put(_at(self.tree, path), key, plain)
            return self.done(path)
        return self.add_key(path, node, key, written, plain)

    # What they are made of

    def node(self, path: Path) -> PlacedNode:
        found = self.root.at(path)
        if found is None:
            raise Refused("the text has changed: choose again")
        return found

    def movable(self, path: Path) -> tuple[int, int, int]:
        self.node(path)
        region = self.outline.region(path)
        block = self.outline.at(path)
        if region is None or block is None or block.is_fixed:
            raise Refused(f"it is the only step here, or written within a line: {_BY_HAND}")
        return region

    def is_list_of_steps(self, path: Path) -> bool:
        node = self.root.at(path)
        return node is not None and node.form == "list" and self.outline.at((*path, 0)) is not None

    def is_step_slot(self, path: Path) -> bool:
        return any(slot.path == path and slot.holds == ONE for slot in self.slots())

    def takes_names(self, path: Path) -> bool:
        """Return whether what is in a slot has names, as it is written."""
        node = self.root.at(path)
        return node is not None and node.form == "map" and not self.is_step_slot(path)

    def slots(self) -> list[Slot]:
        within = [slot for top in self.outline.blocks for block in top.all() for slot in block.slots]
        return [*self.outline.slots, *within]

    def length(self, path: Path) -> int:
        node = self.node(path)
        return len(node.items) if node.form == "list" else 1

    def text_of(self, first: int, last: int) -> str:
        return "\n".join(self.lines.lines[first:last])

    def cut(self, first: int, last: int) -> None:
        start, end = self.lines.starts[first], self.lines.place(last)
        if last >= self.lines.count and self.lines.is_open and start > 0:
            start -= 1  # with the end of the line before
        self.edits.append(TextEdit(start, end, ""))

    def paste(self, line: int, block: str) -> None:
        at = self.lines.place(line)
        is_behind = line >= self.lines.count and self.lines.is_open
        self.edits.append(TextEdit(at, at, f"\n{block}" if is_behind else f"{block}\n"))

    def place(self, path: Path, to: Path, index: int) -> TextPatch:
        """Move a block into a slot."""
        first, last, column = self.movable(path)
        if path == to[: len(path)]:
            raise Refused("a step cannot be put into itself")
        source, key = _at(self.tree, path[:-1]), path[-1]
        if to == path[:-1]:
            return self.place_near(path, index)
        if not isinstance(key, int):
            raise Refused("what has a name stays where its kind belongs")
        above = self.node(path[:-1])
        if len(above.items) == 1:
            raise Refused("this is the only one here: what is around it would be empty")
        if not any(slot.path == to and slot.of == "step" for slot in self.slots()):
            raise Refused("no step can be there")
        if self.root.at(to) is None:
            raise Refused(f"nothing is there yet: add '{to[-1]}' first")
        if self.takes_names(to):
            raise Refused("what is there has names: copy its text there by hand")
        moved = source[1][key]
        made = self.insert_item(to, index, self.lines.lines[first:last], deepcopy(moved), column)
        self.cut(first, last)
        source[1] = [one for one in source[1] if one is not moved]
        return self.done(_after(made, path))

    def place_near(self, path: Path, index: int) -> TextPatch:
        """Move a block within its list or map."""
        first, last, _ = self.movable(path)
        container, above = _at(self.tree, path[:-1]), self.node(path[:-1])
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
        found = self.outline.region(path)
        if found is None:
            raise Refused(f"it is written within a line: {_BY_HAND}")
        return found

    def insert_item(self, to: Path, index: int, lines: list[str], new: PlainTree, column: int = 0) -> Path:
        """Write an item, whose dash is at `column`, into a list of steps, or beside the only step of a slot."""
        node = self.node(to)
        if node.form == "list":
            if node.is_flow or not node.items:
                raise Refused(f"the list is written within brackets: {_BY_HAND}")
            index = max(0, min(index, len(node.items)))
            near = self.region((*to, min(index, len(node.items) - 1)))
            line = near[0] if index < len(node.items) else near[1]
            self.paste(line, _shifted(lines, near[2] - column))
            _at(self.tree, to)[1].insert(index, new)
            return (*to, index)
        index = min(1, max(0, index))
        old = _at(self.tree, to)
        if node.form == "map" and not node.is_flow and self.lines.begins(node.start):
            target = self.wrap(node)
            first, last = self.lines.region(node.start, node.end, target)
            self.paste(last if index else first, _shifted(lines, target - column))
        else:
            target = self.wrap_word(node, to)
            line = self.lines.of(max(node.end - 1, node.start))
            if index == 0:
                raise Refused("put it behind this step, then move it")
            self.paste(line + 1, _shifted(lines, target - column))
        _put(_at(self.tree, to[:-1]), to[-1], ["list", [new, old] if index == 0 else [old, new], _BLOCK])
        return (*to, index)

    def wrap(self, node: PlacedNode) -> int:
        """Make the only step of a slot the first item of a list; return the column of its dash."""
        column, first = self.lines.column(node.start), self.lines.of(node.start)
        self.edits.append(TextEdit(node.start, node.start, "- "))
        for line in range(first + 1, self.lines.of(max(node.end - 1, node.start)) + 1):
            if self.lines.lines[line].strip():
                self.edits.append(TextEdit(self.lines.starts[line], self.lines.starts[line], " " * INDENT))
        return column

    def wrap_word(self, node: PlacedNode, path: Path) -> int:
        """Make a step that stands behind its key, `do: dock`, the first item of a list below that."""
        key = next((key for key, value in self.node(path[:-1]).pairs if value is node), None)
        if key is None or "\n" in self.lines.text[key.start : node.end] or node.start == node.end:
            raise Refused(f"it cannot become a list: {_BY_HAND}")
        column = self.lines.column(key.start) + INDENT
        self.edits.append(TextEdit(key.end + 1, node.start, f"\n{' ' * column}- "))
        return column

    def insert_entry(self, path: Path, index: int, name: str, snippet: str, plain: PlainTree) -> TextPatch:
        """Write an entry with a name into a map of states, branches or interrupts."""
        node = self.node(path)
        names = [key.text for key, _ in node.pairs]
        if not name or _scalar(name) != name:
            raise Refused("it needs a name: letters, digits and underscores")
        if name in names:
            raise Refused(f"there is '{name}' already")
        if node.is_flow or not names:
            raise Refused(f"the map is written within brackets: {_BY_HAND}")
        index = max(0, min(index, len(names)))
        near = self.region((*path, names[min(index, len(names) - 1)]))
        lines = [f"{name}:", *(f"{' ' * INDENT}{line}" if line else "" for line in snippet.split("\n"))]
        self.paste(near[0] if index < len(names) else near[1], _shifted(lines, near[2]))
        _at(self.tree, path)[1].insert(index, [("scalar", name, _SCALAR), plain])
        return self.done((*path, name))

    def first_interrupt(self, name: str, snippet: str, plain: PlainTree) -> TextPatch:
        """Write the key `interrupts` with its first entry before what the mission does."""
        keys = [key.text for key, _ in self.root.pairs]
        body = next((key for key in ("do", "machine") if key in keys), "")
        if not body or not name or _scalar(name) != name:
            raise Refused("it needs a name, and a mission that does something")
        lines = [f"{INTERRUPTS}:", f"{' ' * INDENT}{name}:"]
        lines += [f"{' ' * 2 * INDENT}{line}" if line else "" for line in snippet.split("\n")]
        first, _, column = self.region((body,))
        self.paste(first, f"{_shifted(lines, column)}\n")
        inner = ["map", [[("scalar", name, _SCALAR), plain]], _BLOCK]
        self.tree[1].insert(keys.index(body), [("scalar", INTERRUPTS, _SCALAR), inner])
        return self.done((INTERRUPTS, name))

    def add_key(self, path: Path, node: PlacedNode, key: str, written: str, plain: PlainTree) -> TextPatch:
        """Write a key that was not there below the others of a step."""
        lines, pair = self.lines, [("scalar", key, _SCALAR), plain]
        if node.form == "map" and node.is_flow:
            if not node.pairs:
                raise Refused(f"the map is empty: {_BY_HAND}")
            end = max(node.pairs[-1][1].end, node.pairs[-1][0].end + 1)
            self.edits.append(TextEdit(end, end, f", {key}: {written}"))
            _at(self.tree, path)[1].append(pair)
            return self.done(path)
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
            self.paste(last, f"{' ' * column}{key}: {written}")
            _at(self.tree, path)[1].insert(index, pair)
            return self.done(path)
        if node.form != "scalar" or "\n" in lines.text[node.start : node.end] or not node.text:
            raise Refused(f"this step has no keys: {_BY_HAND}")
        if not lines.text[lines.starts[lines.of(node.start)] : node.start].strip(" -") == "":
            raise Refused(f"this step is written behind its key: {_BY_HAND}")
        self.edits.append(TextEdit(node.end, node.end, ":"))
        self.paste(lines.of(node.start) + 1, f"{' ' * lines.column(node.start)}{key}: {written}")
        made = ["map", [[("scalar", node.text, node.mark), ("scalar", "", _SCALAR)], pair], _BLOCK]
        _put(_at(self.tree, path[:-1]), path[-1], made)
        return self.done(path)

    def unset(self, path: Path, node: PlacedNode, key: str, old: PlacedNode | None) -> TextPatch:
        """Take a key of a step away, or the value of its word."""
        if old is None:
            raise Refused(f"there is no '{key}'")
        names = [name.text for name, _ in node.pairs]
        at = names.index(key)
        if at == 0:
            if old.form != "scalar" or "\n" in self.lines.text[old.start : old.end]:
                raise Refused(f"'{key}' is the word of the step: {_BY_HAND}")
            start = node.pairs[0][0].end + 1
            self.edits.append(TextEdit(start, old.end, ""))
            _put(_at(self.tree, path), key, ("scalar", "", _SCALAR))
            return self.done(path)
        if node.is_flow:
            before = node.pairs[at - 1]
            self.edits.append(TextEdit(max(before[1].end, before[0].end + 1), old.end, ""))
        else:
            first, last, _ = self.region((*path, key))
            self.cut(first, last)
        _take(_at(self.tree, path), key)
        return self.done(path)

    def done(self, chosen: Path) -> TextPatch:
        """Return the change, if it does what was meant and nothing else."""
        edits = sorted(self.edits, key=lambda edit: (edit.start, edit.end))
        if any(other.start < one.end for one, other in pairwise(edits)):
            raise Refused(f"what is moved and where it goes overlap: {_BY_HAND}")
        made = TextPatch(tuple(edits), chosen)
        root = placed(made.applied(self.lines.text))
        if root is None or root.plain() != self.tree:
            raise Refused(f"this cannot be done without changing something else: {_BY_HAND}")
        return made


OPERATIONS: Mapping[str, Callable[[_Patch, Mapping[str, Any]], TextPatch]] = MappingProxyType(
    {
        "delete": _Patch.delete,
        "duplicate": _Patch.duplicate,
        "insert": _Patch.insert,
        "move": _Patch.move,
        "move_to": _Patch.move_to,
        "set": _Patch.set,
    }
)


# Trees without places


def _at(tree: PlainTree, path: Path) -> PlainTree:
    for key in path:
        tree = tree[1][key] if isinstance(key, int) else next(value for name, value in tree[1] if name[1] == key)
    return tree


def _put(tree: PlainTree, key: str | int, value: PlainTree) -> None:
    if isinstance(key, int):
        tree[1][key] = value
    else:
        next(pair for pair in tree[1] if pair[0][1] == key)[1] = value


def _take(tree: PlainTree, key: str | int) -> None:
    if isinstance(key, int):
        del tree[1][key]
    else:
        tree[1].remove(next(pair for pair in tree[1] if pair[0][1] == key))


# Texts


def path_of(given: Any) -> Path:
    """Return a path that came from outside.

    Raises:
        Refused: if it is none.
    """
    if not isinstance(given, list | tuple) or not all(type(key) in (str, int) for key in given):
        raise Refused("this is no place in a mission")
    return tuple(given)


def _after(made: Path, gone: Path) -> Path:
    """Return a path as it is when an item of a list is gone."""
    above, index = gone[:-1], gone[-1]
    at = made[len(above)] if len(made) > len(above) and made[: len(above)] == above else None
    if isinstance(at, int) and isinstance(index, int) and at > index:
        return (*above, at - 1, *made[len(gone) :])
    return made


def _item(lines: list[str]) -> list[str]:
    """Return the lines of a node as an item of a list."""
    return [f"- {lines[0]}", *(f"{' ' * INDENT}{line}" if line else "" for line in lines[1:])]


def _shifted(lines: list[str], columns: int) -> str:
    """Return lines that begin some columns further right or left."""
    if columns >= 0:
        return "\n".join(f"{' ' * columns}{line}" if line.strip() else line for line in lines)
    return "\n".join(line[min(-columns, len(line) - len(line.lstrip(" "))) :] for line in lines)


def _scalar(value: str) -> str:
    """Return a value as YAML in one line, in quotes only if it needs them."""
    value = " ".join(value.split())
    node = placed(f"- {value}\n") if value else None
    item = node.items[0] if node is not None and node.form == "list" and len(node.items) == 1 else None
    is_value = item is not None and (item.form == "scalar" or item.is_flow) and item.mark[:2] == _BLOCK
    is_whole = item is not None and item.end == len(value) + 2
    return value if is_value and is_whole else json.dumps(value, ensure_ascii=False)
