"""A composed robot as YAML that reads back as the same robot."""

import json
import os
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

from rbxcompose.base.config import FILE, Secret
from rbxcompose.base.printable import FORBIDDEN, escaped
from rbxcompose.base.units import Quantity
from rbxcompose.compiler.composition.robot_manifest import RobotManifest
from rbxcompose.compiler.sections.composition import args
from rbxcompose.manifest.files import PREFIX, library_root, project_of, resolve
from rbxcompose.manifest.registry import section_named, sections_in_use
from rbxcompose.manifest.section import ROBOT
from rbxcompose.manifest.shapes import exact
from rbxcompose.manifest.tree import (
    BROKEN,
    Entry,
    KeyPath,
    MappingNode,
    ScalarNode,
    SequenceNode,
    TreeNode,
    plain_value,
)
from rbxcompose.manifest.validate import to_plain

Note = Callable[[KeyPath, TreeNode], str]

_KEY = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z0-9_]+)*")
_PLAIN = re.compile(r"(?!- |-$|---|\.\.\.)[\w./+-](?:[^\n:#]|:(?! |$)|(?<! )#)*(?<! )")


def dump_robot(manifest: RobotManifest, note: Note = lambda path, node: "") -> str:
    """Return a robot as one file, with its parts, profiles, overlays and values merged and filled in.

    It is meant for the folder of the robot's file: file paths are relative to that. `note` gives the
    comment after a value. Secrets keep their names: `${secret.NAME}`.
    """
    return dump(_in_one_file(manifest), note)


def dump(root: MappingNode, note: Note = lambda path, node: "") -> str:
    """Return a filled tree as YAML in block style; `note` gives the comment after a value."""
    return "".join(f"{line}\n" for line in _mapping(root, (), "", note))


def _in_one_file(manifest: RobotManifest) -> MappingNode:
    """Return the tree with all file paths as the robot's own file would write them."""

    def named(kind: str, node: TreeNode) -> TreeNode:
        if kind != FILE or not isinstance(node, ScalarNode) or str(to_plain(node)).startswith(PREFIX):
            return node
        writer = manifest.contents.documents.writer(node.span, manifest.path)
        file = resolve(str(to_plain(node)), writer, node.span)
        return ScalarNode(_path_from(manifest.path, file), node.span) if isinstance(file, Path) else node

    entries = dict(manifest.root.entries)
    entries.pop(args.name, None)  # their values have been filled in: nothing reads them any more
    for section in sections_in_use(ROBOT):
        if section.name in entries:
            key, value = entries[section.name].key, entries[section.name].value
            entries[section.name] = Entry(key, section.with_references(value, named))
    return replace(manifest.root, entries=entries)


def _path_from(robot: Path, file: Path) -> str:
    if file.is_relative_to(library_root()) and not file.is_relative_to(project_of(robot)):
        return PREFIX + file.relative_to(library_root()).as_posix()
    return os.path.relpath(file, robot.parent)


def _lines(node: TreeNode, path: KeyPath, begin: str, indent: str, note: Note) -> Iterator[str]:
    """Yield the lines of a value; the first follows `begin`, a key or a dash."""
    comment = note(path, node)
    behind = f"  # {comment}" if comment else ""
    match node:
        case ScalarNode():
            yield f"{indent}{begin} {_scalar(node, is_running=_is_running(path))}".rstrip() + behind
        case MappingNode() if not node.entries:
            yield f"{indent}{begin} {{}}{behind}"
        case SequenceNode() if not node.items:
            yield f"{indent}{begin} []{behind}"
        case MappingNode():
            yield f"{indent}{begin}{behind}"
            yield from _mapping(node, path, f"{indent}  ", note)
        case SequenceNode(items=items):
            yield f"{indent}{begin}{behind}"
            for index, item in enumerate(items):
                yield from _lines(item, (*path, index), "-", f"{indent}  ", note)


def _mapping(node: MappingNode, path: KeyPath, indent: str, note: Note) -> Iterator[str]:
    for name, entry in node.entries.items():
        key = name if _KEY.fullmatch(name) else json.dumps(name, ensure_ascii=False)
        yield from _lines(entry.value, (*path, name), f"{key}:", indent, note)


def _is_running(path: KeyPath) -> bool:
    """Return whether a text is for the running robot, so that `$name` has a meaning in it."""
    section = section_named(str(path[0])) if len(path) == len(("section", "entry", "key")) else None
    return section is not None and path[-1] in section.running


def _scalar(scalar: ScalarNode, *, is_running: bool) -> str:
    match scalar.filled:
        case None if is_running:
            return _text(scalar.text, scalar.plain)
        case None:
            return _text(scalar.text.replace("$", "$$"), scalar.plain)
        case bool():
            return "true" if scalar.filled else "false"
        case Quantity(value=value, dimension=dimension):
            return exact(value, dimension)
        case int() | float():
            return repr(scalar.filled)
        case Secret():
            return "${secret." + scalar.filled.name + "}"
    text = scalar.text if scalar.filled is BROKEN else str(scalar.filled).replace("$", "$$")
    is_word = bool(_KEY.fullmatch(text)) and plain_value(ScalarNode(text, scalar.span)) == text
    return _text(text, is_word or (scalar.filled is BROKEN and scalar.plain))


def _text(text: str, plain: bool) -> str:
    if plain and (not text or (_PLAIN.fullmatch(text) and not FORBIDDEN.search(text))):
        return text
    return escaped(json.dumps(text, ensure_ascii=False))
