"""Parts of a mission that have names or places of their own: added with what makes them valid, and renamed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rbxcompose.base.requests import Refused
from rbxcompose.missions.kinds.machine import RESULTS
from rbxcompose.missions.program.parts import FINISHED
from rbxcompose.missions.program.program import RESTART
from rbxcompose.tools.mission_editor.outline import INTERRUPT, INTERRUPTS, STATE, Slot
from rbxcompose.tools.mission_editor.patch import (
    BY_HAND,
    INDENT,
    SCALAR_MARK,
    Patch,
    TextEdit,
    TextPatch,
    path_of,
    scalar_text,
    tree_at,
)
from rbxcompose.tools.mission_editor.yaml_places import Path, PlacedNode, placed

STEP = "wait: 1 s"
"""What a new part does until somebody changes it: nothing that moves the robot."""
NEVER = "false"  # until somebody writes when an interrupt cuts the mission short


def add_part(patch: Patch, operation: Mapping[str, Any]) -> TextPatch:
    """Add a part to the slot `path`, before the one with `index`, with a name that is not taken.

    A state is put between the one before it and where that one leads to.
    """
    path, index = path_of(operation["path"]), int(operation["index"])
    slot = next((one for one in patch.slots() if one.path == path), None)
    if slot is None:
        raise Refused("nothing can be added there")
    if not slot.has_names:
        return _add_key(patch, slot)
    node = patch.root.at(path)
    names = [key.text for key, _ in node.pairs] if node is not None else []
    index = max(0, min(index, len(names)))
    name = _free(f"new_{slot.part}", names)
    body = STEP if slot.of not in (STATE, INTERRUPT) else f"do:\n{' ' * INDENT}{STEP}"
    if slot.of == INTERRUPT:
        body = f"when: {NEVER}\n{body}"
    if slot.of == STATE and node is not None:
        body = f"{body}\nnext: {_put_between(patch, node, index, name, path)}"
    new = placed(body)
    if new is None:
        raise Refused("nothing can be added there")
    if node is None and path == (INTERRUPTS,):
        return patch.first_interrupt(name, body, new.plain())
    return patch.insert_entry(path, index, name, body, new.plain())


def rename(patch: Patch, operation: Mapping[str, Any]) -> TextPatch:
    """Give a state, an interrupt, a case or a branch another `name`; transitions lead to the state as before."""
    path, name = path_of(operation["path"]), str(operation["name"]).strip()
    above = patch.node(path[:-1])
    pair = next((pair for pair in above.pairs if pair[0].text == path[-1]), None)
    if pair is None or not any(slot.path == path[:-1] and slot.has_names for slot in patch.slots()):
        raise Refused("this has no name of its own")
    if not name or scalar_text(name) != name:
        raise Refused("it needs a name: letters, digits and underscores")
    if any(key.text == name for key, _ in above.pairs):
        raise Refused(f"there is '{name}' already")
    patch.edits.append(TextEdit(pair[0].start, pair[0].end, name))
    container = tree_at(patch.tree, path[:-1])
    for written in container[1]:
        if written[0][1] == path[-1]:
            written[0] = ("scalar", name, SCALAR_MARK)
    if any(slot.path == path[:-1] and slot.of == STATE for slot in patch.slots()):
        for leading in _leading(patch.node(path[:-2]), (*path[:-2],)):
            _lead_to(patch, leading, str(path[-1]), name, path)
        for leading in _restarting(patch.root):
            _lead_to(patch, leading, str(path[-1]), name)
    return patch.done((*path[:-1], name))


def _free(word: str, names: list[str]) -> str:
    return next(one for number in range(1, 10_000) if (one := word if number == 1 else f"{word}_{number}") not in names)


def _add_key(patch: Patch, slot: Slot) -> TextPatch:
    """Write the key of a place in which nothing is yet, such as `else`, below the others of its step."""
    if slot.is_there:
        raise Refused("something is there already: add a step to it")
    path, key = slot.path[:-1], str(slot.path[-1])
    node = patch.node(path)
    if node.form != "map" or node.is_flow:
        raise Refused(f"it is written within a line: {BY_HAND}")
    column = patch.lines.column(node.pairs[0][0].start)
    last = patch.lines.region(node.start, node.end, column)[1]
    patch.paste(last, f"{' ' * column}{key}:\n{' ' * (column + INDENT)}{STEP}")
    new = placed(STEP)
    if new is not None:
        tree_at(patch.tree, path)[1].append([("scalar", key, SCALAR_MARK), new.plain()])
    return patch.done(slot.path)


# Transitions


def _put_between(patch: Patch, states: PlacedNode, index: int, name: str, path: Path) -> str:
    """Have what leads on lead to a new state; return where it led to."""
    machine = patch.node(path[:-1])
    if index == 0 or not states.pairs:
        leading, at = machine.get("start"), (*path[:-1], "start")
    else:
        key, state = states.pairs[index - 1]
        leading, at = state.get("next"), (*path, key.text, "next")
        if leading is not None and leading.form == "map":
            leading, at = leading.get(RESULTS[0]), (*at, RESULTS[0])
    if leading is None or leading.form != "scalar" or leading.mark != SCALAR_MARK or not leading.text:
        return FINISHED
    _lead_to(patch, (leading, at), leading.text, name)
    return leading.text


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


def _lead_to(patch: Patch, leading: tuple[PlacedNode, Path], old: str, name: str, renamed: Path = ()) -> None:
    """Replace the name of a state where it is named; its own path has its new name already."""
    node, path = leading
    if node.form != "scalar" or node.text != old:
        return
    if node.mark != SCALAR_MARK:
        raise Refused(f"a transition to it is written in quotes: {BY_HAND}")
    patch.edits.append(TextEdit(node.start, node.end, name))
    if renamed and path[: len(renamed)] == renamed:
        path = (*renamed[:-1], name, *path[len(renamed) :])
    pair = next(one for one in tree_at(patch.tree, path[:-1])[1] if one[0][1] == path[-1])
    pair[1] = ("scalar", name, SCALAR_MARK)
