"""Composition: parts -> robot -> profile -> overlays -> `--set`.

Maps merge by key, the rest is replaced; each value keeps its place, and a `History` keeps what it replaced.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from operator import is_

from rbxcompose.findings import Related, Report, Span, correction, kind, suggest
from rbxcompose.manifest.history import History, Step
from rbxcompose.manifest.reader import read_text
from rbxcompose.manifest.tree import BROKEN, Entry, Mapping, Node, Path, Scalar
from rbxcompose.manifest.tree import Sequence as NodeSequence
from rbxcompose.manifest.walk import REMOVE

NOTHING_TO_CHANGE = kind(
    "RBX1302",
    """A profile, an overlay or `--set` changes what does not exist

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
    is_fixable=True,
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
    """`!remove` where nothing lies below

`!remove` in a profile or an overlay takes something out of the robot, and in the robot's file something that a part
brought. Where nothing lies below there is nothing to take it from.

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

TWO_PARTS = kind(
    "RBX1307",
    """Two parts bring the same thing

What a part brings gets the name of its instance in front, but topics do not: two parts may not bring the same input or
lock of a mux. `connect:` gives one of them another topic.

Bad:
```yaml
include:
  gamepad: rbx:parts/teleop.yaml
  keyboard: rbx:parts/teleop.yaml
```
Good:
```yaml
include:
  gamepad: rbx:parts/teleop.yaml
  keyboard:
    part: rbx:parts/teleop.yaml
    with:
      priority: 90
    connect:
      cmd_vel/teleop: cmd_vel/keyboard
```
""",
)

INCLUDE = "include"
NAMED_MAPS = ("components", "muxes", "args", "places", "values", "missions", INCLUDE)
"""Sections whose keys are names that the user gives."""

SETTABLE = (*NAMED_MAPS, "about", "body", "bus", "diagnostics", "start")
"""Sections that a path of `--set` may begin with."""

SET = "--set"
_WRITTEN_SHORT = {"missions": "file", "args": "default", INCLUDE: "part"}  # `patrol: FILE` is `{file: FILE}`
_NEW_ENTRY_NEEDS = {"components": ("component", "type"), INCLUDE: ("part", "part")}  # else it was to change an old one
_JOINED = ("components", "diagnostics", "missions", "muxes", "places", "values")  # what several parts may bring


def compose(
    base: Mapping, overlays: Iterable[tuple[Mapping, str]], report: Report, history: History | None = None
) -> Mapping:
    """Return `base`, which is settled, changed by each overlay in turn; each comes with its name for findings."""
    composed = base
    for overlay, name in overlays:
        composed = _Merge(name, report, history or History()).mapping(composed, _spelt_out(overlay), ())
    return composed


def join(parts: Iterable[tuple[Mapping, str, Span]], report: Report, history: History) -> Mapping:
    """Return what several parts bring together; each comes with its instance and the place that includes it.

    A part stands behind those that it includes, and may change them; what else two parts bring is a finding.
    """
    joined = Mapping()
    for root, instance, span in parts:
        joined = _Join(instance, span, report, history).mapping(joined, _spelt_out(root), ())
    return joined


def part_layer(instance: str) -> str:
    """Return how findings call what an instance of a part brings."""
    return f"part '{instance}'"


def settled(root: Mapping, report: Report) -> Mapping:
    """Return a tree that nothing lies below: short forms written in full, and a finding for each `!remove`."""
    return _settled_map(_spelt_out(root), report)


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

    def __init__(self, overlay: str, report: Report, history: History) -> None:
        self.overlay = overlay
        self.report = report
        self.history = history

    def mapping(self, base: Mapping, over: Mapping, path: Path) -> Mapping:
        entries = dict(base.entries)
        for name, entry in over.entries.items():
            self.entry(entries, entry, (*path, name))
        return replace(base, entries=entries)

    def entry(self, entries: dict[str, Entry], entry: Entry, path: Path) -> None:
        """Lay one entry over those of the map above it."""
        name = entry.key.text
        below = entries.get(name)
        is_removal = _is_removal(entry.value)
        if below is None:
            (self._nothing_to_remove if is_removal else self._add)(entries, entry, path)
        elif isinstance(below.value, Mapping) and isinstance(entry.value, Mapping) and not entry.value.tag:
            if self.may_merge(path):
                entries[name] = replace(below, value=self.mapping(below.value, entry.value, path))
            else:
                self._clash(below, entry, path)
        elif not self.may_change(path):
            self._clash(below, entry, path)
        elif is_removal:
            del entries[name]
            self.history.write(path, Step(self.overlay, None, entry.key.span))
        else:
            self._enter(entries, entry, path)

    def may_merge(self, path: Path) -> bool:
        """Tell whether this layer may add to the map at `path`."""
        return True

    def may_change(self, path: Path) -> bool:
        """Tell whether this layer may replace or remove what is at `path`."""
        return True

    def _enter(self, entries: dict[str, Entry], entry: Entry, path: Path) -> None:
        value = _settled(entry.value, self.report)
        entries[entry.key.text] = Entry(entry.key, value)
        self.history.write(path, Step(self.overlay, value, value.span))

    def _nothing_to_remove(self, entries: dict[str, Entry], entry: Entry, path: Path) -> None:
        name = entry.key.text
        where = f" in '{'.'.join(map(str, path[:-1]))}'" if path[1:] else ""
        message = f"{self.overlay} removes '{name}', which does not exist{where}"
        self.report.add(NOTHING_TO_CHANGE.misspelt(entry.key.span, message, name, entries))

    def _add(self, entries: dict[str, Entry], entry: Entry, path: Path) -> None:
        name = entry.key.text
        one, needed = _NEW_ENTRY_NEEDS.get(str(path[0]), ("", "")) if len(path) == 2 else ("", "")
        if needed and isinstance(entry.value, Mapping) and needed not in entry.value:
            message = f"{self.overlay} changes the {one} '{name}', which the robot does not have"
            help_text = suggest(name, entries, str(path[0])) or f"a new {one} needs a '{needed}:'"
            fix = correction(name, entries, entry.key.span)
            self.report.add(NOTHING_TO_CHANGE.at(entry.key.span, message, help=help_text, fix=fix))
        else:
            self._enter(entries, entry, path)

    def _clash(self, below: Entry, entry: Entry, path: Path) -> None:
        """Say that this layer may not change what is at `path`."""
        raise AssertionError("an overlay may change everything")


class _Join(_Merge):
    """One part laid beside others."""

    def __init__(self, instance: str, span: Span, report: Report, history: History) -> None:
        super().__init__(part_layer(instance), report, history)
        self.span = span
        self.included = part_layer(f"{instance}.").removesuffix("'")  # how the layers of what it includes begin

    def may_merge(self, path: Path) -> bool:
        return _is_shared(path) or self.may_change(path)

    def may_change(self, path: Path) -> bool:
        return self.history.layer(path).startswith(self.included)

    def _clash(self, below: Entry, entry: Entry, path: Path) -> None:
        section, *names = map(str, path)
        other = self.history.layer(path)
        what = f"'{names[-1]}' of '{section}'" if names else f"'{section}'"
        message = f"{self.overlay} and {other} both bring {what}"
        help_text = "rename one of the two instances" if names else f"a robot has one '{section}': leave one out"
        if section == "muxes" and len(names) > 1:
            mux, *_, name = names
            message = f"{self.overlay} and {other} both bring '{name}' of mux '{mux}'"
            help_text = f"give one of them another topic: 'connect: {{{mux}/{name}: {mux}/ANOTHER_NAME}}'"
        related = [Related(below.key.span, f"from {other}"), Related(entry.key.span, f"from {self.overlay}")]
        self.report.add(TWO_PARTS.at(self.span, message, label="the second", help=help_text, related=related))


def _is_shared(path: Path) -> bool:
    """Tell whether several parts may add to the map at `path`."""
    match path:
        case (section,):
            return section in _JOINED
        case ("diagnostics", "analyzers") | ("muxes", _) | ("muxes", _, "inputs" | "locks"):
            return True
    return False


def _settled(node: Node, report: Report) -> Node:
    """Return a node without the tags of maps: nothing lies below it that they could speak of.

    A list keeps its `!replace`, which says that what is not in it any more was meant to go.
    """
    match node:
        case Scalar():
            return node
        case Mapping():
            return _settled_map(node, report)
        case NodeSequence(items=items):
            inner = tuple(_settled(item, report) for item in items)
            return node if all(map(is_, inner, items)) else replace(node, items=inner)


def _is_removal(node: Node) -> bool:
    return isinstance(node, Mapping) and node.tag == REMOVE


def _settled_map(node: Mapping, report: Report) -> Mapping:
    """Return a map without tags; the same object if there are none."""
    changed: dict[str, Entry] = {}
    for name, entry in node.entries.items():
        value = entry.value
        if isinstance(value, Scalar):
            continue
        if _is_removal(value):
            message = f"'!remove' has nothing to remove '{name}' from"
            report.add(NOT_AN_OVERLAY.at(value.span, message, help="it belongs in a profile"))
            changed[name] = Entry(entry.key, Scalar("", value.span, filled=BROKEN))  # so that nobody misses it
        elif (inner := _settled(value, report)) is not value:
            changed[name] = Entry(entry.key, inner)
    return Mapping({**node.entries, **changed}, node.span) if changed or node.tag else node


def read_sets(
    sets: Sequence[str], root: Mapping, report: Report, sources: dict[str, str], *, of_include: bool = False
) -> list[tuple[Mapping, str]]:
    """Return one overlay for each `PATH=VALUE`; together they are one source, a line for each.

    Those of `include` come in a run of their own, since parts are read before all else is composed.
    """
    if sets:
        sources[SET] = "\n".join(text.replace("\n", " ") for text in sets)
    overlays = (
        _set_overlay(text.replace("\n", " "), line, root, report)
        for line, text in enumerate(sets, 1)
        if (text.partition("=")[0].strip().partition(".")[0] == INCLUDE) is of_include
    )
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
    if len(path) == 2 and path[0] in ("components", "muxes") and not _is_removal(value):
        message = f"'{SET}' does not say what of '{path[1]}' to change"
        report.add(BAD_SET.at(span, message, help=f"write {SET} {path[1]}.KEY=VALUE"))
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
            fix = in_section(names, root) or suggest(rest[0] if rest else "", choices, "a path begins with")
            report.add(NOTHING_TO_CHANGE.at(span, message, help=fix))
            return None
    return [section, *rest]


def in_section(names: Sequence[str], root: Mapping) -> str:
    """Return the help for a path that begins with a name of a section, not with the section; else nothing."""
    for section in NAMED_MAPS:
        named = root.get(section)
        if isinstance(named, Mapping) and names[0] in named:
            return f"did you mean '{section}.{'.'.join(names)}'?"
    return ""


def _set_value(text: str, line: int, column: int, report: Report) -> Node | None:
    """Read the value of a `--set`; blank lines and columns before it make its places those of the argument."""
    if not text.strip():
        return Scalar("", Span(SET, line, column, line, column + 1))
    node, findings = read_text("\n" * (line - 1) + " " * column + text, SET)
    report.extend(findings)
    return node
