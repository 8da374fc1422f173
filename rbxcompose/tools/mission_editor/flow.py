"""Changes of what is written in brackets, `[a, b]` or `{a: 1}`: the entries move, what is between them stays."""

from __future__ import annotations

import json
from collections.abc import Sequence

from rbxcompose.base.requests import Refused
from rbxcompose.tools.mission_editor.patch import BY_HAND, Patch, TextEdit, TextPatch, take_out, tree_at
from rbxcompose.tools.mission_editor.yaml_places import Path, PlacedNode, PlainTree, placed


def is_in_brackets(patch: Patch, path: Path) -> bool:
    """Return whether an item or an entry is in brackets beside others."""
    above = patch.root.at(path[:-1]) if path else None
    return above is not None and above.is_flow


def delete_in_brackets(patch: Patch, path: Path) -> TextPatch:
    """Take an entry out, with the comma before or behind it."""
    above, at = patch.node(path[:-1]), _index(patch, path)
    spans, keys = _spans(above), _keys(above)
    if len(spans) == 1:
        raise Refused("this is the only one here: delete what is around it")
    start, end = (spans[at - 1][1], spans[at][1]) if at > 0 else (spans[0][0], spans[1][0])
    between = patch.lines.text[start : spans[at][0]] if at > 0 else patch.lines.text[spans[0][1] : end]
    if "#" in between:
        raise Refused(f"there is a comment beside it: {BY_HAND}")
    patch.edits.append(TextEdit(start, end, ""))
    take_out(tree_at(patch.tree, path[:-1]), path[-1])
    if isinstance(path[-1], int):
        return patch.done((*path[:-1], max(0, at - 1)))
    return patch.done((*path[:-1], keys[at - 1 if at > 0 else 1]))


def order_in_brackets(patch: Patch, path: Path, index: int) -> TextPatch:
    """Move an entry before the one with `index`."""
    above, at = patch.node(path[:-1]), _index(patch, path)
    spans, container = _spans(above), tree_at(patch.tree, path[:-1])
    index = max(0, min(index, len(spans)))
    if index in (at, at + 1):
        raise Refused("it is there already")
    order = [number for number in range(len(spans)) if number != at]
    target = index - 1 if index > at else index
    order.insert(target, at)
    texts = [patch.lines.text[start:end] for start, end in spans]
    for (start, end), number, turn in zip(spans, order, range(len(spans)), strict=True):
        if number != turn:
            patch.edits.append(TextEdit(start, end, texts[number]))
    container[1] = [container[1][number] for number in order]
    return patch.done((*path[:-1], target if isinstance(path[-1], int) else path[-1]))


def insert_in_brackets(patch: Patch, to: Path, index: int, text: str, new: PlainTree) -> int:
    """Write an entry in brackets, and return its index; `new` is what it is in the tree of the list or the map."""
    above = patch.node(to)
    spans = _spans(above)
    index = max(0, min(index, len(spans)))
    if not spans:
        patch.edits.append(TextEdit(above.end - 1, above.end - 1, text))
    elif index < len(spans):
        patch.edits.append(TextEdit(spans[index][0], spans[index][0], f"{text}, "))
    else:
        patch.edits.append(TextEdit(spans[-1][1], spans[-1][1], f", {text}"))
    tree_at(patch.tree, to)[1].insert(index, new)
    return index


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


def _index(patch: Patch, path: Path) -> int:
    patch.node(path)
    return path[-1] if isinstance(path[-1], int) else _keys(patch.node(path[:-1])).index(path[-1])


def _keys(above: PlacedNode) -> Sequence[str]:
    return [key.text for key, _ in above.pairs]


def _spans(above: PlacedNode) -> list[tuple[int, int]]:
    """Return where the entries begin and end."""
    if above.form == "list":
        return [(item.start, item.end) for item in above.items]
    return [(key.start, max(value.end, key.end)) for key, value in above.pairs]
