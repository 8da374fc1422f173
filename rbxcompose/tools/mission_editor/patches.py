"""Changes of a mission's outline as changes of its text: every byte that does not belong to the change stays.

`change` says which parts of a text to replace. What comes of it is parsed again: if it is not exactly the tree that was
meant, the change is refused, and nobody has lost anything.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from copy import deepcopy
from textwrap import dedent
from types import MappingProxyType
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.requests import Refused
from rbxcompose.manifest.yaml_nodes import compose
from rbxcompose.missions.kinds.machine import RESULTS
from rbxcompose.missions.program.parts import FINISHED
from rbxcompose.missions.program.program import RESTART
from rbxcompose.tools.mission_editor.outline import INTERRUPT, INTERRUPTS, STATE, MissionOutline, Slot
from rbxcompose.tools.mission_editor.yaml_places import (
    BLOCK_MARK,
    INDENT,
    SCALAR_MARK,
    Path,
    PlacedNode,
    PlainTree,
    TextPatch,
    YamlPatch,
    pair_in,
    placed,
    put_into,
    take_out,
    tree_at,
)

BY_HAND = "change it in the text"
STEP = "wait: 1 s"
"""What a new part does until somebody changes it: nothing that moves the robot."""
NEVER = "false"  # until somebody writes when an interrupt cuts the mission short
LINE, LINES, TEXT, FIXED = "line", "lines", "text", "fixed"
"""How a value is edited: in a line of YAML, in several, as a text of several lines, or not in a form."""


def change(text: str, operation: Mapping[str, Any]) -> TextPatch:
    """Return how an operation changes a text: its `op`, the `path` of a block, and what else it needs.

    Raises:
        Refused: if that is impossible, or cannot be done without touching anything else.
    """
    outline = MissionOutline(text)
    if outline.root is None:
        raise Refused(f"the text cannot be read: {BY_HAND} first")
    try:
        made = OPERATIONS[operation["op"]](_Patch(outline, outline.root), operation)
    except (LookupError, StopIteration, TypeError, ValueError) as error:
        raise Refused("this is no change of a mission") from error
    return made


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


class _Patch(YamlPatch):
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
        """Move a block into a slot; in brackets, only among those beside it."""
        if self.is_block_in_brackets(path):
            if to != path[:-1]:
                raise Refused(f"it is written in brackets, and moves only within these: {BY_HAND}")
            return self.order_in_brackets(path, index)
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
        keys: list[str | int] = [*range(len(above.items))] or [*_keys(above)]
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
        """Write an entry with a name into a map of states, branches or interrupts, in lines or in brackets."""
        node, new = self.node(path), placed(snippet)
        names = _keys(node)
        if node.is_flow and new is not None:
            if not name or scalar_text(name) != name or name in names:
                raise Refused("it needs a name of its own: letters, digits and underscores")
            text, plain = _bracketed(new)
            self.insert_in_brackets(path, index, f"{name}: {text}", [("scalar", name, SCALAR_MARK), plain])
            return self.done((*path, name))
        _require_new(name, names)
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
        keys = _keys(self.root)
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
        if lines.text[lines.starts[lines.of(node.start)] : node.start].strip(" -"):
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
        names = _keys(node)
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

    # Operations

    def delete(self, operation: Mapping[str, Any]) -> TextPatch:
        """Take a step, a state or an interrupt out; with the last one, a place that may be empty, such as `else`."""
        path = path_of(operation["path"])
        if (place := self.emptied_place(path)) is not None:
            return self.delete_place(place)
        region = None if self.is_block_in_brackets(path) else self.movable(path)
        above, at = self.node(path[:-1]), self.index(path)
        if len(above.items) + len(above.pairs) == 1:
            raise Refused("this is the only one here: delete what is around it")
        if region is None:
            self.delete_in_brackets(above, at)
        else:
            self.cut(*region[:2])
        take_out(tree_at(self.tree, path[:-1]), path[-1])
        if isinstance(path[-1], int):
            return self.done((*path[:-1], max(0, at - 1)))
        return self.done((*path[:-1], _keys(above)[at - 1 if at > 0 else 1]))

    def delete_in_brackets(self, above: PlacedNode, at: int) -> None:
        """Take an entry out, with the comma before or behind it."""
        spans = _spans(above)
        start, end = (spans[at - 1][1], spans[at][1]) if at > 0 else (spans[0][0], spans[1][0])
        between = self.lines.text[start : spans[at][0]] if at > 0 else self.lines.text[spans[0][1] : end]
        if "#" in between:
            raise Refused(f"there is a comment beside it: {BY_HAND}")
        self.replace(start, end, "")

    def emptied_place(self, path: Path) -> Path | None:
        """Return the place that goes with a block, because it is the only one in it and nothing need be there."""
        optional = [slot.path for slot in self.outline.all_slots() if slot.is_optional and slot.is_there]
        if path in optional and self.outline.at(path) is not None:
            return path
        above = self.root.at(path[:-1]) if path else None
        is_alone = above is not None and len(above.items) + len(above.pairs) == 1
        return path[:-1] if is_alone and path[:-1] in optional and self.outline.at(path) is not None else None

    def delete_place(self, place: Path) -> TextPatch:
        """Take a place away, with its key."""
        first, last, _ = self.region(place)
        self.cut(first, last)
        take_out(tree_at(self.tree, place[:-1]), place[-1])
        others = (block.path for block in self.outline.blocks if block.path[: len(place)] != place)
        return self.done(place[:-1] or next(others, ()))

    def duplicate(self, operation: Mapping[str, Any]) -> TextPatch:
        """Write a block once more below itself; it and the steps in it get other names where they have one."""
        path = path_of(operation["path"])
        region = None if self.is_block_in_brackets(path) else self.movable(path)
        above, at, container = self.node(path[:-1]), self.index(path), tree_at(self.tree, path[:-1])
        copied = deepcopy(container[1][at])
        start, end = (self.lines.starts[region[0]], self.lines.starts[region[1]] - 1) if region is not None else (0, 0)
        if isinstance(path[-1], int):
            if region is None:
                item = above.items[at]
                text = self.copied(path, item.start, item.end, copied)
                self.insert_in_brackets(path[:-1], at + 1, text, copied)
            else:
                self.paste(region[1], self.copied(path, start, end, copied))
                container[1].insert(at + 1, copied)
            return self.done((*path[:-1], at + 1))
        name, (key, value) = _free(str(path[-1]), _keys(above)), above.pairs[at]
        copied[0] = ("scalar", name, SCALAR_MARK)
        if region is None:
            text = f"{name}{self.copied(path, key.end, max(value.end, key.end), copied[1])}"
            self.insert_in_brackets(path[:-1], at + 1, text, copied)
        else:
            text = f"{self.lines.text[start : key.start]}{name}{self.copied(path, key.end, end, copied[1])}"
            self.paste(region[1], text)
            container[1].insert(at + 1, copied)
        return self.done((*path[:-1], name))

    def copied(self, path: Path, start: int, end: int, copy: PlainTree) -> str:
        """Return a part of the text that holds a block, with other names for its steps, in the tree `copy` as well."""
        steps = [block for top in self.outline.blocks for block in top.all() if block.kind not in (STATE, INTERRUPT)]
        names, inside = [step.name for step in steps if step.name], []
        for step in steps:
            if step.name and step.path[: len(path)] == path:
                names.append(_free(step.name, names))
                inside.append((self.node((*step.path, "name")), names[-1]))
                put_into(tree_at(copy, step.path[len(path) :]), "name", ("scalar", names[-1], SCALAR_MARK))
        text = ""
        for node, name in sorted(inside, key=lambda one: one[0].start):
            text, start = f"{text}{self.lines.text[start : node.start]}{name}", node.end
        return f"{text}{self.lines.text[start:end]}"

    def order_in_brackets(self, path: Path, index: int) -> TextPatch:
        """Move an entry before the one with `index`."""
        above, at = self.node(path[:-1]), self.index(path)
        spans, container = _spans(above), tree_at(self.tree, path[:-1])
        index = max(0, min(index, len(spans)))
        if index in (at, at + 1):
            raise Refused("it is there already")
        order = [number for number in range(len(spans)) if number != at]
        target = index - 1 if index > at else index
        order.insert(target, at)
        texts = [self.lines.text[start:end] for start, end in spans]
        for (start, end), number, turn in zip(spans, order, range(len(spans)), strict=True):
            if number != turn:
                self.replace(start, end, texts[number])
        container[1] = [container[1][number] for number in order]
        return self.done((*path[:-1], target if isinstance(path[-1], int) else path[-1]))

    def insert_in_brackets(self, to: Path, index: int, text: str, new: PlainTree) -> int:
        """Write an entry in brackets, and return its index; `new` is what it is in the tree of the list or the map."""
        above = self.node(to)
        spans = _spans(above)
        index = max(0, min(index, len(spans)))
        if not spans:
            self.replace(above.end - 1, above.end - 1, text)
        elif index < len(spans):
            self.replace(spans[index][0], spans[index][0], f"{text}, ")
        else:
            self.replace(spans[-1][1], spans[-1][1], f", {text}")
        tree_at(self.tree, to)[1].insert(index, new)
        return index

    def is_block_in_brackets(self, path: Path) -> bool:
        """Return whether a block is in brackets, beside others or alone."""
        above = self.root.at(path[:-1]) if path else None
        return above is not None and above.is_flow and self.outline.at(path) is not None

    def index(self, path: Path) -> int:
        """Return where an item or an entry is among those beside it."""
        self.node(path)
        return path[-1] if isinstance(path[-1], int) else _keys(self.node(path[:-1])).index(path[-1])

    def move(self, operation: Mapping[str, Any]) -> TextPatch:
        """Move a block `up`, `down`, `in` (to the end of the step before it) or `out` (behind the step around it)."""
        path, way = path_of(operation["path"]), operation["way"]
        if not self.is_block_in_brackets(path):
            self.movable(path)
        above, index = self.node(path[:-1]), self.index(path)
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
            node = self.node(found[-1].path)
            return self.place(path, found[-1].path, len(node.items) if node.form == "list" else 1)
        for length in range(len(path) - 2, 0, -1):
            outer = path[:length]
            if isinstance(outer[-1], int) and self.is_list_of_steps(outer[:-1]):
                return self.place(path, outer[:-1], outer[-1] + 1)
        raise Refused("there is no list of steps around it")

    def move_to(self, operation: Mapping[str, Any]) -> TextPatch:
        """Move a block to a place: before the one with `index` in the slot `to`."""
        path, to, index = path_of(operation["path"]), path_of(operation["to"]), int(operation["index"])
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
        if node is not None and node.form == "list" and node.is_flow:
            return self.done((*path, self.insert_in_brackets(path, index, *_bracketed(new))))
        if node is not None and self.takes_names(path):
            return self.insert_entry(path, index, name, snippet, new.plain())
        lines = as_item(snippet.split("\n"))
        return self.done(self.insert_item(path, index, lines, new.plain()))

    def add(self, operation: Mapping[str, Any]) -> TextPatch:
        """Add a part to the slot `path`, before the one with `index`, with a name that is not taken.

        A state is put between the one before it and where that one leads to.
        """
        path, index = path_of(operation["path"]), int(operation["index"])
        slot = next((one for one in self.outline.all_slots() if one.path == path), None)
        if slot is None:
            raise Refused("nothing can be added there")
        if not slot.has_names:
            return self.add_key_of(slot)
        node = self.root.at(path)
        names = _keys(node) if node is not None else []
        index = max(0, min(index, len(names)))
        name = _free(f"new_{slot.part}", names)
        body = STEP if slot.of not in (STATE, INTERRUPT) else f"do:\n{' ' * INDENT}{STEP}"
        if slot.of == INTERRUPT:
            body = f"when: {NEVER}\n{body}"
        if slot.of == STATE and node is not None:
            body = f"{body}\nnext: {self.put_between(node, index, name, path)}"
        new = placed(body)
        if new is None:
            raise Refused("nothing can be added there")
        if node is None and path == (INTERRUPTS,):
            return self.first_interrupt(name, body, new.plain())
        return self.insert_entry(path, index, name, body, new.plain())

    def rename(self, operation: Mapping[str, Any]) -> TextPatch:
        """Give a state, an interrupt, a case or a branch another `name`; transitions lead to the state as before."""
        path, name = path_of(operation["path"]), str(operation["name"]).strip()
        above = self.node(path[:-1])
        pair = next((pair for pair in above.pairs if pair[0].text == path[-1]), None)
        if pair is None or not self.takes_names(path[:-1]):
            raise Refused("this has no name of its own")
        _require_new(name, _keys(above))
        self.replace(pair[0].start, pair[0].end, name)
        pair_in(tree_at(self.tree, path[:-1]), path[-1])[0] = ("scalar", name, SCALAR_MARK)
        if any(slot.path == path[:-1] and slot.of == STATE for slot in self.outline.all_slots()):
            for leading in _leading(self.node(path[:-2]), (*path[:-2],)):
                self.lead_to(leading, str(path[-1]), name, path)
            for leading in _restarting(self.root):
                self.lead_to(leading, str(path[-1]), name)
        return self.done((*path[:-1], name))

    def add_key_of(self, slot: Slot) -> TextPatch:
        """Write the key of a place in which nothing is yet, such as `else`, below the others of its step."""
        if slot.is_there:
            raise Refused("something is there already: add a step to it")
        path, key = slot.path[:-1], str(slot.path[-1])
        node = self.node(path)
        if node.form != "map" or node.is_flow:
            raise Refused(f"it is written within a line: {BY_HAND}")
        column = self.lines.column(node.pairs[0][0].start)
        last = self.lines.region(node.start, node.end, column)[1]
        self.paste(last, f"{' ' * column}{key}:\n{' ' * (column + INDENT)}{STEP}")
        new = placed(STEP)
        if new is not None:
            tree_at(self.tree, path)[1].append([("scalar", key, SCALAR_MARK), new.plain()])
        return self.done(slot.path)

    # Transitions

    def put_between(self, states: PlacedNode, index: int, name: str, path: Path) -> str:
        """Have what leads on lead to a new state; return where it led to."""
        machine = self.node(path[:-1])
        if index == 0 or not states.pairs:
            leading, at = machine.get("start"), (*path[:-1], "start")
        else:
            key, state = states.pairs[index - 1]
            leading, at = state.get("next"), (*path, key.text, "next")
            if leading is not None and leading.form == "map":
                leading, at = leading.get(RESULTS[0]), (*at, RESULTS[0])
        if leading is None or leading.form != "scalar" or leading.mark != SCALAR_MARK or not leading.text:
            return FINISHED
        self.lead_to((leading, at), leading.text, name)
        return leading.text

    def lead_to(self, leading: tuple[PlacedNode, Path], old: str, name: str, renamed: Path = ()) -> None:
        """Replace the name of a state where it is named; its own path has its new name already."""
        node, path = leading
        if node.form != "scalar" or node.text != old:
            return
        if node.mark != SCALAR_MARK:
            raise Refused(f"a transition to it is written in quotes: {BY_HAND}")
        self.replace(node.start, node.end, name)
        if renamed and path[: len(renamed)] == renamed:
            path = (*renamed[:-1], name, *path[len(renamed) :])
        pair_in(tree_at(self.tree, path[:-1]), path[-1])[1] = ("scalar", name, SCALAR_MARK)

    # Values of steps

    def set(self, operation: Mapping[str, Any]) -> TextPatch:
        """Give a key of the block at `path`, or of the map `within` it, a value; an empty one takes the key away."""
        path, within = path_of(operation["path"]), path_of(operation.get("within", ()))
        key, value = str(operation["key"]), str(operation["value"])
        where, step = (*path, *within), self.node(path)
        if not value.strip():
            node = self.node(where)
            return self.unset(where, node, key, node.get(key) if node.form == "map" else None, path)
        made = _written(value, str(operation.get("shape") or LINE))
        inside = self.root.at(where)
        if within and (inside is None or (inside.form == "scalar" and not inside.text)):
            entry = f"{key}:{made.behind(0)}".split("\n")
            made = Written("", tuple(entry), ["map", [[("scalar", key, SCALAR_MARK), made.plain]], BLOCK_MARK])
            key, where = str(within[-1]), path
        if step.form == "scalar" and where == path and key == step.text:
            return self.after_word(path, step, made)
        node = self.node(where)
        pair = next((pair for pair in node.pairs if pair[0].text == key), None)
        if pair is None:
            return self.add_key(where, node, key, made, path)
        if pair[1].form == "alias":
            raise Refused(f"'{key}' repeats another value: {BY_HAND}")
        self.replace_value(node, *pair, made)
        put_into(tree_at(self.tree, where), key, made.plain)
        return self.done(path)

    def after_word(self, path: Path, step: PlacedNode, made: Written) -> TextPatch:
        """Give a step that is only a word its value."""
        column = self.lines.column(step.start)
        self.replace(step.end, step.end, f": {made.head}" if made.head else ":")
        if made.lines:
            self.paste(self.lines.of(step.start) + 1, made.below(column + INDENT))
        entry = [("scalar", step.text, step.mark), made.plain]
        put_into(tree_at(self.tree, path[:-1]), path[-1], ["map", [entry], BLOCK_MARK])
        return self.done(path)

    def replace_value(self, node: PlacedNode, key: PlacedNode, old: PlacedNode, made: Written) -> None:
        """Write a value in place of another one behind its key."""
        lines, text = self.lines, self.lines.text
        colon = text.find(":", key.end) + 1
        column = lines.column(key.start)
        if made.lines and node.is_flow:
            raise Refused(f"'{key.text}' is written within a line: {BY_HAND}")
        if old.form in ("list", "map") and not old.is_flow:
            if not lines.begins(old.start):
                raise Refused(f"'{key.text}' has an anchor or a tag: {BY_HAND}")
            first, last = lines.region(old.start, old.end, lines.column(old.start))
            if made.lines and not made.head:
                self.cut(first, last)
                self.paste(first, made.below(lines.column(old.start)))
                return
            if any(map(lines.is_comment, range(first, last))):
                raise Refused(f"'{key.text}' has comments in it: {BY_HAND}")
            self.cut(first, last)
            self.replace(colon, colon, f" {made.head}")
            if made.lines:
                self.paste(first, made.below(column + INDENT))
            return
        gap = " " if old.start == old.end and text[old.start - 1 : old.start] == ":" else ""
        if not made.lines:
            self.replace(old.start, old.end, f"{gap}{made.head}")
            return
        self.replace(old.start if made.head else colon, old.end, f"{gap}{made.head}" if made.head else "")
        below = lines.of(max(old.end - 1, old.start)) + 1
        self.paste(below, made.below(column + INDENT))


OPERATIONS: Mapping[str, Callable[[_Patch, Mapping[str, Any]], TextPatch]] = MappingProxyType(
    {
        "add": _Patch.add,
        "delete": _Patch.delete,
        "duplicate": _Patch.duplicate,
        "insert": _Patch.insert,
        "move": _Patch.move,
        "move_to": _Patch.move_to,
        "rename": _Patch.rename,
        "set": _Patch.set,
    }
)


def _free(word: str, names: list[str]) -> str:
    return next(one for number in range(1, 10_000) if (one := word if number == 1 else f"{word}_{number}") not in names)


def _require_new(name: str, names: list[str]) -> None:
    if not name or scalar_text(name) != name:
        raise Refused("it needs a name: letters, digits and underscores")
    if name in names:
        raise Refused(f"there is '{name}' already")


def _leading(machine: PlacedNode, path: Path) -> Iterator[tuple[PlacedNode, Path]]:
    """Yield what names a state of a machine, and its path."""
    if (start := machine.get("start")) is not None:
        yield start, (*path, "start")
    states = machine.get("states")
    for key, state in states.pairs if states is not None else ():
        following, at = state.get("next") if state.form == "map" else None, (*path, "states", key.text, "next")
        if following is None:
            continue
        if following.form == "scalar":
            yield following, at
        for outcome, target in following.pairs:
            yield target, (*at, outcome.text)


def _restarting(root: PlacedNode) -> Iterator[tuple[PlacedNode, Path]]:
    """Yield what names the state, or the step, at which the mission restarts after an interrupt, and its path."""
    interrupts = root.get(INTERRUPTS)
    for key, _ in interrupts.pairs if interrupts is not None else ():
        path = (INTERRUPTS, key.text, "afterwards", RESTART)
        if (node := root.at(path)) is not None:
            yield node, path


def _bracketed(node: PlacedNode) -> tuple[str, PlainTree]:
    """Return a node as it is written in brackets, and what it is then."""
    text = in_brackets(node)
    written = placed(f"[{text}]")
    return text, written.items[0].plain() if written is not None else node.plain()


def in_brackets(node: PlacedNode) -> str:
    """Return a node in one line, as it is written in brackets.

    Raises:
        Refused: if it has an anchor, a tag, or repeats another one.
    """
    if node.form == "alias" or node.mark[:2] != (None, None):
        raise Refused(f"it cannot be written within a line: {BY_HAND}")
    if node.form == "list":
        return f"[{', '.join(map(in_brackets, node.items))}]"
    if node.form == "map":
        return f"{{{', '.join(f'{in_brackets(key)}: {in_brackets(value)}'.rstrip() for key, value in node.pairs)}}}"
    found = placed(f"[{node.text}]") if "\n" not in node.text else None
    is_same = found is not None and len(found.items) == 1 and found.items[0].plain() == node.plain()
    return node.text if is_same or not node.text else json.dumps(node.text, ensure_ascii=False)


def _keys(above: PlacedNode) -> list[str]:
    return [key.text for key, _ in above.pairs]


def _spans(above: PlacedNode) -> list[tuple[int, int]]:
    """Return where the entries begin and end."""
    if above.form == "list":
        return [(item.start, item.end) for item in above.items]
    return [(key.start, max(value.end, key.end)) for key, value in above.pairs]


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
