"""Composition: robot -> profile -> `--set`. Maps merge by key, the rest is replaced; each value keeps its place."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from rbxcompose.findings import Report, Span, kind, suggest
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import Entry, Mapping, Node, Path, Scalar
from rbxcompose.manifest.tree import Sequence as NodeSequence
from rbxcompose.manifest.walk import REMOVE

NOTHING_TO_CHANGE = kind(
    "RBX1302",
    """A profile or `--set` changes what does not exist

An overlay may add a new entry to a section, such as a component with its `type:`. What it changes or removes must be
there, or else the name is misspelt.

Bad:
```yaml
profiles:
  tired:
    components:
      batery:
        runtime: 30 s
```
Good:
```yaml
profiles:
  tired:
    components:
      battery:
        runtime: 30 s
```
""",
)
BAD_SET = kind(
    "RBX1303",
    """A `--set` that cannot be read

`--set` takes a path and a value with `=` between them. The path begins with a component or a section; the value is
YAML, as it would stand in the file.

Bad: `--set battery.runtime`
Good: `--set battery.runtime="30 s"`
""",
)
NOT_AN_OVERLAY = kind(
    "RBX1305",
    """`!remove` outside of a profile

`!remove` takes something out of the file below. In the robot's own file there is nothing to take it from.

Bad:
```yaml
components:
  charger: !remove
```
Good:
```yaml
profiles:
  bare:
    components:
      charger: !remove
```
""",
)

NAMED_MAPS = ("components", "muxes", "args", "places", "values", "missions")
"""Sections whose keys are names that the user gives."""

SETTABLE = (*NAMED_MAPS, "about", "bus", "diagnostics", "start")
"""Sections that a path of `--set` may begin with."""

SET = "--set"
_WRITTEN_SHORT = {"missions": "file", "args": "default"}  # `patrol: FILE` means `patrol: {file: FILE}`


def compose(base: Mapping, overlays: Iterable[tuple[Mapping, str]], report: Report) -> Mapping:
    """Return `base` changed by each overlay in turn; each comes with its name for findings ("profile 'tired'")."""
    composed = _settled_map(_spelt_out(base), report)
    for overlay, name in overlays:
        composed = _Merge(name, report).mapping(composed, _spelt_out(overlay), ())
    return composed


def _spelt_out(root: Mapping) -> Mapping:
    """Write the short forms of section entries in full, so that every layer can change a part of them."""
    entries = dict(root.entries)
    for section, key in _WRITTEN_SHORT.items():
        if section in entries and isinstance(named := entries[section].value, Mapping):
            full = {name: replace(entry, value=_in_full(entry.value, key)) for name, entry in named.entries.items()}
            entries[section] = replace(entries[section], value=replace(named, entries=full))
    return replace(root, entries=entries)


def _in_full(value: Node, key: str) -> Node:
    if not isinstance(value, Scalar):
        return value
    return Mapping({key: Entry(Scalar(key, value.span), value)}, value.span)


class _Merge:
    """One overlay laid over a tree."""

    def __init__(self, overlay: str, report: Report) -> None:
        self.overlay = overlay
        self.report = report

    def mapping(self, base: Mapping, over: Mapping, path: Path) -> Mapping:
        entries = dict(base.entries)
        for name, entry in over.entries.items():
            below = entries.get(name)
            if isinstance(entry.value, Mapping) and entry.value.tag == REMOVE:
                self._remove(entries, entry, path)
            elif below is None:
                self._add(entries, entry, path)
            elif isinstance(below.value, Mapping) and isinstance(entry.value, Mapping) and not entry.value.tag:
                entries[name] = replace(below, value=self.mapping(below.value, entry.value, (*path, name)))
            else:
                entries[name] = Entry(entry.key, _settled(entry.value, self.report))
        return replace(base, entries=entries)

    def _remove(self, entries: dict[str, Entry], entry: Entry, path: Path) -> None:
        name = entry.key.text
        if entries.pop(name, None) is None:
            where = f" in '{'.'.join(map(str, path))}'" if path else ""
            message = f"{self.overlay} removes '{name}', which does not exist{where}"
            self.report.add(NOTHING_TO_CHANGE.at(entry.key.span, message, help=suggest(name, entries)))

    def _add(self, entries: dict[str, Entry], entry: Entry, path: Path) -> None:
        name = entry.key.text
        if path == ("components",) and isinstance(entry.value, Mapping) and "type" not in entry.value:
            message = f"{self.overlay} changes the component '{name}', which the robot does not have"
            fix = suggest(name, entries, "components") or "a new component needs a 'type:'"
            self.report.add(NOTHING_TO_CHANGE.at(entry.key.span, message, help=fix))
        else:
            entries[name] = Entry(entry.key, _settled(entry.value, self.report))


def _settled(node: Node, report: Report) -> Node:
    """Return a node without tags: nothing lies below it that they could speak of."""
    match node:
        case Mapping():
            return _settled_map(node, report)
        case NodeSequence(items=items):
            return NodeSequence(tuple(_settled(item, report) for item in items), node.span)
    return node


def _settled_map(node: Mapping, report: Report) -> Mapping:
    entries = {}
    for name, entry in node.entries.items():
        if isinstance(entry.value, Mapping) and entry.value.tag == REMOVE:
            message = f"'!remove' has nothing to remove '{name}' from"
            report.add(NOT_AN_OVERLAY.at(entry.value.span, message, help="it belongs in a profile"))
        else:
            entries[name] = Entry(entry.key, _settled(entry.value, report))
    return Mapping(entries, node.span)


def read_sets(sets: Sequence[str], root: Mapping, report: Report, sources: dict[str, str]) -> list[tuple[Mapping, str]]:
    """Return one overlay for each `PATH=VALUE`; together they are one source, a line for each."""
    sources[SET] = "\n".join(text.replace("\n", " ") for text in sets)
    overlays = (_set_overlay(text.replace("\n", " "), line, root, report) for line, text in enumerate(sets, 1))
    return [(overlay, f"'{SET}'") for overlay in overlays if overlay]


def _set_overlay(text: str, line: int, root: Mapping, report: Report) -> Mapping | None:
    written, equals, value_text = text.partition("=")
    span = Span(SET, line, 1, line, len(written) + 1)
    names = written.strip().split(".")
    if not equals or not all(names):
        message = f"'{SET} {text}' is no path and value"
        report.add(BAD_SET.at(span, message, help=f"write {SET} battery.runtime='30 s'"))
        return None
    path = _set_path(names, span, root, report)
    if path is None:
        return None
    value = _set_value(value_text, line, len(written) + 1, report)
    if value is None:
        return None
    for name in reversed(path):
        value = Mapping({name: Entry(Scalar(name, span), value)}, span)
    return value if isinstance(value, Mapping) else None


def _set_path(names: list[str], span: Span, root: Mapping, report: Report) -> list[str] | None:
    """Return the path from the root, or None after a finding if it leads to nothing."""
    section, *rest = names if names[0] in SETTABLE else ["components", *names]
    if section in NAMED_MAPS:
        named = root.get(section)
        there = list(named.entries) if isinstance(named, Mapping) else []
        if not rest or rest[0] not in there:
            message = f"'{SET}' changes '{'.'.join(names)}', which the robot does not have"
            choices = there if section == names[0] else [*there, *SETTABLE]
            fix = suggest(rest[0] if rest else "", choices, "a path begins with")
            report.add(NOTHING_TO_CHANGE.at(span, message, help=fix))
            return None
        if len(rest) == 1 and section in ("components", "muxes"):
            message = f"'{SET}' does not say what of '{rest[0]}' to change"
            report.add(BAD_SET.at(span, message, help=f"write {SET} {rest[0]}.KEY=VALUE"))
            return None
    return [section, *rest]


def _set_value(text: str, line: int, column: int, report: Report) -> Node | None:
    """Read the value of a `--set`; blank lines and columns before it make its places those of the argument."""
    if not text.strip():
        return Scalar("", Span(SET, line, column, line, column + 1))
    node, findings = read_text("\n" * (line - 1) + " " * column + text, SET)
    report.extend(findings)
    return node
