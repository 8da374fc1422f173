"""The place of a position in a manifest, even while the text around it is being typed and is not valid YAML yet.

A mark is inserted into the text at the position, and the ordinary parser reads the result; if that fails, the line is
completed first, and as a last resort the rest of the text is dropped.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

from rbxcompose.dataclass import dataclass
from rbxcompose.lsp.quick import LARGE, near, quick_tree
from rbxcompose.manifest.garbage_collection import paused_collection
from rbxcompose.manifest.tree import Entry, KeyPath, MappingNode, ScalarNode, SequenceNode, TreeNode, at

MARK = "\ue000"  # a private-use character, so that no manifest contains it
_TOKEN_BEHIND = re.compile(r"[^\s:,\[\]{}#]*")
_BEGINS_NODE = re.compile(r"(\s|- )*[^\s:]*")
_COMMENT = re.compile(r"(^|\s)#")
_COLON = re.compile(r"['\"]?\s*:(\s|$)")
_BRACKETS = {"[": "]", "{": "}"}


@dataclass(frozen=True, slots=True)
class Cursor:
    """A position in a manifest.

    `path` leads to the map whose key it is in, or to the value that it is in; `before` and `after` are the parts of
    that key or value on either side. The tree is that of the completed text; `siblings` are the other keys of the map.
    `begins_item` means that the key is the first one of a list item, so that it may also become a plain word.
    """

    root: MappingNode
    path: KeyPath
    before: str
    after: str
    is_key: bool
    has_colon: bool = False
    begins_item: bool = False
    siblings: frozenset[str] = frozenset()

    @property
    def around(self) -> MappingNode:
        """Return the tree without the key being written."""
        tree = _without_key(self.root, self.path, self.text) if self.is_key else self.root
        return tree if isinstance(tree, MappingNode) else self.root

    @property
    def text(self) -> str:
        """Return the key or value."""
        return self.before + self.after

    @property
    def place(self) -> KeyPath:
        """Return the path that is meant: for a key, that of its value."""
        return (*self.path, self.text) if self.is_key else self.path


def locate(text: str, line: int, column: int) -> Cursor | None:
    """Return the cursor at a position (from 0), None in a comment or if the text before it cannot be read."""
    lines = text.split("\n")
    if line >= len(lines):
        return None
    before, after = lines[line][:column], lines[line][column:]
    with paused_collection():
        # An alias needs its anchor, which may be anywhere.
        around = near(lines, line) if len(lines) > LARGE and "&" not in text else lines
        for candidate in _candidates(around, line, before, after):
            tree = quick_tree(candidate)
            if not isinstance(tree, MappingNode):
                continue
            if found := _marked(tree, (), set()):
                return _cursor(tree, *found, before, after)
            if _COMMENT.search(before):
                return None  # whether a `#` stands in a text, in quotes or without, only the parser knows
    return None


def _cursor(tree: MappingNode, path: KeyPath, scalar: ScalarNode, is_key: bool, before: str, after: str) -> Cursor:
    start, _, end = scalar.text.partition(MARK)
    above = at(tree, path)
    others = above.entries if is_key and isinstance(above, MappingNode) else {}
    root = _without_mark(tree, path)
    begins = before.lstrip(" ").startswith("-") and _BEGINS_NODE.fullmatch(before) is not None
    return Cursor(
        root if isinstance(root, MappingNode) else tree,
        path,
        start,
        end,
        is_key,
        has_colon=_COLON.match(_after_token(after)) is not None,
        begins_item=is_key and begins,
        siblings=frozenset(others) - {scalar.text},
    )


def _without_key(node: TreeNode, path: KeyPath, key: str) -> TreeNode:
    """Return a tree without the key `key` of the map at `path`."""
    match node:
        case SequenceNode(items=items) if path:
            changed = (_without_key(one, path[1:], key) if index == path[0] else one for index, one in enumerate(items))
            return replace(node, items=tuple(changed))
        case MappingNode(entries=entries) if path:
            entry = entries[str(path[0])]
            inner = replace(entry, value=_without_key(entry.value, path[1:], key))
            return replace(node, entries={**entries, str(path[0]): inner})
        case MappingNode(entries=entries):
            return replace(node, entries={name: entry for name, entry in entries.items() if name != key})
    return node


def _without_mark(node: TreeNode, path: KeyPath) -> TreeNode:
    """Return the tree as if the mark had never been in the scalar; `path` leads there."""
    match node:
        case ScalarNode(text=text):
            return replace(node, text=text.replace(MARK, ""))
        case SequenceNode(items=items) if path:
            cleaned = (_without_mark(item, path[1:]) if index == path[0] else item for index, item in enumerate(items))
            return replace(node, items=tuple(cleaned))
        case MappingNode(entries=entries) if path:
            entry = entries[str(path[0])]
            inner = replace(entry, value=_without_mark(entry.value, path[1:]))
            return replace(node, entries={**entries, str(path[0]): inner})
        case MappingNode(entries=entries):
            renamed: dict[str, Entry] = {}
            for name, entry in entries.items():
                own = name.replace(MARK, "")
                renamed.setdefault(own, replace(entry, key=replace(entry.key, text=own)))
            return replace(node, entries=renamed)
    return node


def _after_token(after: str) -> str:
    match = _TOKEN_BEHIND.match(after)
    return after[match.end() :] if match else after


def _candidates(lines: list[str], line: int, before: str, after: str) -> Iterator[str]:
    """Yield texts that contain the mark, the most likely one first."""
    above, below = lines[:line], lines[line + 1 :]
    rest = _after_token(after)
    as_it_is = f"{before}{MARK}{after}"
    as_key = f"{before}{MARK}{after[: len(after) - len(rest)]}: {rest}"
    is_open = _BEGINS_NODE.fullmatch(before) is not None and (not rest.strip() or rest.lstrip().startswith("#"))
    closed = f"{before}{MARK}{_closing(before)}"
    ways = [as_key, as_it_is] if is_open else [as_it_is, closed]
    for written in ways:
        yield "\n".join([*above, written, *below])
    for written in (*ways, closed):
        yield "\n".join([*above, written])


def _closing(before: str) -> str:
    """Return the brackets that a line has opened and not closed."""
    waiting: list[str] = []
    for character in before:
        if character in _BRACKETS:
            waiting.append(_BRACKETS[character])
        elif waiting and character == waiting[-1]:
            waiting.pop()
    return "".join(reversed(waiting))


def _marked(node: TreeNode, path: KeyPath, seen: set[int]) -> tuple[KeyPath, ScalarNode, bool] | None:
    """Return the path, the scalar with the mark, and whether it is a key; what aliases repeat is visited once."""
    if isinstance(node, ScalarNode):
        return (path, node, False) if MARK in node.text else None
    if id(node) in seen:
        return None
    seen.add(id(node))
    if isinstance(node, SequenceNode):
        found = (_marked(item, (*path, index), seen) for index, item in enumerate(node.items))
        return next((one for one in found if one), None)
    for name, entry in node.entries.items():
        if MARK in name:
            return path, entry.key, True
        if below := _marked(entry.value, (*path, name), seen):
            return below
    return None
