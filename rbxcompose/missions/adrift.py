"""Keys that stand outside or inside of what they belong to: each is told with its cure, and read where it belongs."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace

from rbxcompose.findings import Edit, Finding, Fix, Report
from rbxcompose.manifest.tree import Entry, Key, Node, Path, Scalar, Sequence, children
from rbxcompose.manifest.tree import Mapping as Tree
from rbxcompose.missions import codes
from rbxcompose.missions.strays import is_setting

MACHINE = "machine"


def settled(root: Tree, own: Collection[str], machine_keys: Collection[str], report: Report) -> Tree:
    """Return a mission in which what belongs to a machine and stands beside it, or at the very left, is below it.

    `own` are the keys of a mission. What is at the very left is moved if there is one machine that it may belong to.
    """
    machines = list(_machines(root))
    for path in machines:
        root = _beside(root, path, machine_keys, own, report)
    for key, entry in list(root.entries.items()) if machines else ():
        if key not in machine_keys or key in own:
            continue
        report.add(_too_far_left(entry.key))
        root = replace(root, entries={name: one for name, one in root.entries.items() if name != key})
        homes = [path for path in machines if key not in _at(root, (*path, MACHINE))]
        root = _with(root, (*homes[0], MACHINE), key, entry) if len(homes) == 1 else root
    return root


def among_branches(
    value: Tree, parallel: Scalar, options: Collection[str], modifiers: Collection[str]
) -> tuple[Mapping[str, Entry], list[Finding]]:
    """Return the settings of a parallel that stand among its branches, with a finding for each."""
    found = {
        key: entry
        for key, entry in value.entries.items()
        if (key in options and isinstance(entry.value, Scalar)) or (key in modifiers and is_setting(entry.value))
    }
    last = next(reversed(value.entries), "")
    findings = []
    for key, entry in found.items():
        message, help_text = f"'{key}' stands among the branches", f"move it left, into the column of '{parallel.text}'"
        fix = _moved_left(entry, parallel) if key == last else None
        findings.append(codes.WRONG_SHAPE.at(entry.key.span, message, help=help_text, fix=fix))
    return found, findings


def _moved_left(entry: Entry, parallel: Scalar) -> Fix | None:
    """Return the fix that puts a key on a line of its own into the column of `parallel`."""
    span, column = entry.key.span, parallel.span.column
    if entry.value.span.end_line != span.line or column >= span.column:
        return None
    before = span._replace(column=1, end_line=span.line, end_column=span.column)
    edit = Edit(before, " " * (span.column - 1), " " * (column - 1))
    return Fix((edit,), True, f"'{entry.key.text}' into the column of '{parallel.text}'")


def _too_far_left(key: Scalar) -> Finding:
    help_text = f"move it right, below '{MACHINE}:', into the column of 'states'"
    return codes.WRONG_SHAPE.at(key.span, f"'{key.text}' belongs to the machine", help=help_text)


def _machines(root: Tree) -> Iterator[Path]:
    """Yield the paths of all maps with a machine, the outer ones first."""
    waiting: list[tuple[Path, Node]] = [((), root)]
    while waiting:
        path, node = waiting.pop()
        if isinstance(node, Tree) and isinstance(below := node.get(MACHINE), Tree) and "states" in below:
            yield path
        waiting += [((*path, key), child) for key, child in children(node)]


def _beside(root: Tree, path: Path, machine_keys: Collection[str], own: Collection[str], report: Report) -> Tree:
    holder = _at(root, path)
    machine = _at(root, (*path, MACHINE))
    for key in machine_keys:
        if key in holder and key not in machine and (path or key not in own):
            entry = holder.entries[key]
            report.add(_too_far_left(entry.key))
            holder = replace(holder, entries={name: one for name, one in holder.entries.items() if name != key})
            root = _with(_put(root, path, holder), (*path, MACHINE), key, entry)
            holder = _at(root, path)
    return root


def _at(node: Node, path: Path) -> Tree:
    """Return the map at a path that leads to one."""
    for key in path:
        node = dict(children(node))[key]
    if not isinstance(node, Tree):
        raise TypeError(f"there is no map at {path}")
    return node


def _with(root: Tree, path: Path, key: str, entry: Entry) -> Tree:
    """Return a tree with one more key in the map at a path."""
    holder = _at(root, path)
    return _put(root, path, replace(holder, entries={**holder.entries, key: entry}))


def _put(root: Tree, path: Path, new: Tree) -> Tree:
    """Return a tree with another map at a path."""
    changed = _replaced(root, path, new)
    return changed if isinstance(changed, Tree) else root


def _replaced(node: Node, path: Path, new: Node) -> Node:
    if not path:
        return new
    key: Key = path[0]
    if isinstance(node, Tree):
        entry = node.entries[str(key)]
        return replace(
            node, entries={**node.entries, str(key): Entry(entry.key, _replaced(entry.value, path[1:], new))}
        )
    if isinstance(node, Sequence):
        items = [_replaced(one, path[1:], new) if index == key else one for index, one in enumerate(node.items)]
        return replace(node, items=tuple(items))
    return node
