"""A mission's text as an outline of blocks: steps, states and interrupts, each with its own part of the text.

What contains what follows from the grammar that the kinds of steps declare.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import field
from functools import cache
from typing import Any

from rbxcompose.base.dataclass import dataclass
from rbxcompose.missions.language.fields import Field
from rbxcompose.missions.language.grammar import Takes
from rbxcompose.missions.program.registry import anywhere, kinds
from rbxcompose.tools.mission_editor.yaml_places import Path, PlacedNode, TextLines, placed

ONE, SEVERAL, NAMED = "one", "several", "named"
"""What a slot holds: one step, a list of steps, or entries by their names."""
LONGEST = 80  # characters of the text of a block
STATE, INTERRUPT, SEQUENCE = "state", "interrupt", "sequence"
INTERRUPTS, MACHINE = "interrupts", "machine"
_INSIDE: Mapping[Takes, str] = {Takes.STEP: ONE, Takes.STEPS: SEVERAL, Takes.BRANCHES: SEVERAL, Takes.CASES: NAMED}
_PARTS: Mapping[Takes, str] = {Takes.CASES: "case", Takes.BRANCHES: "branch"}


@dataclass(frozen=True, slots=True)
class Slot:
    """A place for blocks: the path of what is there, what it holds, and what the blocks are.

    `part` is what one of them is called: a state, an interrupt, a case, else by the key of the place. `is_there` means
    that something is written there, `has_names` that its parts have names, as they are written.
    """

    path: Path
    holds: str
    of: str = "step"
    part: str = ""
    is_there: bool = True
    has_names: bool = False
    start: str = ""
    """The first of its states, if it is a machine's."""
    is_optional: bool = False
    """Whether nothing need be there."""


@dataclass(slots=True)
class Block:
    """A step, a state or an interrupt; `start` and `end` are the offsets of whole lines, comments included.

    `role` is what it is to the block around it: `then`, or the name of a branch. `is_fixed` means that it cannot be
    moved by itself: it is the only step there, or the only one within brackets.
    """

    path: Path
    kind: str
    text: str
    name: str
    role: str
    start: int
    end: int
    is_fixed: bool
    written: tuple[int, int]
    """Where it is written itself: several can be in one line."""
    notes: list[str] = field(default_factory=list)
    leads: list[tuple[str, str]] = field(default_factory=list)
    """Where a state leads to: outcomes (empty: any), each with the name of a state or an end."""
    slots: list[Slot] = field(default_factory=list)
    children: list[Block] = field(default_factory=list)

    def all(self) -> Iterator[Block]:
        """Yield it and all below it."""
        yield self
        for child in self.children:
            yield from child.all()


@cache
def _slots_of_kind(kind: str) -> tuple[Field, ...]:
    """Return the keys of a kind that take steps."""
    cls = kinds().get(kind)
    fields = cls.fields.values() if cls is not None else ()
    return tuple(one for one in fields if one.takes in _INSIDE)


def kind_of(step: PlacedNode) -> str:
    """Return the word of a step: its kind, or the name of a skill; empty if it has none."""
    if step.form == "scalar":
        return step.text
    if step.form == "list":
        return SEQUENCE
    own = [key.text for key, _ in step.pairs if key.text not in anywhere()]
    found = (key for key in own if key in kinds() and (key != "if" or step.get("then") is not None or own[0] == key))
    return next(found, own[0] if own else "")


def slots_of(step: PlacedNode, path: Path) -> list[Slot]:
    """Return the places for steps and states within a step, a state, an interrupt or the whole mission."""
    if step.form == "list":
        return [Slot(path, SEVERAL)]
    kind = kind_of(step)
    found = [_slot_in(step, path, one) for one in _slots_of_kind(kind)]
    if step.get(MACHINE) is not None:
        found.append(_states_in(step, path))
    return found


def _slot_in(step: PlacedNode, path: Path, of: Field) -> Slot:
    there, holds, part = step.get(of.key), _INSIDE[of.takes], _PARTS.get(of.takes, of.key)
    has_names = holds == NAMED or (holds == SEVERAL and there is not None and there.form == "map")
    where, is_there, is_optional = (*path, of.key), there is not None, not of.is_required
    return Slot(where, holds, part=part, is_there=is_there, has_names=has_names, is_optional=is_optional)


def _states_in(node: PlacedNode, path: Path) -> Slot:
    is_there = node.at((MACHINE, "states")) is not None
    start = node.at((MACHINE, "start"))
    first = start.text if start is not None else ""
    return Slot((*path, MACHINE, "states"), NAMED, STATE, STATE, is_there, has_names=True, start=first)


class MissionOutline:
    """The blocks of a text; none if it cannot be read."""

    def __init__(self, text: str) -> None:
        self.lines = TextLines(text)
        self.root = placed(text)
        self.slots: list[Slot] = []
        self.blocks = list(self._mission()) if self.root is not None and self.root.form == "map" else []

    def at(self, path: Path) -> Block | None:
        """Return the block at a path."""
        return next((block for top in self.blocks for block in top.all() if block.path == path), None)

    def written_at(self, line: int, column: int) -> Block | None:
        """Return the innermost block at a place of the text; both count from 1."""
        offset = self.lines.starts[min(line, len(self.lines.lines)) - 1] + column - 1
        return _innermost(self.blocks, offset)

    def all_slots(self) -> list[Slot]:
        """Return all places for blocks."""
        within = [slot for top in self.blocks for block in top.all() for slot in block.slots]
        return [*self.slots, *within]

    def region(self, path: Path) -> tuple[int, int, int] | None:
        """Return the lines of an item or an entry, and its column; None if it shares a line with something else."""
        if self.root is None or not path:
            return None
        above = self.root.at(path[:-1])
        if above is None or above.is_flow:
            return None
        if isinstance(path[-1], int):
            start, end = self._item(above, path[-1])
        else:
            pair = next((pair for pair in above.pairs if pair[0].text == path[-1]), None)
            if pair is None:
                return None
            start, end = pair[0].start, max(pair[1].end, pair[0].end + 1)
        if not self.lines.begins(start):
            return None
        column = self.lines.column(start)
        return (*self.lines.region(start, end, column), column)

    def _item(self, above: PlacedNode, index: int) -> tuple[int, int]:
        """Return the offsets of an item of a list in lines, from its dash on."""
        item = above.items[index]
        if index == 0:
            return above.start, max(item.end, above.start + 1)
        column = self.lines.column(above.start)
        line = self.lines.of(above.items[index - 1].end)
        while line < self.lines.count - 1:
            line += 1
            if self.lines.indent(line) == column and self.lines.lines[line][column : column + 1] == "-":
                break
        start = self.lines.starts[line] + column
        return start, max(item.end, start + 1)

    # The walk

    def _mission(self) -> Iterator[Block]:
        root = self.root
        if root is None:
            return
        interrupts = root.get(INTERRUPTS)
        is_there = interrupts is not None
        self.slots.append(Slot((INTERRUPTS,), NAMED, INTERRUPT, INTERRUPT, is_there, has_names=True, is_optional=True))
        for key, value in interrupts.pairs if interrupts is not None else ():
            yield self._named(key.text, value, (INTERRUPTS, key.text), INTERRUPT)
        if (body := root.get("do")) is not None:
            self.slots.append(Slot(("do",), ONE))
            if body.form == "list":
                yield from self._steps(body, ("do",))
            else:
                yield self._step(body, ("do",), "")
        elif root.get(MACHINE) is not None:
            self.slots.append(_states_in(root, ()))
            yield from self._states(root, ())

    def _steps(self, node: PlacedNode, path: Path, role: str = "") -> Iterator[Block]:
        for index, item in enumerate(node.items):
            yield self._step(item, (*path, index), role, is_entry=True)

    def _step(self, node: PlacedNode, path: Path, role: str, *, is_entry: bool = False) -> Block:
        kind = kind_of(node)
        value = node.get(kind) if node.form == "map" else None
        block = self._block(node, path, kind, role, is_entry=is_entry)
        inside = {one.key for one in _slots_of_kind(kind)} | {MACHINE, "name", kind}
        block.slots = slots_of(node, path)
        if kind == MACHINE:
            block.text = next((f"from {slot.start}" for slot in block.slots if slot.start), "")
        elif value is not None and kind not in {one.key for one in _slots_of_kind(kind)}:  # its steps are below it
            block.text = _shown(value)
        name = node.get("name")
        block.name = name.text if name is not None else ""
        block.notes = [f"{key.text} {_shown(of)}".strip() for key, of in node.pairs if key.text not in inside]
        block.children = list(self._inside(node, block.slots, kind))
        block.end = max([block.end, *(child.end for child in block.children)])  # with comments of the last one
        return block

    def _inside(self, node: PlacedNode, slots: list[Slot], kind: str) -> Iterator[Block]:
        for slot in slots:
            if slot.of == STATE:
                yield from self._states(node, slot.path[:-2])
                continue
            key = str(slot.path[-1])
            below = node if node.form == "list" else node.get(key)
            if below is None:
                continue
            role = "" if key in ("do", kind) else key
            if below.form == "list":
                is_role = below is not node and slot.holds == ONE
                yield from self._steps(below, slot.path, role if is_role else "")
            elif below.form == "map" and slot.holds != ONE:
                for name, value in below.pairs:
                    yield self._step(value, (*slot.path, name.text), name.text, is_entry=True)
            elif slot.holds == ONE:
                yield self._step(below, slot.path, role)

    def _states(self, node: PlacedNode, path: Path) -> Iterator[Block]:
        machine = node.get(MACHINE)
        states = machine.get("states") if machine is not None else None
        for key, value in states.pairs if states is not None else ():
            yield self._named(key.text, value, (*path, MACHINE, "states", key.text), STATE)

    def _named(self, name: str, node: PlacedNode, path: Path, kind: str) -> Block:
        """Return a state or an interrupt."""
        block = self._block(node, path, kind, "", is_entry=True)
        block.name = name
        if node.form == "map":
            others = ((key, of) for key, of in node.pairs if key.text not in ("do", MACHINE))
            block.notes = [f"{key.text} {_shown(of)}".strip() for key, of in others]
            block.leads = _leads(node.get("next"))
            body = node.get("do")
            block.slots = [Slot((*path, "do"), ONE)] if node.get(MACHINE) is None else slots_of(node, path)
            if body is not None and body.form == "list":
                block.children = list(self._steps(body, (*path, "do")))
            elif body is not None:
                block.children = [self._step(body, (*path, "do"), "")]
            else:
                block.children = list(self._states(node, path))
        return block

    def _block(self, node: PlacedNode, path: Path, kind: str, role: str, *, is_entry: bool) -> Block:
        """Return a block without what is in it; an entry is one of several in a list or a map."""
        region = self.region(path) if is_entry else None
        if region is None:
            lines = self.lines.of(node.start), self.lines.of(max(node.end - 1, node.start)) + 1
            start, end = self.lines.starts[lines[0]], self.lines.place(lines[1])
        else:
            start, end = self.lines.starts[region[0]], self.lines.place(region[1])
        above = self.root.at(path[:-1]) if is_entry and self.root is not None else None
        is_beside = above is not None and above.is_flow and len(above.items) + len(above.pairs) > 1
        key = next((key for key, value in above.pairs if value is node), node) if above is not None else node
        written = key.start, max(node.end, key.end)
        return Block(path, kind, "", "", role, start, end, region is None and not is_beside, written)


def _leads(following: PlacedNode | None) -> list[tuple[str, str]]:
    if following is None:
        return []
    if following.form == "scalar":
        return [("", following.text)] if following.text else []
    return [(outcome.text, target.text) for outcome, target in following.pairs if target.text]


def _innermost(blocks: list[Block], offset: int) -> Block | None:
    there = [block for block in blocks if block.start <= offset < block.end]
    exact = (block for block in there if block.written[0] <= offset < block.written[1])
    block = next(exact, there[0] if there else None)
    return block and (_innermost(block.children, offset) or block)


def _shown(node: PlacedNode) -> str:
    """Return a value in one line."""
    match node.form:
        case "scalar":
            text = " ".join(node.text.split())
        case "alias":
            text = f"*{node.text}"
        case "list":
            text = f"[{', '.join(map(_shown, node.items[:8]))}{', ...' if len(node.items) > 8 else ''}]"
        case _:
            text = ", ".join(f"{key.text} {_shown(value)}".strip() for key, value in node.pairs[:8])
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}\u2026"


def told(outline: MissionOutline, at: Callable[[int], int]) -> dict[str, Any]:
    """Return an outline as data; `at` turns offsets into those of the reader."""
    return {"blocks": [_block(block, at) for block in outline.blocks], "slots": [_slot(slot) for slot in outline.slots]}


def _slot(slot: Slot) -> dict[str, Any]:
    return {name: getattr(slot, name) for name in Slot.__slots__} | {"path": list(slot.path)}


def _block(block: Block, at: Callable[[int], int]) -> dict[str, Any]:
    return {
        "path": list(block.path),
        "kind": block.kind,
        "text": block.text,
        "name": block.name,
        "role": block.role,
        "from": at(block.start),
        "to": at(block.end),
        "is_fixed": block.is_fixed,
        "notes": block.notes,
        "leads": [{"outcome": outcome, "to": to} for outcome, to in block.leads],
        "slots": [_slot(slot) for slot in block.slots],
        "children": [_block(child, at) for child in block.children],
    }
