"""Changes of a mission's outline as changes of its text: every byte that does not belong to the change stays.

`change` says which parts of a text to replace. What comes of it is parsed again: if it is not exactly the tree that was
meant, the change is refused, and nobody has lost anything.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import deepcopy
from types import MappingProxyType
from typing import Any

from rbxcompose.base.requests import Refused
from rbxcompose.manifest.yaml_nodes import compose
from rbxcompose.tools.mission_editor.flow import (
    delete_in_brackets,
    in_brackets,
    insert_in_brackets,
    is_in_brackets,
    order_in_brackets,
)
from rbxcompose.tools.mission_editor.outline import INTERRUPTS, MissionOutline
from rbxcompose.tools.mission_editor.parts import add_part, rename
from rbxcompose.tools.mission_editor.patch import (
    BY_HAND,
    SCALAR_MARK,
    Patch,
    TextPatch,
    as_item,
    path_of,
    scalar_text,
    take_out,
    tree_at,
)
from rbxcompose.tools.mission_editor.values import set_value
from rbxcompose.tools.mission_editor.yaml_places import Path, PlainTree, placed


def change(text: str, operation: Mapping[str, Any]) -> TextPatch:
    """Return how an operation changes a text: its `op`, the `path` of a block, and what else it needs.

    Raises:
        Refused: if that is impossible, or cannot be done without touching anything else.
    """
    outline = MissionOutline(text)
    if outline.root is None:
        raise Refused(f"the text cannot be read: {BY_HAND} first")
    try:
        made = OPERATIONS[operation["op"]](_Operations(outline, outline.root), operation)
    except (LookupError, StopIteration, TypeError, ValueError) as error:
        raise Refused("this is no change of a mission") from error
    return made


class _Operations(Patch):
    """The operations: what each changes."""

    def delete(self, operation: Mapping[str, Any]) -> TextPatch:
        """Take a step, a state or an interrupt out; with the last one, a place that may be empty, such as `else`."""
        path = path_of(operation["path"])
        if (place := self.emptied_place(path)) is not None:
            return self.delete_place(place)
        if self.is_block_in_brackets(path):
            return delete_in_brackets(self, path)
        first, last, _ = self.movable(path)
        above = self.node(path[:-1])
        if len(above.items) + len(above.pairs) == 1:
            raise Refused("this is the only one here: delete what is around it")
        self.cut(first, last)
        take_out(tree_at(self.tree, path[:-1]), path[-1])
        if isinstance(path[-1], int):
            return self.done((*path[:-1], max(0, path[-1] - 1)))
        names = [key.text for key, _ in above.pairs]
        at = names.index(path[-1])
        return self.done((*path[:-1], names[at - 1 if at > 0 else 1]))

    def emptied_place(self, path: Path) -> Path | None:
        """Return the place that goes with a block, because it is the only one in it and nothing need be there."""
        optional = [slot.path for slot in self.slots() if slot.is_optional and slot.is_there]
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
        """Write a block once more below itself; a named one gets another name."""
        path = path_of(operation["path"])
        if self.is_block_in_brackets(path):
            return self.duplicate_in_brackets(path)
        first, last, _ = self.movable(path)
        block, container = self.text_of(first, last), tree_at(self.tree, path[:-1])
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
        container[1].insert(index + 1, [("scalar", name, SCALAR_MARK), deepcopy(container[1][index][1])])
        return self.done((*path[:-1], name))

    def place(self, path: Path, to: Path, index: int) -> TextPatch:
        """Move a block into a slot; in brackets, only among those beside it."""
        if not self.is_block_in_brackets(path):
            return super().place(path, to, index)
        if to != path[:-1]:
            raise Refused(f"it is written in brackets, and moves only within these: {BY_HAND}")
        return order_in_brackets(self, path, index)

    def insert_entry(self, path: Path, index: int, name: str, snippet: str, plain: PlainTree) -> TextPatch:
        """Write an entry with a name into a map, in lines or in brackets as the others."""
        node, new = self.node(path), placed(snippet)
        if not node.is_flow or new is None:
            return super().insert_entry(path, index, name, snippet, plain)
        if not name or scalar_text(name) != name or any(key.text == name for key, _ in node.pairs):
            raise Refused("it needs a name of its own: letters, digits and underscores")
        text, written = in_brackets(new), placed(f"[{in_brackets(new)}]")
        plain = written.items[0].plain() if written is not None else plain
        insert_in_brackets(self, path, index, f"{name}: {text}", [("scalar", name, SCALAR_MARK), plain])
        return self.done((*path, name))

    def is_block_in_brackets(self, path: Path) -> bool:
        """Return whether a block is in brackets, beside others or alone."""
        return is_in_brackets(self, path) and self.outline.at(path) is not None

    def duplicate_in_brackets(self, path: Path) -> TextPatch:
        """Write an entry in brackets once more behind itself."""
        above, container = self.node(path[:-1]), tree_at(self.tree, path[:-1])
        if isinstance(path[-1], int):
            item = above.items[path[-1]]
            text, plain = self.lines.text[item.start : item.end], deepcopy(container[1][path[-1]])
            return self.done((*path[:-1], insert_in_brackets(self, path[:-1], path[-1] + 1, text, plain)))
        names = [key.text for key, _ in above.pairs]
        name = next(one for number in range(2, 10_000) if (one := f"{path[-1]}_{number}") not in names)
        at = names.index(path[-1])
        key, value = above.pairs[at]
        text = f"{name}{self.lines.text[key.end : max(value.end, key.end)]}"
        plain = [("scalar", name, SCALAR_MARK), deepcopy(container[1][at][1])]
        insert_in_brackets(self, path[:-1], at + 1, text, plain)
        return self.done((*path[:-1], name))

    def move(self, operation: Mapping[str, Any]) -> TextPatch:
        """Move a block `up`, `down`, `in` (to the end of the step before it) or `out` (behind the step around it)."""
        path, way = path_of(operation["path"]), operation["way"]
        if not self.is_block_in_brackets(path):
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
            text = in_brackets(new)
            written = placed(f"[{text}]")
            plain = written.items[0].plain() if written is not None else new.plain()
            return self.done((*path, insert_in_brackets(self, path, index, text, plain)))
        if node is not None and self.takes_names(path):
            return self.insert_entry(path, index, name, snippet, new.plain())
        lines = as_item(snippet.split("\n"))
        return self.done(self.insert_item(path, index, lines, new.plain()))


OPERATIONS: Mapping[str, Callable[[_Operations, Mapping[str, Any]], TextPatch]] = MappingProxyType(
    {
        "add": add_part,
        "delete": _Operations.delete,
        "duplicate": _Operations.duplicate,
        "insert": _Operations.insert,
        "move": _Operations.move,
        "move_to": _Operations.move_to,
        "rename": rename,
        "set": set_value,
    }
)
