"""The located tree: YAML as plain nodes that know their place, and what a scalar means by YAML's core types."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import field, replace
from typing import TypeVar

from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Span

FILE_BYTES = 2_000_000
URDF_BYTES = 4_000_000
ALL_BYTES = 8_000_000  # sum over the files of one robot
ALL_VALUES = 20_000  # of the files of one robot; a file counts each time that it is used
FILL_TEXT = 8  # characters of a text with `${...}` that count as one value
FILES = 500
INSTANCES = 500  # of parts; each counts the text of its file towards `ALL_BYTES`
INCLUDE_DEPTH = 16
PROFILE_STEPS = 8_000  # steps of missions checked again to try the profiles of a robot
LEAST_STEPS, STEP_BYTES = 160, 250  # what each profile counts at least, and what each step's worth of text counts
STEP_VALUES = 8  # values of all files that take as long as a step
SECRET = 64_000  # bytes of a secret's file
NODES = 40_000  # values per file
URDF_ELEMENTS = 200_000
KEYS = 1_000  # of one map, such as the components of a robot or the states of a machine
DEPTH = 64
ALIAS_NODES = 10_000  # reached through aliases and merge keys
DATA_NODES = 10_000  # of one datum or input of a mission, which is read, checked and copied as a whole
TEXT = 64_000  # characters of one value
KEY = 200
NUMBER = 40


NODE_BYTES = 40  # counted for a node in addition to its text
BROKEN = object()
"""Value of `ScalarNode.filled` after a reported error: it could not be filled in, or was a slip."""

Key = str | int
KeyPath = tuple[Key, ...]  # from the root of a file: ("components", "base", "max_speed") or ("do", 0, "go_to")


@dataclass(frozen=True, slots=True)
class ScalarNode:
    """One word, number or text as written.

    `plain` means that it is not quoted, so that YAML 1.2's core types apply. `filled` is the typed value of a scalar
    that was nothing but `${...}` (a `Quantity`, number, text or flag), else None. `scope` is the instance of a part
    whose file contains it (`arm.hand`), so that `${args...}` means that part's arguments; it is empty in other files.
    """

    text: str
    span: Span
    plain: bool = True
    filled: object = None
    scope: str = ""


@dataclass(frozen=True, slots=True)
class SequenceNode:
    """A list of nodes."""

    items: tuple[TreeNode, ...]
    span: Span
    tag: str = ""


@dataclass(frozen=True, slots=True)
class Entry:
    """A key with its value."""

    key: ScalarNode
    value: TreeNode


NOWHERE = Span("", 1, 1, 1, 1)


@dataclass(frozen=True, slots=True)
class MappingNode:
    """Named nodes, in the order of the text. `tag` is `!replace` where an overlay says so."""

    entries: dict[str, Entry] = field(default_factory=dict)
    span: Span = NOWHERE
    tag: str = ""

    def get(self, name: str) -> TreeNode | None:
        """Return the value of a key, or None."""
        entry = self.entries.get(name)
        return entry.value if entry else None

    def __contains__(self, name: object) -> bool:
        return name in self.entries


TreeNode = ScalarNode | SequenceNode | MappingNode
N = TypeVar("N", ScalarNode, SequenceNode, MappingNode, TreeNode)


def children(node: TreeNode) -> Iterable[tuple[Key, TreeNode]]:
    """Return the nodes directly below a node, with their keys or indices."""
    match node:
        case ScalarNode():
            return ()
        case MappingNode(entries=entries):
            return [(name, entry.value) for name, entry in entries.items()]
        case SequenceNode(items=items):
            return enumerate(items)


def all_nodes(root: TreeNode) -> Iterator[TreeNode]:
    """Yield a node and all those below it, in the order in which they are written."""
    waiting = [root]
    while waiting:
        node = waiting.pop()
        yield node
        if isinstance(node, MappingNode):
            waiting += [entry.value for entry in reversed(node.entries.values())]
        elif isinstance(node, SequenceNode):
            waiting += reversed(node.items)


def scalars(root: TreeNode | None) -> Iterator[ScalarNode]:
    """Yield the scalars of a tree, the keys of its maps excepted, in the order in which they are written."""
    return (node for node in (all_nodes(root) if root is not None else ()) if isinstance(node, ScalarNode))


def entries_of(node: TreeNode | None) -> Mapping[str, Entry]:
    """Return the entries of a map; none for any other node, or none."""
    return node.entries if isinstance(node, MappingNode) else {}


def only(root: MappingNode, *keys: str) -> MappingNode:
    """Return a map with only these of its keys."""
    return replace(root, entries={name: entry for name, entry in root.entries.items() if name in keys})


def without(root: MappingNode, *keys: str) -> MappingNode:
    """Return a map without these of its keys."""
    return replace(root, entries={name: entry for name, entry in root.entries.items() if name not in keys})


def with_children(node: N, change: Callable[[Key, TreeNode], TreeNode]) -> N:
    """Return a node with `change` applied to each node directly below it; the same node if nothing changes."""
    changed = {key: new for key, below in children(node) if (new := change(key, below)) is not below}
    match node:
        case MappingNode(entries=entries) if changed:
            new_ones = {name: Entry(entry.key, changed.get(name, entry.value)) for name, entry in entries.items()}
            return replace(node, entries=new_ones)
        case SequenceNode(items=items) if changed:
            return replace(node, items=tuple(changed.get(index, item) for index, item in enumerate(items)))
    return node


def size(node: TreeNode) -> int:
    """Return the approximate size of a tree [bytes]: its texts, and a fixed amount for each node."""
    return sum(NODE_BYTES + (len(found.text) if isinstance(found, ScalarNode) else 0) for found in all_nodes(node))


def count(node: TreeNode) -> int:
    """Return how many values a tree has, with its root; a text to fill in counts by its length, too."""
    total = 0
    for found in all_nodes(node):
        total += 1
        if isinstance(found, ScalarNode) and ("${" in found.text or "$$" in found.text):
            total += len(found.text) // FILL_TEXT
    return total


def is_larger(node: TreeNode, most: int) -> bool:
    """Return whether a tree has more than `most` nodes below its root; counting stops there."""
    count, waiting = 0, [node]
    while waiting and count <= most:
        below = [child for _, child in children(waiting.pop())]
        count += len(below)
        waiting += below
    return count > most


def at(node: TreeNode, path: KeyPath) -> TreeNode | None:
    """Return the node at `path`, or None if there is none."""
    found: TreeNode | None = node
    for key in path:
        match found:
            case MappingNode():
                found = found.get(str(key))
            case SequenceNode(items=items) if isinstance(key, int) and 0 <= key < len(items):
                found = items[key]
            case _:
                return None
    return found


def text_at(node: TreeNode | None, path: KeyPath = ()) -> str:
    """Return the text of the scalar at `path`; empty if there is none."""
    found = at(node, path) if node is not None else None
    return found.text if isinstance(found, ScalarNode) else ""


def key_span(node: TreeNode, path: KeyPath) -> Span:
    """Return the place of the key at `path`, or of the nearest place above it if there is no key."""
    for length in range(len(path), 0, -1):
        above = at(node, path[: length - 1])
        if isinstance(above, MappingNode) and str(path[length - 1]) in above.entries:
            return above.entries[str(path[length - 1])].key.span
        if isinstance(above, SequenceNode) and (item := at(above, path[length - 1 : length])):
            return item.span
    return node.span


def value_span(node: TreeNode, path: KeyPath) -> Span:
    """Return the place of the value at `path`, or of the nearest node above it if there is none."""
    for length in range(len(path), -1, -1):
        if (found := at(node, path[:length])) is not None:
            return found.span
    return node.span


@dataclass(frozen=True, slots=True)
class NodePlaces:
    """The places of the keys and values of what is at the path `at` of a tree."""

    root: TreeNode
    at: KeyPath = ()

    def key(self, path: KeyPath) -> Span:
        """Return the place of a key."""
        return key_span(self.root, (*self.at, *path))

    def value(self, path: KeyPath) -> Span:
        """Return the place of a value."""
        return value_span(self.root, (*self.at, *path))


def part_span(scalar: ScalarNode, start: int, end: int) -> Span:
    """Return the place of `scalar.text[start:end]`, or of the whole scalar if escapes or line breaks hide it."""
    span, quote = scalar.span, 0 if scalar.plain else 1
    if span.line != span.end_line or span.end_column - span.column != len(scalar.text) + 2 * quote:
        return span
    first = span.column + quote
    return span._replace(column=first + start, end_column=first + max(end, start + 1))


PlainValue = bool | int | float | str | None

_WORDS: dict[str, bool | None] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_NUMBER = re.compile(
    r"(?P<decimal>[-+]?[0-9]+)|(?P<based>0o[0-7]+|0x[0-9a-fA-F]+)"
    r"|(?P<float>[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?)"
    r"|(?P<infinite>[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))"
)
NOT_FINITE = "is not finite"
_MAY_BE_NUMBER = frozenset("+-.0123456789")


def plain_value(scalar: ScalarNode) -> PlainValue:
    """Return the value of a scalar by YAML's core types; a number that `number_trouble` names stays text."""
    text = scalar.text
    if not scalar.plain:
        return text
    if text[:1] not in _MAY_BE_NUMBER:
        return _WORDS.get(text, text)
    form = _number_form(text)
    if not form or _trouble(text, form):
        return text
    if form == "float":
        return float(text)
    return int(text) if form == "decimal" else int(text, 0)


def number_or_infinity(scalar: ScalarNode) -> PlainValue:
    """Return the value of a scalar, where `.inf`, `-.inf` and `.nan` are numbers, too."""
    is_infinite = number_trouble(scalar) == NOT_FINITE
    return float(scalar.text.replace(".", "")) if is_infinite else plain_value(scalar)


def is_empty(node: TreeNode | None) -> bool:
    """Return whether nothing is written there, in one of YAML's ways: `start:`, `start: null`, `start: ~`."""
    return isinstance(node, ScalarNode) and node.plain and _WORDS.get(node.text, False) is None


def number_trouble(scalar: ScalarNode) -> str:
    """Return why the number in a scalar is rejected, worded to follow "this number"; empty if it is not."""
    if scalar.text[:1] not in _MAY_BE_NUMBER or not scalar.plain:
        return ""
    form = _number_form(scalar.text)
    return _trouble(scalar.text, form) if form else ""


def _number_form(text: str) -> str:
    """Return the form of a number in a text (a group of `_NUMBER`), empty if it is not a number."""
    match = _NUMBER.fullmatch(text)
    return match.lastgroup or "" if match else ""


def _trouble(text: str, form: str) -> str:
    if form == "infinite":
        return NOT_FINITE
    if len(text) > NUMBER:
        return f"has {len(text):,} characters, {NUMBER} are the limit"
    return "is too large" if form == "float" and not math.isfinite(float(text)) else ""


def describe(value: object) -> str:
    """Return a description of a plain value: "this is text"."""
    match value:
        case None:
            return "this is empty"
        case bool():
            return "this is true or false"
        case int() | float():
            return "this is a number"
        case str():
            return "this is text"
        case dict():
            return "this is a map"
        case list() | tuple():
            return "this is a list"
    return "this is another type of value"
