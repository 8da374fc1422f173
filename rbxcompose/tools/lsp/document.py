"""One manifest as an editor sees it: its text, its kind, the place of a position in it, its robot, the known names."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import yaml

from rbxcompose.base.config import COMPONENT, PORT, PREFIXED, PUBLISHED, RUNNING, SERVICE, VALUE
from rbxcompose.base.dataclass import dataclass
from rbxcompose.base.findings import Span
from rbxcompose.base.garbage_collection import paused_collection
from rbxcompose.compiler.model.robot import Robot
from rbxcompose.compiler.model.skills import usable_skills
from rbxcompose.compiler.schema.documents import makers, schema_for
from rbxcompose.compiler.schema.guide import Guide
from rbxcompose.compiler.sections.composition import PART_ARGUMENT, args, include, profiles
from rbxcompose.compiler.sections.missions import INPUT
from rbxcompose.manifest.files import resolve
from rbxcompose.manifest.reader import read_file
from rbxcompose.manifest.registry import naming, section_named
from rbxcompose.manifest.section import OVERLAY, OWN_PORT, PART, ROBOT, SYSTEM, TEST
from rbxcompose.manifest.shapes import kind_of_keys
from rbxcompose.manifest.tree import (
    Entry,
    KeyPath,
    MappingNode,
    ScalarNode,
    SequenceNode,
    TreeNode,
    at,
    entries_of,
    text_at,
    with_children,
)
from rbxcompose.manifest.yaml_nodes import compose
from rbxcompose.missions.program.parts import ENDS, STATE
from rbxcompose.missions.program.program import Skill
from rbxcompose.tools.lsp.project import MISSION, kind_of

SKILL = "skill"
LARGE = 300  # lines; of longer manifests only the parts near the position are read
SMALL = 100  # lines; a section up to this size is always read
_MERGE = "<<"
_SECTION = re.compile(r"[A-Za-z_\"']")
_ENTRY = re.compile(r"( +)[^\s#]")
MARK = "\ue000"  # a private-use character, so that no manifest contains it
_TOKEN_BEHIND = re.compile(r"[^\s:,\[\]{}#]*")
_BEGINS_NODE = re.compile(r"(\s|- )*[^\s:]*")
_COMMENT = re.compile(r"(^|\s)#")
_COLON = re.compile(r"['\"]?\s*:(\s|$)")
_BRACKETS = {"[": "]", "{": "}"}
_FOLDERS = {"robots": ROBOT, "missions": MISSION, "parts": PART, "systems": SYSTEM, "worlds": "World"}


def quick_tree(text: str) -> TreeNode | None:
    """Return the tree of a text, None if it is not YAML; spans have no file, of a repeated key the last one counts.

    What an alias repeats is the same object again; an alias to something that contains it is an empty map.
    """
    root, _ = compose(text, "")
    return None if root is None else _node(root, {})


def _node(node: yaml.Node, done: dict[int, TreeNode]) -> TreeNode:
    start, end = node.start_mark, node.end_mark
    span = Span("", start.line + 1, start.column + 1, end.line + 1, end.column + 1)
    if isinstance(node, yaml.ScalarNode):
        return ScalarNode(node.value, span, not node.style)
    if id(node) in done:
        return done[id(node)]
    done[id(node)] = MappingNode({}, span)
    if isinstance(node, yaml.SequenceNode):
        made: TreeNode = SequenceNode(tuple(_node(item, done) for item in node.value), span)
    else:
        made = MappingNode(_entries(node.value, done), span)
    done[id(node)] = made
    return made


def _entries(pairs: list[tuple[yaml.Node, yaml.Node]], done: dict[int, TreeNode]) -> dict[str, Entry]:
    own: dict[str, Entry] = {}
    merged: dict[str, Entry] = {}
    for key_node, value_node in pairs:
        key, value = _node(key_node, done), _node(value_node, done)
        if isinstance(key, ScalarNode) and key.text == _MERGE and key.plain and isinstance(value, MappingNode):
            merged |= value.entries
        elif isinstance(key, ScalarNode):
            own[key.text] = Entry(key, value)
    return {**merged, **own}


def near(lines: list[str], line: int) -> list[str]:
    """Return the lines of a manifest, emptied where they are not needed to know what is at `line` (from 0).

    Small sections are kept, and of a large one the entry that contains the line: other names come from the robot.
    """
    starts = [number for number, text in enumerate(lines) if _SECTION.match(text)]
    kept = set(range(starts[0] if starts else 0))
    for start, end in pairwise([*starts, len(lines)]):
        if end - start <= SMALL:
            kept.update(range(start, end))
        elif start <= line < end:
            kept.update(_entry(lines, start, end, line))
    return [text if number in kept else "" for number, text in enumerate(lines)]


def _entry(lines: list[str], start: int, end: int, line: int) -> Iterator[int]:
    """Yield the lines of the section's entry that contains `line`, and the line of the section's name."""
    yield start
    first = next((match for text in lines[start + 1 : end] if (match := _ENTRY.match(text))), None)
    indent = first[1] if first else ""
    entries = [n for n in range(start + 1, end) if (match := _ENTRY.match(lines[n])) and match[1] == indent]
    for begin, after in pairwise([start + 1, *entries, end]):
        if begin <= line < after:
            yield from range(begin, after)


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

        def without_key(node: TreeNode) -> TreeNode:
            others = {name: entry for name, entry in entries_of(node).items() if name != self.text}
            return replace(node, entries=others) if isinstance(node, MappingNode) else node

        tree = _changed(self.root, self.path, without_key) if self.is_key else self.root
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
    root = _changed(tree, path, _without_mark)
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


def _changed(node: TreeNode, path: KeyPath, change: Callable[[TreeNode], TreeNode]) -> TreeNode:
    """Return a tree with `change` applied to what is at a path."""
    if not path:
        return change(node)
    return with_children(node, lambda key, below: _changed(below, path[1:], change) if key == path[0] else below)


def _without_mark(node: TreeNode) -> TreeNode:
    """Return a scalar, or a map whose keys are changed, as if the mark had never been in it."""
    if isinstance(node, ScalarNode):
        return replace(node, text=node.text.replace(MARK, ""))
    renamed: dict[str, Entry] = {}
    for name, entry in entries_of(node).items():
        own = name.replace(MARK, "")
        renamed.setdefault(own, replace(entry, key=replace(entry.key, text=own)))
    return replace(node, entries=renamed) if isinstance(node, MappingNode) else node


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
        return next((row for row in found if row), None)
    for name, entry in node.entries.items():
        if MARK in name:
            return path, entry.key, True
        if below := _marked(entry.value, (*path, name), seen):
            return below
    return None


def below_profile(path: KeyPath) -> KeyPath:
    """Return a path as it is in the robot that a profile changes."""
    return path[2:] if path[:1] == (profiles.name,) else path


def named_by_key(path: KeyPath, is_overlay: bool) -> str:
    """Return the kind of existing things that the keys of the map at `path` name, or nothing."""
    below = below_profile(path)
    section = section_named(below[0]) if below else None
    if section is None:
        return ""
    if len(below) == 1:
        is_over = is_overlay or below != path  # its keys name existing entries
        return section.names if is_over and section.is_map else ""
    return kind_of_keys(section.type, below[1:])


@dataclass(frozen=True, slots=True)
class KnownNames:
    """The names of a robot as last read, and those of the file being typed, each with a few words."""

    path: Path
    root: MappingNode
    robot: Robot | None

    def of(self, kind: str, path: KeyPath = ()) -> dict[str, str]:
        """Return the names of a kind, each with a short description; `path` is where one of them is to be written."""
        if kind in PREFIXED:
            prefix, named = PREFIXED[kind]
            return {f"{prefix}{name}": about for name, about in self.of(named).items()}
        special: dict[str, Callable[[], dict[str, str]]] = {
            PORT: lambda: {**self._in_text(COMPONENT), **dict(self._ports())},
            RUNNING: lambda: {**self._in_text(COMPONENT), **self._parts()},
            OWN_PORT: lambda: dict(self._own_ports(str(below_profile(path)[1]))),
            SKILL: self._skills,
            PUBLISHED: lambda: dict(self.robot.names.topics) if self.robot else {},
            SERVICE: lambda: dict(self.robot.services) if self.robot else {},
            STATE: lambda: self._states(path[: -3 if path[-1] == "next" else -4]),
            INPUT: lambda: self._inputs(str(below_profile(path)[1])),
            PART_ARGUMENT: lambda: self._part_arguments(str(below_profile(path)[1])),
        }
        return special[kind]() if kind in special else {**self._in_text(kind), **self._in_robot(kind)}

    @property
    def types(self) -> dict[str, str]:
        """Return the types of the components by name."""
        if self.robot is None:
            return {}
        return {name: entry.type for name, entry in self.robot.manifest.components.items()}

    @property
    def skills(self) -> Mapping[str, Skill]:
        """Return the skills that a mission of the robot may use."""
        return {name: source.skill for name, source in usable_skills(self.robot).items()} if self.robot else {}

    def _in_text(self, kind: str) -> dict[str, str]:
        found: dict[str, str] = {}
        for section in naming(kind):
            named = entries_of(at(self.root, (section.name, *section.at))).items()
            found |= {name: text_at(entry.value, ("type",)) for name, entry in named if name.isidentifier()}
        return found

    def _in_robot(self, kind: str) -> dict[str, str]:
        if self.robot is None:
            return {}
        if kind == VALUE:
            return {name: source.type.phrase for name, source in self.robot.values.items()}
        contents = self.robot.manifest.contents
        return {name: words for section in naming(kind) for name, words in section.described(contents).items()}

    def _parts(self) -> dict[str, str]:
        return {name: component.type_name for name, component in self.robot.components.items()} if self.robot else {}

    def _ports(self) -> Iterator[tuple[str, str]]:
        for end in self.robot.ends if self.robot else ():
            if end.port.kind in ("in", "out"):
                yield f"{end.instance}.{end.name}", f"{end.port.kind}: {end.type_name} on {end.topic}"

    def _own_ports(self, component: str) -> Iterator[tuple[str, str]]:
        part = self.robot.components.get(component) if self.robot else None
        for end in part.ends if part else ():
            yield end.name, f"{end.port.kind}: {end.type_name} on {end.topic}"

    def _skills(self) -> dict[str, str]:
        found = usable_skills(self.robot) if self.robot else {}
        return {name: f"skill: {source.action or 'in Python'}" for name, source in found.items()}

    def _states(self, machine: KeyPath) -> dict[str, str]:
        """Return what a transition of a machine can lead to."""
        found = {section: entries_of(at(self.root, (*machine, section))) for section in ("states", "ends")}
        return dict.fromkeys(found["states"], "a state") | dict.fromkeys((*found["ends"], *ENDS), "an end")

    def _inputs(self, mission: str) -> dict[str, str]:
        found = self.robot.missions.get(mission) if self.robot else None
        return {name: input_.type.phrase for name, input_ in found.program.inputs.items()} if found else {}

    def _part_arguments(self, instance: str) -> dict[str, str]:
        """Return the arguments of the part that an include entry instantiates."""
        written = at(self.root, (include.name, instance, "part"))
        path = resolve(written.text, self.path, written.span) if isinstance(written, ScalarNode) else None
        part = read_file(path, str(path), {})[0] if isinstance(path, Path) else None
        named = part.get(args.name) if isinstance(part, MappingNode) else None
        return {name: text_at(entry.value, ("type",)) for name, entry in entries_of(named).items()}


@dataclass(frozen=True, slots=True)
class Document:
    """A text, its file, and the robot that it is part of (as last read successfully), if there is one."""

    path: Path
    text: str
    robot: Robot | None = None

    @property
    def kind(self) -> str:
        """Return the kind of manifest, if it has a schema; else that which belongs into its folder."""
        written = kind_of(self.text)
        return written if written in makers() else self.usual_kind

    @property
    def usual_kind(self) -> str:
        """Return the kind that a file of this name in this folder usually has."""
        if self.path.stem.endswith(".test"):
            return TEST
        return next((_FOLDERS[above.name] for above in self.path.parents if above.name in _FOLDERS), ROBOT)

    @property
    def is_mission(self) -> bool:
        """Return whether names are looked up while the robot runs."""
        return self.kind == MISSION

    @property
    def is_overlay(self) -> bool:
        """Return whether its sections change those of a robot."""
        return self.kind == OVERLAY

    def at(self, line: int, column: int) -> Spot | None:
        """Return what is at a position (from 0), None if nothing is known about it."""
        cursor = locate(self.text, line, column)
        if cursor is None:
            return None
        known = KnownNames(self.path, cursor.root, self.robot)
        return Spot(self, cursor, known, Guide(schema_for(self.kind, known.robot), cursor.root, known.types))


@dataclass(frozen=True, slots=True)
class Spot:
    """A position in a document, with all that determines what belongs there."""

    document: Document
    cursor: Cursor
    known: KnownNames
    guide: Guide
