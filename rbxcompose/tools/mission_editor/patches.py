"""Changes of a mission's outline as changes of its text: every byte that does not belong to the change stays.

`change` says which parts of a text to replace. What comes of it is parsed again: if it is not exactly the tree that was
meant, the change is refused, and nobody has lost anything.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from copy import deepcopy
from types import MappingProxyType
from typing import Any

from rbxcompose.base.requests import Refused
from rbxcompose.manifest.yaml_nodes import compose
from rbxcompose.missions.kinds.machine import RESULTS
from rbxcompose.missions.program.parts import FINISHED
from rbxcompose.missions.program.program import RESTART
from rbxcompose.tools.mission_editor.outline import INTERRUPT, INTERRUPTS, STATE, MissionOutline, Slot
from rbxcompose.tools.mission_editor.patch import BY_HAND, Patch, as_item, path_of, scalar_text
from rbxcompose.tools.mission_editor.values import set_value
from rbxcompose.tools.mission_editor.yaml_places import (
    INDENT,
    SCALAR_MARK,
    Path,
    PlacedNode,
    PlainTree,
    TextPatch,
    pair_in,
    placed,
    take_out,
    tree_at,
)

STEP = "wait: 1 s"
"""What a new part does until somebody changes it: nothing that moves the robot."""
NEVER = "false"  # until somebody writes when an interrupt cuts the mission short


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
        """Write a block once more below itself; a named one gets another name."""
        path = path_of(operation["path"])
        region = None if self.is_block_in_brackets(path) else self.movable(path)
        above, at, container = self.node(path[:-1]), self.index(path), tree_at(self.tree, path[:-1])
        copied = deepcopy(container[1][at])
        if isinstance(path[-1], int):
            if region is None:
                item = above.items[at]
                self.insert_in_brackets(path[:-1], at + 1, self.lines.text[item.start : item.end], copied)
            else:
                self.paste(region[1], self.text_of(*region[:2]))
                container[1].insert(at + 1, copied)
            return self.done((*path[:-1], at + 1))
        name, (key, value) = _free(str(path[-1]), _keys(above)), above.pairs[at]
        copied[0] = ("scalar", name, SCALAR_MARK)
        if region is None:
            text = f"{name}{self.lines.text[key.end : max(value.end, key.end)]}"
            self.insert_in_brackets(path[:-1], at + 1, text, copied)
        else:
            block, start = self.text_of(*region[:2]), self.lines.starts[region[0]]
            self.paste(region[1], f"{block[: key.start - start]}{name}{block[key.end - start :]}")
            container[1].insert(at + 1, copied)
        return self.done((*path[:-1], name))

    def place(self, path: Path, to: Path, index: int) -> TextPatch:
        """Move a block into a slot; in brackets, only among those beside it."""
        if not self.is_block_in_brackets(path):
            return super().place(path, to, index)
        if to != path[:-1]:
            raise Refused(f"it is written in brackets, and moves only within these: {BY_HAND}")
        return self.order_in_brackets(path, index)

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

    def insert_entry(self, path: Path, index: int, name: str, snippet: str, plain: PlainTree) -> TextPatch:
        """Write an entry with a name into a map, in lines or in brackets as the others."""
        node, new = self.node(path), placed(snippet)
        if not node.is_flow or new is None:
            return super().insert_entry(path, index, name, snippet, plain)
        if not name or scalar_text(name) != name or name in _keys(node):
            raise Refused("it needs a name of its own: letters, digits and underscores")
        text, plain = _bracketed(new)
        self.insert_in_brackets(path, index, f"{name}: {text}", [("scalar", name, SCALAR_MARK), plain])
        return self.done((*path, name))

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
        if not name or scalar_text(name) != name:
            raise Refused("it needs a name: letters, digits and underscores")
        if name in _keys(above):
            raise Refused(f"there is '{name}' already")
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


OPERATIONS: Mapping[str, Callable[[_Operations, Mapping[str, Any]], TextPatch]] = MappingProxyType(
    {
        "add": _Operations.add,
        "delete": _Operations.delete,
        "duplicate": _Operations.duplicate,
        "insert": _Operations.insert,
        "move": _Operations.move,
        "move_to": _Operations.move_to,
        "rename": _Operations.rename,
        "set": set_value,
    }
)


def _free(word: str, names: list[str]) -> str:
    return next(one for number in range(1, 10_000) if (one := word if number == 1 else f"{word}_{number}") not in names)


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
