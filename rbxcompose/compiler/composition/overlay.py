"""Composition: parts -> robot -> profile -> overlays -> `--set`.

Maps merge by key, all else is replaced; each value keeps its place, and a `History` keeps what it replaced.
"""

from collections.abc import Iterable
from dataclasses import replace
from operator import is_

from rbxcompose.base.findings import Related, Report, Span, correction, kind, suggest
from rbxcompose.compiler.composition.robot_manifest import History, HistoryStep
from rbxcompose.manifest.reader import REMOVE
from rbxcompose.manifest.registry import section_named
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
from rbxcompose.manifest.validate import WRONG_TYPE, label_of

NOTHING_TO_CHANGE = kind("RBX1302", is_fixable=True)
NOT_AN_OVERLAY = kind("RBX1305")

TWO_PARTS = kind("RBX1307")

SET = "--set"
ENTRY = 2  # keys of the path of an entry of a section


def compose(
    base: MappingNode, overlays: Iterable[tuple[MappingNode, str]], report: Report, history: History | None = None
) -> MappingNode:
    """Return the settled `base` changed by each overlay in turn; each overlay comes with its name for findings."""
    composed = base
    for overlay, name in overlays:
        composed = _Merge(name, report, history or History()).mapping(composed, _spelt_out(overlay), ())
    return composed


def join(parts: Iterable[tuple[MappingNode, str, Span]], report: Report, history: History) -> MappingNode:
    """Return the union of what several parts bring; each comes with its instance and the place that includes it.

    A part follows those that it includes and may change them; any other overlap of two parts is a finding.
    """
    joined = MappingNode()
    for root, instance, span in parts:
        joined = _Join(instance, span, report, history).mapping(joined, _spelt_out(root), ())
    return joined


def part_layer(instance: str) -> str:
    """Return the name of an instance's layer in findings."""
    return f"part '{instance}'"


def settled(root: MappingNode, report: Report) -> MappingNode:
    """Return a tree for the bottom layer: with short forms written in full, and a finding for each `!remove`."""
    return _settled_map(_spelt_out(root), report)


def _spelt_out(root: MappingNode) -> MappingNode:
    """Write the short forms of section entries in full, so that every layer can change a part of them."""
    entries = dict(root.entries)
    for name, entry in root.entries.items():
        short = section.short if (section := section_named(name)) else None
        if short is not None and short.is_merged and isinstance(named := entry.value, MappingNode):
            full = {key: replace(one, value=_in_full(one.value, short.key)) for key, one in named.entries.items()}
            entries[name] = replace(entry, value=replace(named, entries=full))
    return replace(root, entries=entries)


def _in_full(value: TreeNode, key: str) -> TreeNode:
    if not isinstance(value, ScalarNode):
        return value
    return MappingNode({key: Entry(ScalarNode(key, value.span), value)}, value.span)


class _Merge:
    """One overlay laid over a tree."""

    def __init__(self, overlay: str, report: Report, history: History) -> None:
        self.overlay = overlay
        self.report = report
        self.history = history

    def mapping(self, base: MappingNode, over: MappingNode, path: KeyPath) -> MappingNode:
        entries = dict(base.entries)
        for name, entry in over.entries.items():
            self.entry(entries, entry, (*path, name))
        return replace(base, entries=entries)

    def entry(self, entries: dict[str, Entry], entry: Entry, path: KeyPath) -> None:
        """Merge one entry into the entries of its map."""
        name = entry.key.text
        below = entries.get(name)
        is_gone = is_removal(entry.value)
        if below is None:
            (self._nothing_to_remove if is_gone else self._add)(entries, entry, path)
        elif len(path) == ENTRY and _is_emptied(below.value, entry.value):
            help_text = f"to remove it, write '{name}: !remove'"
            message = f"{self.overlay} leaves '{name}' of '{path[0]}' empty"
            self.report.add(WRONG_TYPE.at(entry.value.span, message, label=label_of(entry.value), help=help_text))
        elif isinstance(below.value, MappingNode) and isinstance(entry.value, MappingNode) and not entry.value.tag:
            if self.may_merge(path):
                entries[name] = replace(below, value=self.mapping(below.value, entry.value, path))
            else:
                self._clash(below, entry, path)
        elif not self.may_change(path):
            self._clash(below, entry, path)
        elif is_gone:
            del entries[name]
            self.history.write(path, HistoryStep(self.overlay, None, entry.key.span))
        else:
            self._enter(entries, entry, path)

    def may_merge(self, path: KeyPath) -> bool:
        """Return whether this layer may add to the map at `path`."""
        return True

    def may_change(self, path: KeyPath) -> bool:
        """Return whether this layer may replace or remove what is at `path`."""
        return True

    def _enter(self, entries: dict[str, Entry], entry: Entry, path: KeyPath) -> None:
        value = _settled(entry.value, self.report)
        entries[entry.key.text] = Entry(entry.key, value)
        self.history.write(path, HistoryStep(self.overlay, value, value.span))

    def _nothing_to_remove(self, entries: dict[str, Entry], entry: Entry, path: KeyPath) -> None:
        name = entry.key.text
        where = f" in '{'.'.join(map(str, path[:-1]))}'" if path[1:] else ""
        message = f"{self.overlay} removes '{name}', which does not exist{where}"
        self.report.add(NOTHING_TO_CHANGE.misspelt(entry.key.span, message, name, entries))

    def _add(self, entries: dict[str, Entry], entry: Entry, path: KeyPath) -> None:
        name = entry.key.text
        section = section_named(path[0]) if len(path) == 2 else None
        text, needed = (section.entry, section.needs) if section else ("", "")
        if needed and isinstance(entry.value, MappingNode) and needed not in entry.value:
            message = f"{self.overlay} changes the {text} '{name}', which the robot does not have"
            own = [key for key in entries if key.endswith(f"_{name}")]
            help_text = suggest(name, own or entries, str(path[0])) or f"a new {text} needs a '{needed}:'"
            fix = correction(name, own or entries, entry.key.span)
            self.report.add(NOTHING_TO_CHANGE.at(entry.key.span, message, help=help_text, fix=fix))
        else:
            self._enter(entries, entry, path)

    def _clash(self, below: Entry, entry: Entry, path: KeyPath) -> None:
        """Report that this layer must not change what is at `path`."""
        raise AssertionError("an overlay may change everything")


class _Join(_Merge):
    """One part merged with others on the same level."""

    def __init__(self, instance: str, span: Span, report: Report, history: History) -> None:
        super().__init__(part_layer(instance), report, history)
        self.span = span
        self.included = part_layer(f"{instance}.").removesuffix("'")  # prefix of the layers of what it includes

    def may_merge(self, path: KeyPath) -> bool:
        return _is_shared(path) or self.may_change(path)

    def may_change(self, path: KeyPath) -> bool:
        return self.history.layer(path).startswith(self.included)

    def _clash(self, below: Entry, entry: Entry, path: KeyPath) -> None:
        name, *names = map(str, path)
        other, section = self.history.layer(path), section_named(name)
        what = f"'{names[-1]}' of '{name}'" if names else f"'{name}'"
        help_text = "rename one of the two instances" if names else f"a robot has one '{name}': remove one"
        if section and (clash := section.clash(names)):
            what, help_text = clash
        message = f"{self.overlay} and {other} both bring {what}"
        related = [Related(below.key.span, f"from {other}"), Related(entry.key.span, f"from {self.overlay}")]
        self.report.add(TWO_PARTS.at(self.span, message, label="the second", help=help_text, related=related))


def _is_emptied(value: TreeNode, over: TreeNode) -> bool:
    """Return whether nothing is written where there was a map: `charger: null`."""
    is_map = isinstance(value, MappingNode) and bool(value.entries)
    return is_map and isinstance(over, ScalarNode) and over.filled is None and plain_value(over) is None


def _is_shared(path: KeyPath) -> bool:
    """Return whether several parts may add to the map at `path`."""
    section = section_named(path[0])
    return section is not None and section.is_shared(path[1:])


def _settled(node: TreeNode, report: Report) -> TreeNode:
    """Return a node without the tags of maps: nothing lies below it that they could refer to.

    A list keeps its `!replace`, which says that the items it no longer has were removed on purpose.
    """
    match node:
        case ScalarNode():
            return node
        case MappingNode():
            return _settled_map(node, report)
        case SequenceNode(items=items):
            inner = tuple(_settled(item, report) for item in items)
            return node if all(map(is_, inner, items)) else replace(node, items=inner)


def is_removal(node: TreeNode) -> bool:
    """Return whether a node removes what lies below it."""
    return isinstance(node, MappingNode) and node.tag == REMOVE


def _settled_map(node: MappingNode, report: Report) -> MappingNode:
    """Return a map without tags; the same object if there are none."""
    changed: dict[str, Entry] = {}
    for name, entry in node.entries.items():
        value = entry.value
        if isinstance(value, ScalarNode):
            continue
        if is_removal(value):
            message = f"'!remove' has nothing to remove '{name}' from"
            report.add(NOT_AN_OVERLAY.at(value.span, message, help="it belongs in a profile"))
            changed[name] = Entry(entry.key, ScalarNode("", value.span, filled=BROKEN))  # so that it is not missed
        elif (inner := _settled(value, report)) is not value:
            changed[name] = Entry(entry.key, inner)
    return MappingNode({**node.entries, **changed}, node.span) if changed or node.tag else node
